# shellcheck shell=bash
# What the installers beside this file share. Each of them installs one thing, asks for root only where a Debian package
# is missing, does nothing where all is there, and can be run from any folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

# The folder of build outputs; what is installed without root goes below it.
# shellcheck disable=SC2034
target=${CARGO_TARGET_DIR:-target}

say() { echo "$(basename "$0" .sh): $*"; }

fail() {
    say "$*" >&2
    exit 1
}

# Installs Debian packages.
install_packages() {
    local root=()
    [ "$(id -u)" = 0 ] || root=(sudo)
    command -v apt-get >/dev/null || fail "no apt-get here: install these by hand: $*"
    say "installing $*"
    "${root[@]}" apt-get update -q </dev/null
    "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "$@" </dev/null
}

# Installs those of the named packages that are missing.
need_packages() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
}

# Installs node and npm where they are missing.
need_npm() {
    local missing=()
    command -v node >/dev/null || missing+=(nodejs)
    command -v npm >/dev/null || missing+=(npm)
    [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
}

# Unpacks a package of npm at a version, whose hash is checked, into a folder.
npm_package() {
    local name=$1 version=$2 sha256=$3 folder=$4 packed
    mkdir -p "$folder"
    npm pack --silent --pack-destination "$folder" "$name@$version" >/dev/null
    packed=$(ls "$folder"/*.tgz)
    echo "$sha256  $packed" | sha256sum --check --quiet
    tar -xzf "$packed" -C "$folder" --strip-components=1
    rm "$packed"
}

# Sets `python` to the first of the named Pythons that has pip and, where a version is given first ("3.11", or "3" for
# any), that version; installs Debian's where there is none. Fails where that does not help.
find_python() {
    local version=$1 try again
    shift
    for again in no yes; do
        for try in "$@"; do
            if "$try" -c "import sys, pip; v = '$version'.split('.'); sys.exit(list(map(str, sys.version_info[:len(v)])) != v)" \
                2>/dev/null; then
                python=$try
                return
            fi
        done
        [ $again = yes ] || install_packages python3 python3-pip
        hash -r
    done
    return 1
}

# Installs the Python packages of a list into a folder of their own, and keeps a copy of the list there as the mark that
# all of them are in place.
pip_folder() {
    local list=$1 folder=$2
    shift 2
    rm -rf "$folder"
    "$python" -m pip install --quiet --disable-pip-version-check --no-input --root-user-action ignore \
        --no-warn-conflicts --no-deps "$@" --target "$folder" -r "$list"
    cp "$list" "$folder/.installed"
    say "$folder"
}

# True where the packages of a list are in a folder already.
pip_folder_is_there() { cmp -s "$1" "$2/.installed"; }
