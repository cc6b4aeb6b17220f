#!/usr/bin/env bash
# Installs Blender as a Python module in the folder ORATOR_BLENDER. The module requires Python 3.11; if that is not
# available, its tests are skipped and listed.
. "$(dirname "$0")/lib.sh"

list=tests/blender.txt
folder=${ORATOR_BLENDER:-$target/blender}
pip_folder_is_there "$list" "$folder" && exit 0
if ! find_python 3.11 python3.11 python3 /usr/bin/python3; then
    echo 'SKIPPED: no Python 3.11 with pip here, so no Blender: its tests skip' >&2
    exit 0
fi
need_packages libx11-6 libxrender1 libxfixes3 libxi6 libxkbcommon0 libsm6 libgl1
pip_folder "$list" "$folder" --no-cache-dir
