#!/bin/sh
# Checks a finished map with other people's programs: gis.sh MAP.btms [BTMS-PROGRAM [upper]]
# Needs gdal-bin, netcdf-bin, python3-h5py, python3-netcdf4 and python3-xarray. With the btms program, heights are compared with its `query` too.
# With `upper`, the map must list further surfaces somewhere.
set -eu
map=$(realpath "$1")
btms=${2:-}
wanted=${3:-}
[ -z "$btms" ] || btms=$(realpath "$btms")
view=$map/map.nc
layer=NETCDF:$view:elevation
fail() { echo "gis.sh: $*" >&2; exit 1; }

for tool in gdalinfo gdallocationinfo ncdump; do
  command -v $tool > /dev/null || fail "$tool is missing (gdal-bin, netcdf-bin)"
done
python=/usr/bin/python3
$python -c 'import h5py, netCDF4, xarray' 2> /dev/null || fail "python3-h5py, python3-netcdf4 or python3-xarray is missing"
cd /   # relative names inside the map must not depend on where the reader stands

# ncdump reads the whole structure, and the values of every layer of the view.
ncdump -h "$view" | grep -q 'Conventions = "CF-1.8"' || fail "ncdump: no CF conventions in map.nc"
ncdump -v elevation,class "$view" > /dev/null || fail "ncdump can't read the layers"

# Every point the middle of a square whose height is known: x y z.
points=$($python - "$map" "$wanted" << 'EOF'
import glob, json, sys
import h5py
import numpy as np
folder, wanted = sys.argv[1:]
manifest = json.load(open(folder + "/manifest.json"))
view = h5py.File(folder + "/map.nc", "r")
x, y, z = view["x"][:], view["y"][:], view["elevation"]
r = manifest["layout"]["resolution_mm"] / 1000
assert len(x) < 2 or abs(abs(x[1] - x[0]) - r) < 1e-6 or manifest["crs_wkt"], "x is not spaced by r"
assert (np.diff(x) > 0).all() and (np.diff(y) < 0).all(), "axes do not run east and south"
centre = view["tgf/centre_height"]
seen, listed, points = 0, 0, []
for shard in manifest["shards"]:
    part = h5py.File(folder + "/shards/" + shard["file"], "r")
    here = part["elevation"][:]                 # through the stock filters
    row = int(round((y[0] - part["y"][0]) / (y[0] - y[1]))) if len(y) > 1 else 0
    col = int(round((part["x"][0] - x[0]) / (x[1] - x[0]))) if len(x) > 1 else 0
    rows, cols = here.shape
    there = z[row:row + rows, col:col + cols]
    assert np.array_equal(here, there, equal_nan=True), shard["file"] + " is not where map.nc shows it"
    raw = centre[row:row + rows, col:col + cols]
    known = ~np.isnan(here)
    assert ((raw != -2**31) == known).all(), "elevation and tgf differ about what is known"
    assert (here[known] == (raw[known] / 1000).astype("f4")).all(), "elevation differs from tgf"
    if "upper" in part["tgf"]:
        upper = part["tgf/upper"][:]            # indices of CF's compression by gathering
        assert (np.diff(upper) >= 0).all() and upper[0] >= 0 and upper[-1] < part["tgf/state"].size, "bad list"
        _, i, j = np.unravel_index(upper, part["tgf/state"].shape)
        least = np.full(here.shape, np.inf)
        np.minimum.at(least, (i, j), part["tgf/upper_height"][:] / 1000)
        least[np.isinf(least)] = np.nan
        assert np.array_equal(part["upper_elevation"][:], least.astype("f4"), equal_nan=True), \
            "upper_elevation is not the least height listed for its square"
        listed += len(upper)
    else:
        assert np.isnan(part["upper_elevation"][:]).all(), "upper_elevation shows what no list has"
    seen += int(known.sum())
    where = np.argwhere(known)
    for i, j in where[:: max(1, len(where) // 3)][:3]:
        points.append((x[col + j], y[row + i], float(here[i, j])))
assert seen > 0, "no height anywhere"
assert listed > 0 or wanted != "upper", "no list of further surfaces anywhere"
for p in points[:: max(1, len(points) // 12)][:12]:
    print("%.6f %.6f %.6f" % p)
EOF
) || fail "h5py found map.nc and shards differ"

# xarray: the raster with its axes, and the whole model in its group.
$python - "$view" << 'EOF' || fail "xarray reads something else than h5py"
import sys
import h5py
import numpy as np
import xarray
raw = h5py.File(sys.argv[1], "r")
with xarray.open_dataset(sys.argv[1]) as d:
    assert d.elevation.dims == ("y", "x") and (d.x.values == raw["x"][:]).all() and (d.y.values == raw["y"][:]).all()
    assert np.array_equal(d.elevation.values, raw["elevation"][:], equal_nan=True)
with xarray.open_dataset(sys.argv[1], group="tgf") as d:
    assert d.state.dims[0] == "tri" and d.state.shape == raw["tgf/state"].shape
EOF

# GDAL: origin, size of a pixel, north up, reference system.
info=$(gdalinfo "$layer")
echo "$info" | grep -q '^Origin = ' || fail "gdalinfo: map.nc is not georeferenced"
echo "$info" | grep -Eq '^Pixel Size = \([0-9.]+,-[0-9.]+\)' || fail "gdalinfo: north is not up"
echo "$info" | grep -q 'NoData Value=nan' || fail "gdalinfo: no nodata value"
first=$(ls "$map"/shards/*.nc | head -1)
gdalinfo "NETCDF:$first:elevation" | grep -q '^Origin = ' || fail "gdalinfo: shards are not georeferenced"
epsg=$($python -c '
import json, re, sys
wkt = json.load(open(sys.argv[1]))["crs_wkt"]
code = re.search(r"ID\[\"EPSG\",(\d+)\]\]$", wkt)
print(code.group(1) if code else "")' "$map/manifest.json")
if [ -n "$epsg" ]; then
  for file in "$view" "$first"; do
    gdalinfo "NETCDF:$file:elevation" | grep -q "^ *ID\[\"EPSG\",$epsg\]\]" || fail "gdalinfo: EPSG:$epsg lost in $file"
  done
fi

# Heights: GDAL, and the program itself.
n=0
echo "$points" | {
  while read -r x y z; do
    gdal=$(gdallocationinfo -valonly -geoloc "$layer" "$x" "$y")
    awk -v a="$gdal" -v b="$z" 'BEGIN { d = a - b; exit !(a != "" && d < 0.0005 && d > -0.0005) }' ||
      fail "at $x,$y GDAL reads $gdal, HDF5 $z"
    if [ -n "$btms" ]; then
      own=$("$btms" query "$map" --at "$x,$y" --json | $python -c 'import json, sys; print(json.load(sys.stdin)["z"])')
      # A centre belongs to one of its cell's four triangles: only another one may have a plane there.
      [ "$own" != None ] || continue
      # float32 metres hold a millimetre up to 8 km
      awk -v a="$gdal" -v b="$own" 'BEGIN { d = a - b; exit !(a != "" && d < 0.0015 && d > -0.0015) }' ||
        fail "at $x,$y GDAL reads $gdal, btms query says $own"
    fi
    n=$((n + 1))
  done
  [ "$n" -gt 0 ] || fail "no point was compared"
  echo "gis.sh: $map: georeferenced${epsg:+ (EPSG:$epsg)}, $n heights agree"
}
