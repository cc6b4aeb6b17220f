# shellcheck shell=bash
# Functions of the installers in this folder. Each installer installs one dependency, asks for root only if a Debian
# package is missing, does nothing if everything is installed, and can be run from any folder.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

# Folder of build outputs, and of everything that is installed without root.
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

# Installs the given Debian packages if they are missing.
need_packages() {
    local missing=() package
    for package in "$@"; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed$' || missing+=("$package")
    done
    [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
}

# Installs node and npm if they are missing.
need_npm() {
    local missing=()
    command -v node >/dev/null || missing+=(nodejs)
    command -v npm >/dev/null || missing+=(npm)
    [ ${#missing[@]} -eq 0 ] || install_packages "${missing[@]}"
}

# Downloads an npm package at a version, checks its hash and unpacks it into a folder.
npm_package() {
    local name=$1 version=$2 sha256=$3 folder=$4 packed
    mkdir -p "$folder"
    npm pack --silent --pack-destination "$folder" "$name@$version" >/dev/null
    packed=$(ls "$folder"/*.tgz)
    echo "$sha256  $packed" | sha256sum --check --quiet
    tar -xzf "$packed" -C "$folder" --strip-components=1
    rm "$packed"
}

# Sets `python` to the first of the given Pythons that has pip and the version in the first argument ("3.11", or "3" for
# any); if there is none, installs the Python of Debian and tries again. Fails if there is still none.
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

# Installs the Python packages of a list into a separate folder, and copies the list there to mark the installation as
# complete.
pip_folder() {
    local list=$1 folder=$2
    shift 2
    rm -rf "$folder"
    "$python" -m pip install --quiet --disable-pip-version-check --no-input --root-user-action ignore \
        --no-warn-conflicts --no-deps "$@" --target "$folder" -r "$list"
    cp "$list" "$folder/.installed"
    say "$folder"
}

# Succeeds if the packages of a list are already installed in a folder.
pip_folder_is_there() { cmp -s "$1" "$2/.installed"; }
