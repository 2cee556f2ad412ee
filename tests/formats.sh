#!/bin/bash
# Every point file under a folder through `btms info`, `build` and `label`, one after the other.
#   tests/formats.sh BTMS FOLDER
# Prints a line a file, and at the end how many of them made it. Exit code 1 when one did not, or when a LAZ file has
# another map than the LAS file beside it.
set -euo pipefail
case ${1:-} in '' | -h | --help) sed -n '2,5s/^# //p' "$0"; exit $(($# == 0 ? 2 : 0)) ;; esac
btms=$1 data=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# Example files of 30 points make no surface at the preset's resolution.
parameters_of() {
  case $1 in *.bin) echo --preset single-scan ;; *) echo --preset city ;; esac
  if "$btms" info "$1" --json | grep -Eq '"points": ?[0-9]{1,2},?$'; then echo --resolution 64; fi
}

files=0 good=0 twins=0 same=0
while IFS= read -r -d '' file; do
  files=$((files + 1))
  rm -rf "$work"/*
  begun=$EPOCHREALTIME
  # shellcheck disable=SC2046  # words
  if "$btms" info "$file" >"$work/log" 2>&1 &&
    "$btms" build "$file" -o "$work/map.btms" $(parameters_of "$file") --quiet >"$work/log" 2>&1 &&
    "$btms" label "$work/map.btms" "$file" -o "$work/labels" --quiet >"$work/log" 2>&1; then
    good=$((good + 1)) word=done
  else
    word="FAILED: $(grep -m1 error: "$work/log" || tail -1 "$work/log")"
  fi
  twin=
  if [ "$word" = done ] && [ "${file%.laz}" != "$file" ] && [ -f "${file%.laz}.las" ]; then
    twins=$((twins + 1))
    # shellcheck disable=SC2046  # words
    "$btms" build "${file%.laz}.las" -o "$work/twin.btms" $(parameters_of "$file") --quiet >/dev/null 2>&1
    if [ "$("$btms" digest "$work/map.btms")" = "$("$btms" digest "$work/twin.btms")" ]; then
      same=$((same + 1)) twin=", digest equal to the LAS file's"
    else
      twin=", digest UNLIKE the LAS file's"
    fi
  fi
  awk -v a="$begun" -v b="$EPOCHREALTIME" -v f="${file#"$data"/}" -v w="$word$twin" \
    'BEGIN { printf "%-60s %6.1f s  %s\n", f, b - a, w }'
done < <(find "$data" -type f \( -iname '*.las' -o -iname '*.laz' -o -iname '*.pcd' -o -iname '*.ply' -o -iname '*.xyz' -o -iname '*.csv' -o -path '*/velodyne/*.bin' \) -print0 | sort -z)

echo "$good of $files files built and labelled; $same of $twins LAZ files with the digest of their LAS twin"
[ "$files" -gt 0 ] && [ "$good" = "$files" ] && [ "$same" = "$twins" ]
