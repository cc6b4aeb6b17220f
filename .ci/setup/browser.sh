#!/usr/bin/env bash
# The browser that the tests open pages in.
. "$(dirname "$0")/lib.sh"

command -v chromium >/dev/null || install_packages chromium
