#!/usr/bin/env bash
# Makes the stream of `htvm demo`, apps/htvm/demo/person.htvm, which the program carries inside: make.sh HTVM [OUT.htvm]
# Five seconds of a synthetic person's tour, from its second second on: the first is a T-pose.
set -euo pipefail
htvm=$1 out=${2:-$(dirname "$0")/person.htvm}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$htvm" synth "$work/capture" --frames 150 --first-frame 30 --vertices 15000 --surface-noise 0.25 --quiet
"$htvm" encode "$work/capture" -o "$out" --title "A synthetic person" --quiet
