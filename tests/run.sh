#!/bin/sh
# Installs what is missing, builds, runs every test.
#   tests/run.sh [--all]         --all: also what other programs read of a map (GDAL, netCDF, h5py, xarray)
set -eu
cd "$(dirname "$0")/.."

all=
for argument in "$@"; do
  case $argument in
    --all) all=yes ;;
    -h | --help) sed -n '2,3s/^# //p' "$0"; exit 0 ;;
    *) echo "run.sh: unknown option $argument" >&2; exit 2 ;;
  esac
done

if [ -n "$all" ]; then cmake/install-deps.sh --gis; else cmake/install-deps.sh; fi
cmake --preset release
cmake --build --preset release
if [ -n "$all" ]; then
  folder=$(mktemp -d)
  trap 'rm -rf "$folder"' EXIT
  btms=build/release/bin/btms
  $btms synth --scene city --points 200000 -o "$folder/truth"
  $btms build "$folder/truth" -o "$folder/city.btms" --crs EPSG:25832
  tests/gis.sh "$folder/city.btms" "$btms" upper
fi
ctest --preset release --parallel 2
