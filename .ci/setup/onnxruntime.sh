#!/usr/bin/env bash
# Installs the library of ONNX Runtime (MIT) and its licences from the Python wheel; the hashes of both are checked.
. "$(dirname "$0")/lib.sh"

version=1.31.1
wheel_sha256=5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f
library_sha256=fc44112fbe06d7d689c57e11d3862031f64711007e4ee020f8eed5185fd2c1d3
library=$target/lib/libonnxruntime.so.$version
[ ! -e "$library" ] || [ ! -e "$target/lib/LICENSE" ] || exit 0

find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
attempt=$target/lib/attempt
rm -rf "$attempt"
mkdir -p "$attempt"
echo "onnxruntime==$version --hash=sha256:$wheel_sha256" >"$attempt/requirements.txt"
"$python" -m pip download --quiet --disable-pip-version-check --no-input --no-deps --require-hashes \
    --only-binary=:all: --platform manylinux_2_28_x86_64 --python-version 3.11 --implementation cp \
    -d "$attempt" -r "$attempt/requirements.txt"
"$python" -m zipfile -e "$attempt"/onnxruntime-*.whl "$attempt"
found=("$attempt"/onnxruntime/capi/libonnxruntime.so*)
echo "$library_sha256  ${found[0]}" | sha256sum --check --quiet
mv "${found[0]}" "$library"
mv "$attempt"/onnxruntime/{ThirdPartyNotices.txt,LICENSE} "$target/lib"
rm -rf "$attempt"
say "$library"
