#!/bin/bash
# btms-mpi: installs OpenMPI, builds, and checks that ranks, threads and tiles change nothing, and that a rank that dies
# leaves no half map.
#   tests/mpi.sh [quick]
# Uses real data, too, where BTMS_DATA names its folder. quick: one scene, two kills.
[ -n "${BASH_VERSION:-}" ] || exec bash "$0" "$@"
set -euo pipefail
cd "$(dirname "$0")/.."
case ${1:-} in -h | --help) sed -n '2,5s/^# //p' "$0"; exit 0 ;; esac
quick=${1:-}
sh cmake/install-deps.sh --mpi
cmake --preset release -B build/mpi -DBTMS_WITH_MPI=ON -DBTMS_BUILD_TESTS=OFF -DBTMS_BUILD_BENCH=OFF >/dev/null
cmake --build build/mpi --target btms btms-mpi >/dev/null
bin=$PWD/build/mpi/bin
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# mpi RANKS ARGUMENT...: more ranks than cores are meant to be
mpi() {
  local ranks=$1
  shift
  mpirun --oversubscribe --bind-to none -n "$ranks" "$bin/btms-mpi" "$@"
}
digest() { "$bin/btms" digest "$1" | grep -oE '[0-9a-f]{32}' | head -1; }

runs=0
# same INPUT...: every number of ranks, threads and tiles gives the digest of btms
same() {
  rm -rf "$folder/one.btms"
  "$bin/btms" build "$@" -o "$folder/one.btms" --quiet >/dev/null
  local wanted
  wanted=$(digest "$folder/one.btms")
  for ranks in $counts; do
    for threads in 1 2; do
      for cells in $tiles; do
        mpi "$ranks" build "$@" -o "$folder/map.btms" --threads "$threads" --tile-cells "$cells" --quiet >/dev/null
        [ "$(digest "$folder/map.btms")" = "$wanted" ] || { echo "another digest: $* by $ranks ranks, $threads threads, tiles of $cells"; exit 1; }
        runs=$((runs + 1))
        rm -rf "$folder/map.btms"
      done
    done
  done
}

if [ "$quick" = quick ]; then counts="2 3" tiles="2" kills=2 points=500000; else counts="1 2 3 5 8" tiles="1 3 auto" kills=20 points=10000000; fi
"$bin/btms" synth --points "$points" -o "$folder/city" --quiet
same "$folder/city"
if [ -n "${BTMS_DATA:-}" ] && [ "$quick" != quick ]; then
  same "$BTMS_DATA"/city/ahn3_delft_1.las
  same "$BTMS_DATA"/forest/*.las
fi
echo "$runs runs, one digest a cloud"

# Labels are those of btms, from files dealt out to ranks; verify finds what is wrong, whoever has the shard.
"$bin/btms" build "$folder/city" -o "$folder/map.btms" --quiet >/dev/null
for i in 1 2 3 4; do cp "$folder"/city/*.las "$folder/city$i.las"; done
"$bin/btms" label "$folder/map.btms" "$folder"/city?.las -o "$folder/labels" --quiet >/dev/null
mpi 3 label "$folder/map.btms" "$folder"/city?.las -o "$folder/labels_mpi" --quiet >/dev/null
diff -r "$folder/labels" "$folder/labels_mpi"
mpi 3 verify "$folder/map.btms" --quiet >/dev/null
shard=$(find "$folder/map.btms/shards" -type f | sort | tail -1)
printf X | dd of="$shard" bs=1 seek=5000 conv=notrunc status=none
status=0
mpi 3 verify "$folder/map.btms" --quiet >"$folder/said" 2>/dev/null || status=$?
if [ "$status" != 4 ] || ! grep -q "$(basename "$shard")" "$folder/said"; then
  echo "verify: status $status"; cat "$folder/said"; exit 1
fi
rm -rf "$folder"/city?.las "$folder"/labels* "$folder/map.btms"
echo "label and verify: as btms"

# Beyond the memory: into a folder of all ranks, or one of each.
wanted=$("$bin/btms" build "$folder/city" -o "$folder/one.btms" --quiet >/dev/null; digest "$folder/one.btms")
for rank in 0 1 2; do mkdir "$folder/spill$rank"; done
for spill in "$folder" "$folder/spill\$OMPI_COMM_WORLD_RANK"; do
  mpirun --oversubscribe --bind-to none -n 3 sh -c "exec '$bin/btms-mpi' build '$folder/city' -o '$folder/map.btms' --memory 128M --spill \"$spill\" --json --quiet" >"$folder/said"
  [ "$(digest "$folder/map.btms")" = "$wanted" ] || { echo "another digest with --spill $spill"; exit 1; }
  rm -rf "$folder/map.btms"
done
grep -o '"spilled_bytes": *[0-9]*' "$folder/said" | awk -v quick="$quick" '$2 == 0 && quick == "" { exit 1 } { print "spilled by three ranks: " $2 " bytes, one digest" }'

# Another number of ranks goes on from what a killed run has left.
began=$(date +%s%N)
mpi 3 build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --quiet >/dev/null
whole_ms=$((($(date +%s%N) - began) / 1000000))
rm -rf "$folder/map.btms"
hit=0
for i in $(seq "$kills"); do
  mpi 3 build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --checkpoint-every 0.1 --quiet >/dev/null 2>"$folder/said" &
  run=$!
  sleep "$(awk -v ms="$whole_ms" -v r="$RANDOM" 'BEGIN { print 0.2 + (ms / 1000 - 0.2) * r / 32768 }')"
  victim=$(pgrep -f "$bin/btms-mpi build" | grep -vx "$run" | shuf -n 1 || true)
  [ -z "$victim" ] || kill -KILL "$victim" 2>/dev/null || true
  if ! wait "$run"; then
    hit=$((hit + 1))
    # It may be mpirun that was killed: ranks notice.
    for _ in $(seq 300); do pgrep -f "$bin/btms-mpi build" >/dev/null || break; sleep 0.1; done
    resume=--resume
    [ -d "$folder/map.btms" ] || resume=
    # A map that is there is whole: the kill came after it was published. Otherwise other ranks go on.
    # shellcheck disable=SC2086  # no word when there is nothing to take up
    "$bin/btms" info "$folder/map.btms" >/dev/null 2>&1 ||
      mpi $((i % 4 + 1)) build "$folder/city" -o "$folder/map.btms" --threads 1 --tile-cells 2 --checkpoint-every 0.1 --quiet $resume >/dev/null
  fi
  [ "$(digest "$folder/map.btms")" = "$wanted" ] || { echo "another digest, or half a map, after kill $i"; exit 1; }
  rm -rf "$folder/map.btms"
done
echo "$kills kills, $hit of running jobs: no half map, one digest after --resume"

best() { # of five, in seconds; without the start of mpirun, which is as long for any number of points
  for _ in 1 2 3 4 5; do
    rm -rf "$folder/map.btms"
    mpi "$1" build "$folder/city" -o "$folder/map.btms" --threads "$1" --json --quiet | grep '^  "seconds"' | grep -oE '[0-9.]+'
  done | sort -g | head -1
}
one=$(best 1)
two=$(best 2)
[ "$quick" = quick ] || tests/mpi_hosts.sh
awk -v one="$one" -v two="$two" -v n="$points" 'BEGIN { printf "%d points: 1 rank %.2f s, 2 ranks %.2f s, %.2f times as fast\n", n, one, two, one / two }'
