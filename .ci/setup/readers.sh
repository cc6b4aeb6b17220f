#!/usr/bin/env bash
# Installs the Python packages with which the tests read datasets, checkpoints and logs in the folder ORATOR_READERS.
. "$(dirname "$0")/lib.sh"

list=tests/readers.txt
folder=${ORATOR_READERS:-$target/readers}
pip_folder_is_there "$list" "$folder" && exit 0
find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
pip_folder "$list" "$folder"
