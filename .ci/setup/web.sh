#!/usr/bin/env bash
# Installs ONNX Runtime for browsers (MIT) in the folder ORATOR_WEB; the hash of the package is checked.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_WEB:-$target/web}
[ ! -e "$folder/node_modules" ] || exit 0

need_npm
rm -rf "$folder.attempt" "$folder"
npm_package onnxruntime-web 1.30.0 d2228df7e4616bc3348bf504ee888f3bec43789a273f0a63f3e68d203ce3bf71 \
    "$folder.attempt/node_modules/onnxruntime-web"
mv "$folder.attempt" "$folder"
say "$folder"
