#!/usr/bin/env bash
# Sums up fuzz/run.sh's log: fuzz/report.sh BUILD
set -euo pipefail
awk '{ n[$2] += $4; s[$2] += $6; if ($8 + 0 > slow[$2]) slow[$2] = $8; if ($10 != 0) found[$2]++ }
     END {
         printf "%-16s %14s %10s %10s %12s %10s\n", "target", "executions", "seconds", "per second", "slowest, s", "runs with"
         printf "%-16s %14s %10s %10s %12s %10s\n", "", "", "", "", "", "findings"
         for (t in n) {
             printf "%-16s %14d %10d %10.0f %12d %10d\n", t, n[t], s[t], n[t] / (s[t] > 0 ? s[t] : 1), slow[t], found[t] | "sort"
             all += n[t]; seconds += s[t]
         }
         close("sort")
         printf "%-16s %14d %10d\n", "all", all, seconds
     }' "$1/fuzzing.log"
