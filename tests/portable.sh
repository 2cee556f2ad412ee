#!/bin/sh
# Builds the program a second time, as CPUs without AVX2 run it, and compares the digests of the same maps, of every
# preset. BTMS_WIDE=OFF leaves the AVX2 clones out; GLIBC_TUNABLES keeps the C library from its own AVX2 and FMA code.
#   tests/portable.sh PROGRAM     build/release/bin/btms, say; the second build goes to build/portable
set -eu
[ $# = 1 ] && [ "$1" != --help ] || { sed -n '2,4s/^# //p' "$0"; exit 2; }
program=$(realpath "$1")
cd "$(dirname "$0")/.."
cmake -S . -B build/portable -G Ninja -DCMAKE_BUILD_TYPE=Release -DBTMS_WIDE=OFF -DBTMS_BUILD_TESTS=OFF \
  -DBTMS_BUILD_BENCH=OFF > /dev/null
cmake --build build/portable --target btms > /dev/null
portable=build/portable/bin/btms

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT INT TERM
"$program" synth --scene city --points 300000 -o "$folder/city" --quiet
"$program" synth --scene city --drive --scans 3 --beams 16 --azimuths 512 -o "$folder/drive" --quiet
presets=$("$program" build --help | sed -n 's/.*Values to start from: //p' | tr -d ',')

differ=0 compared=0
for preset in $presets; do
  for input in city drive/velodyne/000001.bin; do
    digest() {
      "$1" build "$folder/$input" --preset "$preset" -o "$folder/map" --quiet > /dev/null
      "$1" digest "$folder/map" --quiet
      rm -rf "$folder/map"
    }
    with=$(digest "$program")
    without=$(GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F digest "$portable")
    compared=$((compared + 1))
    if [ "$with" = "$without" ]; then echo "$with  $preset, $input"; else
      differ=$((differ + 1))
      echo "$with with AVX2, $without without:  $preset, $input"
    fi
  done
done
echo "$compared maps built twice: $differ differ"
[ "$compared" -ge 10 ] && [ "$differ" = 0 ]
