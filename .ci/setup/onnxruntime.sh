#!/usr/bin/env bash
# Installs the library of ONNX Runtime (MIT) and its licences from the Python wheel; all hashes are checked. With the
# argument `gpu`: that with the CUDA provider, in the folder onnxruntime-gpu; it needs the libraries of cuda.sh.
. "$(dirname "$0")/lib.sh"

version=1.31.1
case ${1:-cpu} in
cpu)
    package=onnxruntime folder=$target/lib
    wheel_sha256=5752bd508126ae7c49894d3b9d2e83f0c3d487319246d04c444b393308d7ad7f
    hashes="fc44112fbe06d7d689c57e11d3862031f64711007e4ee020f8eed5185fd2c1d3  libonnxruntime.so.$version"
    ;;
gpu)
    package=onnxruntime-gpu folder=$target/onnxruntime-gpu
    wheel_sha256=e26c475fe361b2015f45b4b824bd13f0bb20204e59b62814e6f0acd5f3d491a6
    hashes="5104254339ecadae808da771bd0b63b240f0dbd466514234905e54372435c303  libonnxruntime.so.$version
d5290158115fa5569a3fe8f1f4037ee9b0e86658a96e52f852bbb7039aa88137  libonnxruntime_providers_cuda.so
086ec1d5388f64153d9c63470d126693db9a182c8ce236d3a1119068471b8a0d  libonnxruntime_providers_shared.so"
    ;;
*) fail "unknown argument $1: expected gpu or none" ;;
esac
library=$folder/libonnxruntime.so.$version
[ ! -e "$library" ] || [ ! -e "$folder/LICENSE" ] || exit 0

find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
attempt=$folder/attempt
rm -rf "$attempt"
mkdir -p "$attempt"
echo "$package==$version --hash=sha256:$wheel_sha256" >"$attempt/requirements.txt"
"$python" -m pip download --quiet --disable-pip-version-check --no-input --no-deps --require-hashes \
    --only-binary=:all: --platform manylinux_2_28_x86_64 --python-version 3.11 --implementation cp \
    -d "$attempt" -r "$attempt/requirements.txt"
"$python" -m zipfile -e "$attempt"/onnxruntime*.whl "$attempt"
(cd "$attempt/onnxruntime/capi" && sha256sum --check --quiet <<<"$hashes")
while read -r _ file; do mv "$attempt/onnxruntime/capi/$file" "$folder"; done <<<"$hashes"
mv "$attempt"/onnxruntime/{ThirdPartyNotices.txt,LICENSE} "$folder"
rm -rf "$attempt"
say "$library"
