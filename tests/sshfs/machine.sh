#!/bin/sh
# One of several machines on a network folder, as root on Linux with Debian's sshfs and openssh-sftp-server:
# `machine.sh NAME SERVED MOUNT COMMAND...` runs the command under the host name NAME with processes of its own. There
# MOUNT shows the folder SERVED by sshfs, whose caches tell what others did up to 20 s late. Killing this script is
# a machine that is lost.
set -eu
name=$1 served=$2 mount=$3
shift 3
server=$(mktemp)
printf '#!/bin/sh\nexec /usr/lib/openssh/sftp-server\n' >"$server"
chmod +x "$server"
# shellcheck disable=SC2016
exec unshare --mount --uts --pid --fork --kill-child --mount-proc sh -euc '
    hostname "$1"
    sshfs -o "ssh_command=$4,dcache_timeout=20,attr_timeout=20,entry_timeout=20,negative_timeout=10" server:"$2" "$3"
    rm "$4"
    shift 4
    "$@"
' sh "$name" "$served" "$mount" "$server" "$@"
