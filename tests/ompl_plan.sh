#!/bin/sh
# Runs the example of docs/routing.md on a small city: ompl_plan.sh BTMS OMPL_PLAN
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$1" synth --points 2000000 -o "$folder/truth" --quiet
"$1" build "$folder/truth" -o "$folder/city.btms" --quiet
"$2" "$folder/city.btms" 220 95 385 275 "$folder/plan.png" | tee "$folder/said"
grep -q 'straight line is blocked' "$folder/said"
grep -q 'safe all along' "$folder/said"
[ "$(head -c 4 "$folder/plan.png" | tail -c 3)" = PNG ]
