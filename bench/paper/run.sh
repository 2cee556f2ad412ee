#!/bin/sh
# The paper's experiments, one command each (docs/paper_tables.md):
#   sh bench/paper/run.sh table   methods against each other, single scans and a partial map
#   sh bench/paper/run.sh sweep   accuracy over resolution, slope and distance thresholds (Fig. 4): ./sweep-*/
#   sh bench/paper/run.sh drift   a partial map from drifting poses, with and without ground alignment
# Programs are those of BUILD (default build/release/bin, built when missing). Real data is looked for in
# $BTMS_DATA/semantickitti: full_scans/{velodyne,labels} and sequences/00/{velodyne,labels,poses.txt,calib.txt,
# poses_velo_icp.txt}. Without it everything runs on a drive simulated on the spot: SCANS (default 100) scans of SCENE
# (default city). Temporary files need about 100 MB.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
here=$(pwd)
bin=${BUILD:-$root/build/release/bin}
if [ ! -x "$bin/btms" ] || [ ! -x "$bin/btms_paper" ]; then
  (cd "$root" && cmake --preset release && cmake --build --preset release --target btms btms_paper) >&2
fi
btms=$bin/btms
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

say() { echo "$*" >&2; }

# Folders with scans and labels: $sets, one of them $sequence, with its $good_poses, $bad_poses and the $calib of these.
find_data() {
  data=${BTMS_DATA:+$BTMS_DATA/semantickitti}
  if [ -n "$data" ] && [ -d "$data/sequences/00/velodyne" ]; then
    sequence=$data/sequences/00
    good_poses=$sequence/poses_velo_icp.txt bad_poses=$sequence/poses.txt
    calib=$sequence/calib.txt
    sets="full_scans sequences/00"
    echo "Data: SemanticKITTI, sequence 00"
  else
    sequence=$work/drive
    say "BTMS_DATA names no SemanticKITTI: simulating a drive"
    "$btms" synth --drive --scene "${SCENE:-city}" --scans "${SCANS:-100}" -o "$sequence" -q > "$work/log"
    good_poses=$sequence/poses.txt bad_poses=$sequence/poses_drifting.txt calib=
    data=$work sets=drive
    echo "Data: a simulated drive of ${SCANS:-100} scans through the scene ${SCENE:-city}; no real data was found"
  fi
}

# accumulate OPTIONS: the partial map
accumulate() {
  "$btms" accumulate --scans "$sequence/velodyne" --labels "$sequence/labels" --voxel 0.2 "$@" -o "$work/map.las" \
    -q --force > "$work/log"
}

table() {
  find_data
  for set in $sets; do
    [ ! -d "$data/$set" ] || "$bin/btms_paper" --scans "$data/$set/velodyne" --labels "$data/$set/labels"
  done
  accumulate --poses "$good_poses"
  "$bin/btms_paper" --maps "$work/map.las"
}

sweep() {
  find_data
  for preset in paper-single-scan single-scan; do
    echo "Preset $preset, scans"
    "$btms" sweep --points "$sequence/velodyne" --truth "$sequence/labels" --preset $preset -o "$here/sweep-$preset" \
      --force -q
  done
  accumulate --poses "$good_poses"
  for preset in paper-partial-map partial-map; do
    echo "Preset $preset, map"
    "$btms" sweep --points "$work/map.las" --label-map partial-map --preset $preset -o "$here/sweep-$preset" --force -q
  done
  echo "Tables and plots: sweep-*/sweep.csv, sweep-*/sweep.svg"
}

# drift_row NAME OPTIONS
drift_row() {
  name=$1
  shift
  rm -rf "$work/map.btms" "$work/labels"
  accumulate "$@"
  "$btms" build "$work/map.las" -o "$work/map.btms" --preset partial-map -q > "$work/log"
  "$btms" label "$work/map.btms" "$work/map.las" -o "$work/labels" -q > "$work/log"
  "$btms" eval --label-map partial-map --truth "$work/map.las" --prediction "$work/labels" -q > "$work/scores"
  awk -v name="$name" 'BEGIN { part = "with" } /^Without/ { part = "without" } $1 == "map" { f1[part] = $(NF-5); a[part] = $(NF-4) }
      END { printf "| %s | %s | %s | %s | %s |\n", name, f1["with"], a["with"], f1["without"], a["without"] }' "$work/scores"
}

drift() {
  find_data
  echo "| poses | F1 w/ | A w/ | F1 w/o | A w/o |"
  echo "|---|---|---|---|---|"
  drift_row "good" --poses "$good_poses"
  drift_row "drifting" --poses "$bad_poses" ${calib:+--calib "$calib"}
  drift_row "drifting, ground aligned" --poses "$bad_poses" ${calib:+--calib "$calib"} --align-ground
}

case ${1:-} in
  table | sweep | drift) "$1" ;;
  *) say "usage: sh bench/paper/run.sh table|sweep|drift"; exit 2 ;;
esac
