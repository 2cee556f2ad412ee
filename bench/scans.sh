#!/bin/sh
# The figures of "Scans and robot maps" in docs/accuracy.md as Markdown: `sh bench/scans.sh [BTMS [MAP.las...]]`, BTMS
# being a built btms (default build/release/bin/btms). Real scans are looked for in $BTMS_DATA (semantickitti/); drives
# are made on the spot where btms has `synth --drive`. MAP.las: maps of accumulated scans, class 2 terrain, 1 object,
# 0 to be ignored, 3 and 5 ambiguous (low and high). About 2 minutes.
set -eu
btms=$(realpath "${1:-$(dirname "$0")/../build/release/bin/btms}")
[ $# -eq 0 ] || shift
maps=
for map in "$@"; do maps="$maps $(realpath "$map")"; done
[ -z "${BTMS_DATA:-}" ] || data=$(realpath "$BTMS_DATA")/semantickitti
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
cd "$work"

# scores FILE: F1, accuracy, type I and II without the ambiguous class, F1 with it, of what `eval --json` says
scores() {
  awk '
    /"(with|without)_ambiguous": \{/ { part = $1 } /"mean": \{/ { mean = part } /"deviation": \{/ { mean = "" }
    mean != "" { gsub(/[",:]/, " "); value[mean, $1] = 100 * $2 }
    END { wo = "\"without_ambiguous\":"; w = "\"with_ambiguous\":"
      printf "%.2f %.2f %.2f %.2f %.2f\n", value[wo, "f1"], value[wo, "accuracy"], value[wo, "type1"],
        value[wo, "type2"], value[w, "f1"] }' "$1"
}
# scans FOLDER PRESET [FLAGS]
scans() {
  folder=$1 preset_used=$2; shift 2
  rm -rf labels
  "$btms" segment "$folder/velodyne" -o labels -q --preset "$preset_used" "$@" > segment.log
  "$btms" eval --truth "$folder/labels" --prediction labels --points "$folder/velodyne" --json > eval.json
  scores eval.json
}
# map FILE PRESET [FLAGS]; with the ambiguous class: what is low of it is terrain
map() {
  file_used=$1 preset_used=$2; shift 2
  rm -rf map labels
  "$btms" build "$file_used" -o map -q --preset "$preset_used" "$@" > build.log
  "$btms" label map "$file_used" -o labels -q > label.log
  labelled=labels/$(basename "$file_used")
  "$btms" eval --truth "$file_used" --prediction "$labelled" --terrain 2,3 --ignore 0 --json > with.json
  "$btms" eval --truth "$file_used" --prediction "$labelled" --terrain 2 --ignore 0 --ambiguous 3,5 --json > eval.json
  echo "$(scores eval.json | cut -d' ' -f1-4) $(scores with.json | cut -d' ' -f1)"
}
row() { awk -v name="$1" '{ printf "| %s | %s | %s | %s, %s | %s |\n", name, $1, $2, $3, $4, $5 }'; }
heading() {
  echo
  echo "| $1 | F1 | accuracy | type I, II | F1 with ambiguous |"
  echo '|---|---|---|---|---|'
}

heading "data, preset"
[ -z "${BTMS_DATA:-}" ] || for preset in paper-single-scan single-scan; do
  scans "$data/full_scans" $preset | row "six full scans, $preset"
  scans "$data/sequences/00" $preset | row "22 thinned scans, $preset"
done
drives=
for scene in city bumpy; do
  "$btms" synth --scene $scene --drive --scans 20 --step 15 -o "drive-$scene" -q > synth.log 2>&1 || continue
  drives="$drives drive-$scene"
  for preset in paper-single-scan single-scan; do scans "drive-$scene" $preset | row "drive, $scene, $preset"; done
done
for file in $maps; do
  for preset in paper-partial-map paper-single-scan partial-map; do
    map "$file" $preset | row "map $(basename "$file" .las), $preset"
  done
done

for file in $maps; do
  heading "map $(basename "$file" .las), partial-map"
  for r in 1 2 3 4 5 6 7 8; do map "$file" partial-map --resolution $r | row "r = $r m"; done
  for slope in 10 20 30 40; do
    limit=$(awk -v d=$slope 'BEGIN { a = d * 3.14159265 / 180; print sin(a) / cos(a) }')
    map "$file" partial-map --slope-limit "$limit" | row "slopes up to $slope deg"
  done
done

[ -n "${BTMS_DATA:-}" ] || exit 0
echo
header="| part changed: F1 | six full scans | 22 thinned scans |" rule="|---|---|---|"
for drive in $drives; do header="$header $drive |" rule="$rule---|"; done
for file in $maps; do header="$header map $(basename "$file" .las) |" rule="$rule---|"; done
echo "$header"
echo "$rule"
while read -r part flags; do
  line="| $(echo "$part" | tr - ' ')"
  for folder in "$data/full_scans" "$data/sequences/00" $drives; do
    line="$line | $(scans "$folder" single-scan $flags | cut -d' ' -f1)"
  done
  for file in $maps; do line="$line | $(map "$file" partial-map $flags | cut -d' ' -f1)"; done
  echo "$line |"
done << 'TABLE'
as-it-is
the-finest-level-alone --levels 1
levels-from-8-m-on --levels 4
finest-level-2-m --levels 5 --resolution 2
finest-level-0.5-m --resolution 0.5
fit-does-not-follow-the-ground --fit-scale-ground 0
fit-as-in-a-city --fit-scale-m 0.1 --fit-scale-slope 0.05 --fit-scale-fine-m 0.06 --fit-scale-ground 0 --ridge 0.05
near,-links,-steps-as-in-a-city --near-m 0.4 --near-per-r 0.03 --near-slope 0.2 --near-uncertainty 2 --link-m 0.5 --link-per-r 0.03 --link-flat-m 0.3 --step-m 0.5 --step-per-r 0.05
links-do-not-grow-with-r --link-per-r 0
label-height-as-in-a-city --label-least-m 0.045 --label-spread 2.5
one-point-is-enough-for-a-node --min-weight 0.9
near-rejected-only-well-above --near-residual 0.5
three-rounds-a-level --level-rounds 3
TABLE
