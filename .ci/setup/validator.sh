#!/usr/bin/env bash
# The Khronos glTF validator (Apache-2.0), in the folder ORATOR_GLTF_VALIDATOR; the hash of its package is checked.
. "$(dirname "$0")/lib.sh"

version=2.0.0-dev.3.10
sha256=4e03dbdc3bc0d1342afd5d2d7ae341a7e3474502ccb872b02dbbaddaee0fdec6
folder=${ORATOR_GLTF_VALIDATOR:-$target/validator}
[ ! -e "$folder/package.json" ] || exit 0

missing=()
command -v node >/dev/null || missing+=(nodejs)
command -v npm >/dev/null || missing+=(npm)
[ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
attempt=$folder.attempt
rm -rf "$attempt" "$folder"
mkdir -p "$attempt"
npm pack --silent --pack-destination "$attempt" "gltf-validator@$version" >/dev/null
echo "$sha256  $attempt/gltf-validator-$version.tgz" | sha256sum --check --quiet
tar -xzf "$attempt/gltf-validator-$version.tgz" -C "$attempt"
mv "$attempt/package" "$folder"
rm -rf "$attempt"
say "$folder"
