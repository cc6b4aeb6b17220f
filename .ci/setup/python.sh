#!/usr/bin/env bash
# Installs the Python packages of tests/NAME.txt in the folder ORATOR_NAME: `readers`, with which the tests read datasets,
# checkpoints and logs, and `spelling`, the spell checker.
. "$(dirname "$0")/lib.sh"

name=$1
list=tests/$name.txt
variable=ORATOR_${name^^}
folder=${!variable:-$target/$name}
pip_folder_is_there "$list" "$folder" && exit 0
find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
pip_folder "$list" "$folder"
