#!/bin/sh
# From a fresh clone to a map: installs what is missing, builds, makes a synthetic city, maps it, labels its points and
# compares the labels with the truth. Everything it makes is in build/ and demo/; running it again is quick.
#   apps/demo.sh [POINTS]        default: 2000000
set -eu
cd "$(dirname "$0")/.."

points=${1:-2000000}
demo=demo
btms=build/release/bin/btms

cmake/install-deps.sh
echo "== Building"
cmake --preset release >/dev/null
cmake --build --preset release --target btms

echo "== A city of about $points points"
stamp=$demo/truth/.made-with
wanted="city $points seed 1, 4 files"
if [ "$(cat "$stamp" 2>/dev/null || true)" != "$wanted" ]; then
  rm -rf "$demo/truth"
  $btms synth --scene city --points "$points" --seed 1 --files 4 -o "$demo/truth"
  echo "$wanted" >"$stamp"
fi

echo "== The map"
$btms build "$demo/truth" -o "$demo/city.btms" --picture "$demo/city.png"

echo "== Labels"
$btms label "$demo/city.btms" "$demo/truth" -o "$demo/labelled"

echo "== Labels against the truth"
$btms eval --truth "$demo/truth" --prediction "$demo/labelled" --classes

echo
echo "map      $PWD/$demo/city.btms"
echo "picture  $PWD/$demo/city.png"
echo "labels   $PWD/$demo/labelled"
