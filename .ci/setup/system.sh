#!/usr/bin/env bash
# Installs the Debian packages for building and testing the program (strace for one test, xz-utils for archives of
# captured motion) and the Rust components.
. "$(dirname "$0")/lib.sh"

need_packages libavformat-dev libavcodec-dev libavfilter-dev libavutil-dev libswscale-dev libswresample-dev \
    libopencv-core-dev libopencv-imgproc-dev clang pkg-config g++ ffmpeg strace xz-utils ca-certificates
command -v cargo >/dev/null || fail 'no cargo; install Rust 1.89 or newer with rustup'
for tool in clippy fmt; do
    cargo "$tool" --version >/dev/null 2>&1 || rustup component add clippy rustfmt || true
done
