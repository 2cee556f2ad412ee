#!/bin/bash
# Job arrays: parts at once and one after another, killed and started again, end with the digest of one build.
#   tests/arrays.sh BTMS
# Uses real data, too, where BTMS_DATA names its folder.
[ -n "${BASH_VERSION:-}" ] || exec bash "$0" "$@"
set -euo pipefail
case ${1:---help} in -h | --help) sed -n '2,4s/^# //p' "$0"; exit 0 ;; esac
btms=$(realpath "$1")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
map=$folder/map.btms
digest() { "$btms" digest "$1" | grep -oE '[0-9a-f]{32}' | head -1; }
part() { "$btms" build "${inputs[@]}" -o "$map" --part "$1" --wait "$2" --threads 1 --quiet >/dev/null 2>&1; }
check() {
  [ "$(digest "$map")" = "$wanted" ] || { echo "another digest: $*"; exit 1; }
  rm -rf "$map"
}

trial() { # NAME INPUT...
  local name=$1 n i turns
  shift
  inputs=("$@")
  rm -rf "$folder/one.btms"
  "$btms" build "${inputs[@]}" -o "$folder/one.btms" --quiet >/dev/null
  wanted=$(digest "$folder/one.btms")
  for n in 1 2 3 5; do
    for i in $(seq "$n"); do part "$i/$n" 300 & done
    wait
    "$btms" join "$map" >/dev/null
    check "$name, $n parts at once"
    turns=0
    until "$btms" join "$map" >/dev/null 2>&1; do
      turns=$((turns + 1))
      for i in $(seq "$n"); do
        status=0
        part "$i/$n" 0 || status=$?
        [ "$status" = 0 ] || [ "$status" = 5 ] || { echo "$name: part $i of $n ended with $status"; exit 1; }
      done
    done
    check "$name, $n parts one after another"
    echo "$name: $n part(s), at once and one after another ($turns turns): one digest"
  done
}

"$btms" synth --points 500000 -o "$folder/city" --quiet >/dev/null
trial city "$folder/city"
if [ -n "${BTMS_DATA:-}" ]; then
  trial AHN3 "$BTMS_DATA"/city/ahn3_delft_1.las
  trial forest "$BTMS_DATA"/forest/*.las
fi

"$btms" synth --points 3000000 -o "$folder/large" --quiet >/dev/null
inputs=("$folder/large")
rm -rf "$folder/one.btms"
"$btms" build "${inputs[@]}" -o "$folder/one.btms" --quiet >/dev/null
wanted=$(digest "$folder/one.btms")
# Two processes for a part; other parameters; another number of parts.
"$btms" build "${inputs[@]}" -o "$map" --part 1/2 --wait 60 --threads 1 --quiet >/dev/null 2>&1 & one=$!
until [ -e "$map.parts/about.json" ]; do sleep 0.05; done
refused() {
  local status=0
  "$btms" build "${inputs[@]}" -o "$map" --quiet "${@:3}" >/dev/null 2>"$folder/why" || status=$?
  [ "$status" = "$1" ] && grep -q "$2" "$folder/why" || { echo "not refused: ${*:3}"; cat "$folder/why"; exit 1; }
}
refused 1 "part 1 of 2 is at work already" --part 1/2
refused 2 "another build: resolution" --part 2/2 --resolution 4
refused 2 "messages of 2 parts" --part 2/3
kill -TERM "$one"
wait "$one" || true
rm -rf "$map" "$map.parts"
echo "a second process for a part, other parameters, another number of parts: refused"

hit=0
for k in $(seq 20); do
  part 1/3 300 & one=$!
  part 2/3 300 & two=$!
  "$btms" build "${inputs[@]}" -o "$map" --part 3/3 --wait 300 --threads 1 --quiet >/dev/null 2>&1 & victim=$!
  sleep "$(awk -v r="$RANDOM" 'BEGIN { print 0.1 + 1.5 * r / 32768 }')"
  if kill -KILL "$victim" 2>/dev/null; then hit=$((hit + 1)); fi
  wait "$victim" 2>/dev/null || true
  if "$btms" info "$map" >/dev/null 2>&1; then [ "$(digest "$map")" = "$wanted" ] || { echo "half a map"; exit 1; }; fi
  part 3/3 300
  wait "$one" "$two"
  "$btms" join "$map" >/dev/null
  check "kill $k"
done
echo "20 kills of a part, $hit while it ran: no half map, one digest"
