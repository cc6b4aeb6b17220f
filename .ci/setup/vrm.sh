#!/usr/bin/env bash
# Installs the VRM reader three-vrm and three.js (all MIT) in the folder ORATOR_VRM; the package hashes are checked.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_VRM:-$target/vrm}
modules=$folder.attempt/node_modules
[ ! -e "$folder/node_modules" ] || exit 0

need_npm
rm -rf "$folder.attempt" "$folder"
npm_package three 0.187.0 ff540832ded0cfe919764d24a3d88f3e2a05f23303f876423e4f893841e90728 "$modules/three"
npm_package @pixiv/three-vrm 3.5.5 6f0102f987bc8abc9b9e78ef5b3259ea9f0dc51e30bf51d32aea6218394ea755 \
    "$modules/@pixiv/three-vrm"
npm_package @pixiv/three-vrm-animation 3.5.5 da61ce647c42876e803654156e9fb3a75ff50d8f5c31a43ae2b902114876f2ec \
    "$modules/@pixiv/three-vrm-animation"
mv "$folder.attempt" "$folder"
say "$folder"
