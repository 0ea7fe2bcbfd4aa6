#!/usr/bin/env bash
# examples/slurm on a real Slurm of one node, in a folder of its own: tests/slurm/run.sh HTVM
# Needs root, as slurmd does, and Debian's slurm-wlm and munge; neither needs to run, or is touched if it does.
set -euo pipefail
htvm=$(realpath "$1")
examples=$(cd "$(dirname "$0")/../../examples/slurm" && pwd)
work=$(mktemp -d)
daemons=()
stop() {
    for daemon in "${daemons[@]}"; do kill "$daemon" 2>/dev/null || true; done
    wait
    rm -rf "$work"
}
trap stop EXIT
fail() {
    echo "FAILED: $*"
    tail -n 20 "$work"/*.log
    exit 1
}

# ---- A cluster of one node ------------------------------------------------------------------------------------------

chmod 755 "$work" # mktemp's 700 is no place for munge's socket
mkdir "$work/munge" "$work/state" "$work/spool" "$work/bin" "$work/cgroup"
ln -s "$htvm" "$work/bin/htvm"
head -c 1024 /dev/urandom >"$work/munge/key"
chmod 600 "$work/munge/key"
free_port() { python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }
export SLURM_CONF=$work/slurm.conf
cat >"$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmUser=root
SlurmctldPort=$(free_port)
SlurmdPort=$(free_port)
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
NodeName=$(hostname -s) NodeAddr=127.0.0.1 CPUs=4 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
# More processors than there may be, so that tasks run at the same time.
echo "SlurmdParameters=config_overrides" >>"$SLURM_CONF"
printf "CgroupPlugin=cgroup/v1\nCgroupMountpoint=%s\n" "$work/cgroup" >"$work/cgroup.conf" # not used, but slurmd wants one
munged --foreground --force --socket="$work/munge/socket" --key-file="$work/munge/key" --pid-file="$work/munge/pid" \
    --log-file="$work/munge.log" --seed-file="$work/munge/seed" 2>/dev/null &
daemons+=($!)
for _ in $(seq 50); do [ -S "$work/munge/socket" ] && break || sleep 0.1; done
slurmctld -D -c >"$work/slurmctld.log" 2>&1 &
daemons+=($!)
slurmd -D -N "$(hostname -s)" >"$work/slurmd.log" 2>&1 &
daemons+=($!)
for _ in $(seq 100); do sinfo -h -o %t 2>/dev/null | grep -q idle && break || sleep 0.3; done
sinfo -h -o %t | grep -q idle || fail "the node does not come up"

# ---- The example ----------------------------------------------------------------------------------------------------

export PATH=$work/bin:$PATH
cd "$work"
# finished: waits until no job is left.
finished() {
    for _ in $(seq 600); do
        squeue -h 2>/dev/null | grep -q . || return 0
        sleep 0.2
    done
    fail "jobs do not end: $(squeue)"
}
htvm synth capture --frames 34 --vertices 600 --quiet
options=(--skeleton capture/skeleton.json --keyint 10)
htvm encode capture "${options[@]}" --jobs 1 -o whole.htvm --quiet
"$examples/submit.sh" 3 capture person.htvm "${options[@]}"
finished
cmp whole.htvm person.htvm || fail "the parts of three tasks are not the whole"
[ ! -e person.htvm.parts ] || fail "parts are left"

# A task that fails: the others' parts stay, and the whole is made once it was run again.
mv capture/frame_00015.ply good.ply
echo nonsense >capture/frame_00015.ply
"$examples/submit.sh" 3 capture again.htvm "${options[@]}"
finished
[ ! -e again.htvm ] || fail "parts are joined although one failed"
grep -q "frames 10 to 19 failed: capture/frame_00015.ply" again.htvm.parts/*.log || fail "the log does not say what failed"
mv good.ply capture/frame_00015.ply
sbatch --array=2 --output=again.log "$examples/encode.sbatch" 3 capture again.htvm.parts "${options[@]}" >/dev/null
finished
sbatch --output=join.log "$examples/join.sbatch" again.htvm.parts again.htvm >/dev/null
finished
cmp whole.htvm again.htvm || fail "the whole is another where a task ran again"
echo "an array of tasks encodes the whole, byte by byte"
