#!/bin/sh
# A vehicle on a map that changes under it: makes a city and its map, serves it, lets follow_route drive from one side
# to the other, puts a wall across its way with `btms build --update`, and draws what it did.
#   apps/examples/follow_route.sh BTMS FOLLOW_ROUTE PICTURE [DENSITY]      DENSITY: points a square metre, whole, default 10
set -eu
btms=$1 vehicle=$2 picture=$3 density=${4-10}
folder=$(mktemp -d)
server= driver=
trap 'kill $server $driver 2>/dev/null || true; rm -rf "$folder"' EXIT

"$btms" synth --density "$density" --points $((200000 * density)) -o "$folder/truth" --quiet >/dev/null
"$btms" build "$folder/truth" -o "$folder/city.btms" --updatable --quiet >/dev/null
from=220,95 to=385,275
"$btms" route "$folder/city.btms" --from "$from" --to "$to" >"$folder/route"

# Across the way at 60 % of its places, 40 m wide and 2.5 m high.
awk '$1 != "#" { x[++n] = $1; y[n] = $2; z[n] = $3 }
  END {
    m = int(0.6 * n); dx = x[m + 1] - x[m]; dy = y[m + 1] - y[m]; d = sqrt(dx * dx + dy * dy)
    for (s = -20; s <= 20; s += 0.1) for (h = 0; h <= 2.5; h += 0.2) for (t = 0; t <= 1; t += 0.25)
      rows[++count] = sprintf("%.3f %.3f %.3f", x[m] - s * dy / d + t * dx / d, y[m] + s * dx / d + t * dy / d, z[m] + h)
    print "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1"
    print "WIDTH " count "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " count "\nDATA ascii"
    for (i = 1; i <= count; i++) print rows[i]
  }' "$folder/route" >"$folder/wall.pcd"

"$btms" serve "$folder/city.btms" --port 0 --quiet >"$folder/url" &
server=$!
until [ -s "$folder/url" ]; do kill -0 $server; sleep 0.1; done
url=$(cat "$folder/url")

"$vehicle" "${url%/}" city ${from%,*} ${from#*,} ${to%,*} ${to#*,} "$folder/city.btms" "$picture" >"$folder/said" &
driver=$!
until grep -q waiting "$folder/said"; do kill -0 $driver; sleep 0.1; done
"$btms" build "$folder/wall.pcd" -o "$folder/city.btms" --update --quiet >/dev/null
wait $driver || { cat "$folder/said"; exit 1; }
driver=
cat "$folder/said"
