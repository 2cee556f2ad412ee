# shellcheck shell=bash disable=SC2034
# Sourced: builds the fuzz programs and defines how one is run. Working directory: the project's.
cmake --preset fuzz >/dev/null
cmake --build --preset fuzz >build/fuzz/build.log || { cat build/fuzz/build.log; exit 1; }
build/fuzz/bin/fuzz_seeds build/fuzz/seeds
targets=$(ls build/fuzz/seeds)

# fuzz TARGET SECONDS: sets executions, cpu_seconds (of the program and of the system for it) and find (a file, or
# empty); fails when something was found. What is new to the kept corpus gathers in build/fuzz/corpus/TARGET.
fuzz() {
  local target=$1 seconds=$2 log=build/fuzz/$1.log found=build/fuzz/finds/$1 kept status=0
  mkdir -p build/fuzz/corpus/"$target" "$found"
  kept=$(ls -d tests/fuzz/{corpus,finds}/"$target" 2>/dev/null || true)
  TIMEFORMAT='%2U %2S'
  # A small file must not take much memory: 64 MB at once is a find. A minute is not for ever on a busy machine.
  # shellcheck disable=SC2086  # folders of ours
  cpu_seconds=$({ time build/fuzz/bin/fuzz_"$target" -max_total_time="$seconds" -max_len=4096 -timeout=60 \
    -rss_limit_mb=1024 -malloc_limit_mb=64 -print_final_stats=1 -artifact_prefix="$found/" \
    build/fuzz/corpus/"$target" build/fuzz/seeds/"$target" $kept >"$log" 2>&1 </dev/null; } 2>&1) || status=$?
  cpu_seconds=$(awk '{ print $1 + $2 }' <<<"$cpu_seconds")
  executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  executions=${executions:-0}
  find=
  [ "$status" = 0 ] || find=$(sed -n "s/.*Test unit written to //p" "$log" | tail -1)
  [ "$status" = 0 ] || [ -n "$find" ] || find="exit code $status, see $log"
  return $((status != 0))
}
