#!/usr/bin/env bash
# Bundles three.js, its GLTF loader and orbit controls, and three-vrm (all MIT) into one module of the viewer's page, with
# esbuild, which is pinned by version and hash. `--check` compares the committed bundle with a rebuilt one.
. "$(dirname "$0")/lib.sh"

page=src/view/page
[ "$(uname -sm)" = "Linux x86_64" ] || fail "the bundle is built on Linux x86_64"
.ci/setup/vrm.sh
modules=$(realpath "${ORATOR_VRM:-$target/vrm}/node_modules")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
need_npm
npm_package @esbuild/linux-x64 0.28.2 9573bb2233aab0f9ea7647d5cca9726113cc1768de61d66b17267f4db84488f6 "$work/esbuild"

cat >"$work/entry.js" <<'END'
export { AnimationMixer, Box3, DirectionalLight, GridHelper, HemisphereLight, LoopOnce, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";
export { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
export { VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";
export { VRMAnimationLoaderPlugin, VRMLookAtQuaternionProxy, createVRMAnimationClip } from "@pixiv/three-vrm-animation";
END
ln -s "$modules" "$work/node_modules"
# Relative paths: the bundle does not depend on the folder.
(cd "$work" && esbuild/bin/esbuild entry.js --bundle --minify --format=esm --target=es2022 --charset=utf8 \
    --legal-comments=none --preserve-symlinks --log-level=warning --outfile=three.js)
# Comments of shaders stay in the bundle otherwise.
sed -i -E '/^[[:space:]]*\/\/ /d' "$work/three.js"
! grep -qE '\beval\(|new Function\b|\bFunction\(' "$work/three.js" || fail "the bundle evaluates text as code"

# Version of the package in a folder.
version() { node -p 'require(process.argv[1]).version' "$1/package.json"; }
{
    echo "three.js of this folder bundles the packages below."
    for package in three @pixiv/three-vrm @pixiv/three-vrm-animation; do
        printf '\n%s %s\n\n' "$package" "$(version "$modules/$package")"
        sed 's/\r$//' "$modules/$package/LICENSE"
    done
} >"$work/three.LICENSES.txt"

for file in three.js three.LICENSES.txt; do
    if [ "${1:-}" = --check ]; then
        cmp "$work/$file" "$page/$file" || fail "$page/$file differs from its sources: run .ci/setup/page.sh"
    else
        cp "$work/$file" "$page/$file"
    fi
done
say "$page/three.js: $(stat -c %s "$page/three.js") bytes"
