#!/bin/sh
# From a fresh clone to a map: installs what is missing, builds, makes a synthetic city, maps it, labels its points and
# compares the labels with the truth. Everything it makes is in build/ and demo/; running it again is quick.
#   apps/demo.sh [POINTS]        default: 2000000
# The same with an installed program, in btms-demo/ of the folder one is in:  sh /usr/share/btms/demo.sh [POINTS]
set -eu
here=$(cd "$(dirname "$0")" && pwd)

usage() { sed -n '2,5s/^# //p' "$here/demo.sh"; }
refuse() {
  echo "demo.sh: $1" >&2
  usage >&2
  exit 2
}

points=2000000
[ $# -le 1 ] || refuse "expected at most one argument"
case ${1-$points} in
  -h | --help) usage; exit 0 ;;
  '' | *[!0-9]*) refuse "unknown argument $1" ;;
  *) points=${1-$points} ;;
esac
demo=demo

if [ -e "$here/../CMakeLists.txt" ]; then
  cd "$here/.."
  btms=$PWD/build/release/bin/btms
  echo "== 1/6 Installing the Debian packages that are missing (the first time about 1 minute)"
  cmake/install-deps.sh
  echo "== 2/6 Building (the first time about 5 minutes; the rest takes seconds)"
  cmake --preset release >/dev/null
  cmake --build --preset release --target btms
else
  demo='btms-demo'  # in the folder of whoever calls
  btms=$(cd "$here/../../bin" && pwd)/btms
  echo "== 1/6 and 2/6, installing and building, are done: $btms"
fi

echo "== 3/6 A city of about $points points, with the truth in its classes"
stamp=$demo/truth/.made-with
wanted="city $points seed 1, 4 files"
if [ "$(cat "$stamp" 2>/dev/null || true)" != "$wanted" ]; then
  rm -rf "$demo/truth"
  $btms synth --scene city --points "$points" --seed 1 --files 4 -o "$demo/truth"
  echo "$wanted" >"$stamp"
fi

echo "== 4/6 The map"
$btms build "$demo/truth" -o "$demo/city.btms" --picture "$demo/city.png"

echo "== 5/6 Labels"
$btms label "$demo/city.btms" "$demo/truth" -o "$demo/labelled" --force

echo "== 6/6 Labels against the truth"
$btms eval --truth "$demo/truth" --prediction "$demo/labelled" --classes

echo
echo "map      $PWD/$demo/city.btms"
echo "picture  $PWD/$demo/city.png"
echo "labels   $PWD/$demo/labelled"
echo
echo "Look at it in a browser, or ask it over HTTP (docs/http_api.md):  $btms serve $demo/city.btms"
[ -e "${btms%/bin/btms}/share/btms/viewer/index.html" ] ||
  echo "The page needs npm where the program is built: cmake/install-deps.sh --viewer."
