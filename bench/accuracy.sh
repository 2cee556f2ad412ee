#!/bin/sh
# The measured figures of docs/accuracy.md (not those of the peers) as Markdown: `sh bench/accuracy.sh [BTMS]`, BTMS being a built btms (default
# build/release/bin/btms). Real data is looked for in $BTMS_DATA (isprs/, city/, forest/), and left out where that is
# unset; scenes are made on the spot. About 1 minute and 2 GB of temporary files.
set -eu
btms=$(realpath "${1:-$(dirname "$0")/../build/release/bin/btms}")
[ -z "${BTMS_DATA:-}" ] || data=$(realpath "$BTMS_DATA")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
cd "$work"

# score NAME FILE: builds, labels and scores a classified file
score() {
  rm -rf map labels
  "$btms" build "$2" -o map -q --preset city > build.log
  "$btms" label map "$2" -o labels -q > label.log
  "$btms" eval --truth "$2" --prediction "labels/$(basename "$2")" | awk -v name="$1" \
    'NF > 9 && $1 != "file" { printf "| %s | %s %% | %.3f | %s, %s |\n", name, $(NF-1), $NF / 100, $(NF-3), $(NF-2) }'
}

echo '| data | total error | kappa | type I, II |'
echo '|---|---|---|---|'
if [ -n "${BTMS_DATA:-}" ]; then
  for n in 11 21 23 31 42 51 53 61; do score "ISPRS sample $n" "$data/isprs/samp$n.las" >> isprs; done
  [ "$(wc -l < isprs)" = 8 ] || { echo "a sample is missing" >&2; exit 1; }
  cat isprs
  awk -F'|' '{ total += $3; kappa += $4; n++ } END { printf "| ISPRS, mean of %d | %.2f %% | %.3f | |\n", n, total / n, kappa / n }' isprs
  score "AHN3 Delft" "$data/city/ahn3_delft_1.las"
  score "1 km² tile" "$data/city/nrw_291_5744.las"
  score "hilly forest, thinned truth" "$data/forest/bcts_2.las"
fi
for scene in "city 10000000" "forest 2000000" "halls 2000000" "hillside 2000000" "overpass 2000000" "hills 2000000" "quarry 2000000"; do
  set -- $scene
  "$btms" synth --scene "$1" --points "$2" -o scene -q --force > synth.log
  score "scene $1, $2 points" "scene/$1.las"
  "$btms" eval --truth "scene/$1.las" --prediction "labels/$1.las" --classes |
    awk '$1 == 6 || $1 == 17 { print "  class " $1 ": " $(NF-1) " % called terrain" }' > "$1.classes"
  "$btms" eval --map map --scene "$1" --points "$2" --progress none > "$1.surface"
done

echo
echo '| scene, places | RMSE m | MAE m | complete % | filled % | 95 % interval holds |'
echo '|---|---|---|---|---|---|'
for surface in *.surface; do
  awk -v scene="${surface%.surface}" 'NR > 2 { n = NF; name = $1; for (i = 2; i <= n - 8; i++) if ($i !~ /^[0-9]/) name = name " " $i
    printf "| %s, %s | %s | %s | %s | %s | %s %% |\n", scene, name, $(n-6), $(n-5), $(n-2), $(n-1), $n }' "$surface"
done
echo
for classes in *.classes; do echo "${classes%.classes}:"; cat "$classes"; done
