#!/bin/bash
# Fuzzes every target for a short time, from the kept corpus on.
#   tests/fuzz/run.sh [SECONDS]      a target, 10 unless told
# Needs clang: cmake/install-deps.sh --fuzz. Exit code 1 when something was found; finds are in build/fuzz/finds/TARGET.
# A find is mended, and kept as a small file in tests/fuzz/finds/TARGET, which the ordinary tests replay.
set -euo pipefail
cd "$(dirname "$0")/../.."
case ${1:-} in -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
seconds=${1:-10}
source tests/fuzz/programs.sh

found=0
for target in $targets; do
  fuzz "$target" "$seconds" || found=$((found + 1))
  echo "$target: $executions executions in ${cpu_seconds} s of CPU time$([ -z "$find" ] || echo ", found: $find")"
done
echo "$found of $(wc -w <<<"$targets") targets with a find"
[ "$found" = 0 ]
