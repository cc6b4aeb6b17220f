#!/usr/bin/env bash
# Installs the spell checker in the folder ORATOR_SPELLING.
. "$(dirname "$0")/lib.sh"

list=tests/spelling.txt
folder=${ORATOR_SPELLING:-$target/spelling}
pip_folder_is_there "$list" "$folder" && exit 0
find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
pip_folder "$list" "$folder"
