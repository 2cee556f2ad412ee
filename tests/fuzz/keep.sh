#!/bin/bash
# Makes the kept corpus anew: the fewest files that reach all code that any known one does, in tests/fuzz/corpus.
#   tests/fuzz/keep.sh
set -euo pipefail
cd "$(dirname "$0")/../.."
case ${1:-} in -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;; esac
source tests/fuzz/programs.sh

for target in $targets; do
  kept=tests/fuzz/corpus/$target
  mkdir -p "$kept" build/fuzz/corpus/"$target"
  rm -rf build/fuzz/kept build/fuzz/known
  mkdir build/fuzz/kept
  cp -r build/fuzz/corpus/"$target" build/fuzz/known  # a run that goes on changes them
  build/fuzz/bin/fuzz_"$target" -set_cover_merge=1 -use_counters=0 -max_len=4096 build/fuzz/kept \
    "$kept" build/fuzz/known build/fuzz/seeds/"$target" >build/fuzz/"$target".log 2>&1
  rm -rf "$kept"
  mv build/fuzz/kept "$kept"
  echo "$target: $(ls "$kept" | wc -l) files, $(cat "$kept"/* | wc -c) bytes"
done
