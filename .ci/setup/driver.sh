#!/usr/bin/env bash
# Installs puppeteer-core, which controls the installed browser, and axe-core, which finds accessibility problems
# (Apache-2.0 and MPL-2.0), in the folder ORATOR_DRIVER; the lock file in the folder driver pins versions and hashes.
. "$(dirname "$0")/lib.sh"

folder=${ORATOR_DRIVER:-$target/driver}
lock=.ci/setup/driver
! cmp -s "$lock/package-lock.json" "$folder/package-lock.json" || exit 0

need_npm
rm -rf "$folder.attempt" "$folder"
mkdir -p "$folder.attempt"
cp "$lock"/package*.json "$folder.attempt"
npm ci --prefix "$folder.attempt" --silent --ignore-scripts --no-audit --no-fund
mv "$folder.attempt" "$folder"
say "$folder"
