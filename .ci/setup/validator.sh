#!/usr/bin/env bash
# Installs the Khronos glTF validator (Apache-2.0) in the folder ORATOR_GLTF_VALIDATOR; the package hash is checked.
. "$(dirname "$0")/lib.sh"

version=2.0.0-dev.3.10
sha256=4e03dbdc3bc0d1342afd5d2d7ae341a7e3474502ccb872b02dbbaddaee0fdec6
folder=${ORATOR_GLTF_VALIDATOR:-$target/validator}
[ ! -e "$folder/package.json" ] || exit 0

need_npm
rm -rf "$folder.attempt" "$folder"
npm_package gltf-validator "$version" "$sha256" "$folder.attempt"
mv "$folder.attempt" "$folder"
say "$folder"
