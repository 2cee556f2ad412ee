#!/bin/sh
# Runs every line of shell of a page as it stands, in an empty folder: quickstart.sh BTMS PAGE. Blocks
# with a line of GDAL's programs are left out where there are none.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
page=$(cd "$(dirname "$2")" && pwd)/$(basename "$2")
PATH=$(cd "$(dirname "$1")" && pwd):$PATH
cd "$folder"
awk -v fence='```' '$0 == fence "sh" { ++n; inside = 1; next } $0 == fence { inside = 0 } inside { print > sprintf("%02d.sh", n) }' "$page"
for block in *.sh; do
  if grep -q '^gdal' "$block" && ! command -v gdalwarp >/dev/null; then
    echo "left out: gdal-bin is not installed"
    continue
  fi
  sh -eux "$block"
done
