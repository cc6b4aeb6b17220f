#!/usr/bin/env bash
# Installs the word aligner as a Python package in the folder ORATOR_ALIGNER, and espeak-ng, whose word times are known.
. "$(dirname "$0")/lib.sh"

need_packages espeak-ng libespeak-ng1 espeak-ng-data
list=tests/aligner.txt
folder=${ORATOR_ALIGNER:-$target/aligner}
pip_folder_is_there "$list" "$folder" && exit 0
find_python 3 python3 /usr/bin/python3 || fail 'no pip for any python3'
pip_folder "$list" "$folder"
