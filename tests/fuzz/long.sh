#!/bin/bash
# Fuzzes for so many seconds of CPU time, and adds them to tests/fuzz/totals.txt.
#   tests/fuzz/long.sh CPU-SECONDS
# One process, a minute at a time; the target with the least time so far is next. Stop it whenever you like: what is done
# is counted. Finds are in build/fuzz/finds/TARGET. tests/fuzz/keep.sh keeps what was learned.
set -euo pipefail
cd "$(dirname "$0")/../.."
case ${1:---help} in -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
wanted=$1
source tests/fuzz/programs.sh

totals=tests/fuzz/totals.txt
[ -f "$totals" ] || echo "# target, CPU seconds, executions, finds" >"$totals"
for target in $targets; do
  grep -q "^$target " "$totals" || echo "$target 0 0 0" >>"$totals"
done

spent=0
while awk "BEGIN { exit !($spent < $wanted) }"; do
  target=$(grep -v '^#' "$totals" | sort -s -g -k2,2 | head -1 | cut -d' ' -f1)
  finds=0
  fuzz "$target" 60 || { [ ! -f "$find" ] || finds=1; }
  awk -v name="$target" -v cpu="$cpu_seconds" -v runs="$executions" -v finds="$finds" \
    '$1 == name { $2 = sprintf("%.2f", $2 + cpu); $3 += runs; $4 += finds } { print }' "$totals" >"$totals.new"
  mv "$totals.new" "$totals"
  spent=$(awk "BEGIN { print $spent + $cpu_seconds }")
  echo "$target: $executions executions, $cpu_seconds s${find:+, found: $find}"
done
awk '!/^#/ { cpu += $2; runs += $3; finds += $4 }
  END { printf "%.0f s of CPU time (%.2f h), %d executions, %d finds in all\n", cpu, cpu / 3600, runs, finds }' "$totals"
