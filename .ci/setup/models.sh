#!/usr/bin/env bash
# The pose models for real people, by the program's own `models fetch`, in the folder ORATOR_MODELS. Where ORATOR_DATA has
# models or what they are made of, those serve as a mirror; what no place has is told and left out.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_MODELS:-$target/models}
mirror=()
[ ! -d "${ORATOR_DATA:-}/models" ] || mirror=(--mirror "$ORATOR_DATA/models")
command -v npm >/dev/null || install_packages npm
"$target/release/orator" models fetch --all --models-dir "$folder" "${mirror[@]}" || [ $? = 2 ]
