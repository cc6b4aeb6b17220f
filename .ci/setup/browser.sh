#!/usr/bin/env bash
# Installs Chromium, with which the tests open pages.
. "$(dirname "$0")/lib.sh"

command -v chromium >/dev/null || install_packages chromium
