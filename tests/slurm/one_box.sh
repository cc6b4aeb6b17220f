#!/bin/sh
# A Slurm of this one machine, from Debian's packages slurm-wlm and munge, as root: `one_box.sh start DIR` and
# `one_box.sh stop DIR`. Two nodes where slurmd was built for several on a machine, else one. State and logs lie in DIR;
# export SLURM_CONF=DIR/slurm.conf to use it.
set -eu
dir=$2
case $1 in
start)
    mkdir -p "$dir/state" "$dir/spool" /run/munge
    chown munge:munge /run/munge
    pgrep -x munged >/dev/null || runuser -u munge -- munged
    host=$(hostname -s)
    cores=$(nproc)
    common="RealMemory=1024 State=UNKNOWN"
    cat >"$dir/slurm.conf" <<END
ClusterName=box
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool/%n
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd-%n.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd-%n.log
SlurmdTimeout=10
MinJobAge=600
SchedulerParameters=sched_interval=2,bf_interval=2
KillWait=5
END
    if slurmd -C -N one >/dev/null 2>&1 && slurmd -h 2>&1 | grep -q -- '-N'; then nodes="one two"; else nodes=$host; fi
    port=17001
    for node in $nodes; do
        echo "NodeName=$node NodeHostname=$host NodeAddr=127.0.0.1 Port=$port CPUs=$cores $common" >>"$dir/slurm.conf"
        port=$((port + 1))
    done
    echo "PartitionName=main Nodes=ALL Default=YES OverSubscribe=FORCE:4 State=UP" >>"$dir/slurm.conf"
    slurmctld -f "$dir/slurm.conf"
    for node in $nodes; do slurmd -f "$dir/slurm.conf" -N "$node"; done
    export SLURM_CONF="$dir/slurm.conf"
    for _ in $(seq 50); do
        if [ "$(sinfo -h -o %T 2>/dev/null | sort -u)" = idle ]; then exit 0; fi
        sleep 0.2
    done
    sinfo >&2
    tail -5 "$dir"/*.log >&2
    exit 1
    ;;
stop)
    for pid in "$dir"/*.pid; do [ ! -e "$pid" ] || kill "$(cat "$pid")" 2>/dev/null || true; done
    ;;
esac
