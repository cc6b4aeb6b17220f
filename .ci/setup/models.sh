#!/usr/bin/env bash
# Installs the pose models for real people with `orator models fetch` in the folder ORATOR_MODELS. If ORATOR_DATA has
# models or their source files, it is used as a mirror; models that no source has are reported and skipped.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_MODELS:-$target/models}
mirror=()
[ ! -d "${ORATOR_DATA:-}/models" ] || mirror=(--mirror "$ORATOR_DATA/models")
command -v npm >/dev/null || install_packages npm
"$target/release/orator" models fetch --all --models-dir "$folder" "${mirror[@]}" || [ $? = 2 ]
