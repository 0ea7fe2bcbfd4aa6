#!/usr/bin/env bash
# A long capture on a Slurm cluster: submit.sh JOBS CAPTURE OUT.htvm [OPTIONS OF htvm encode...]
# Each of JOBS tasks encodes a part of the capture into the folder OUT.htvm.parts; once all have succeeded, a last job
# joins them to OUT.htvm and removes the folder. See README.md.
set -euo pipefail
[ $# -ge 3 ] || { sed -n '2,4s/^# //p' "$0" >&2; exit 2; }
scripts=$(cd "$(dirname "$0")" && pwd)
jobs=$1 capture=$2 out=$3
shift 3
parts=$out.parts
mkdir "$parts" # fails where one is at work, or failed: what it left is no part of this
array=$(sbatch --parsable --array="1-$jobs" --output="$parts/%a.log" "$scripts/encode.sbatch" \
    "$jobs" "$capture" "$parts" "$@")
last=$(sbatch --parsable --dependency="afterok:$array" --kill-on-invalid-dep=yes --output="$out.log" \
    "$scripts/join.sbatch" "$parts" "$out")
echo "array job $array encodes parts to $parts (logs: $parts/*.log); job $last joins them to $out (log: $out.log)"
