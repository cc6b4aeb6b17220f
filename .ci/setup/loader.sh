#!/usr/bin/env bash
# Installs autocannon, a load generator (MIT), in the folder ORATOR_LOADER; the lock file in the folder loader pins
# versions and hashes.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_LOADER:-$target/loader}
lock=.ci/setup/loader
! cmp -s "$lock/package-lock.json" "$folder/package-lock.json" || exit 0

need_npm
rm -rf "$folder.attempt" "$folder"
mkdir -p "$folder.attempt"
cp "$lock"/package*.json "$folder.attempt"
npm ci --prefix "$folder.attempt" --silent --ignore-scripts --no-audit --no-fund
mv "$folder.attempt" "$folder"
say "$folder"
