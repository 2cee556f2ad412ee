#!/bin/sh
# Installs what is built into a prefix, moves it, uses it; builds a project that finds it by find_package alone; makes the
# Debian package and looks into it.
#   tests/package.sh [BUILD]     default: build/release. The package stays in BUILD/package.
set -eu
cd "$(dirname "$0")/.."
build=${1:-build/release}
fail() { echo "package.sh: $1" >&2; exit 1; }

cmake --build "$build" --target installed
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

echo "== Installed, and moved elsewhere"
cmake --install "$build" --prefix "$folder/first" >/dev/null
mv "$folder/first" "$folder/prefix"
btms=$folder/prefix/bin/btms
$btms --version | head -1
[ "$($btms man)" = "$(cat "$folder/prefix/share/man/man1/btms.1")" ] || fail "the manual page is another program's"
[ "$($btms completion bash)" = "$(cat "$folder/prefix/share/bash-completion/completions/btms")" ] || fail "the completion is another program's"
if command -v man >/dev/null; then
  said=$(man --warnings -l "$folder/prefix/share/man/man1/btms.1" 2>&1 >/dev/null)
  [ -z "$said" ] || fail "the manual page: $said"
fi
grep -rl "$PWD" "$folder/prefix/lib/cmake" "$folder/prefix/include" && fail "files name the folder of the build"
grep -rlE '#include <(hdf5|proj|nlohmann|boost|tbb)' "$folder/prefix/include" && fail "headers include what only the libraries need"
(cd "$folder" && sh prefix/share/btms/demo.sh 50000 >demo.txt) || fail "the demo"
map=$folder/btms-demo/city.btms

echo "== Serves its page from where it is"
if [ -e "$folder/prefix/share/btms/viewer/index.html" ]; then
  $btms serve "$map" --port 0 >"$folder/serve.txt" 2>&1 &
  server=$!
  for _ in $(seq 100); do grep -q 'http://' "$folder/serve.txt" && break; sleep 0.1; done
  url=$(grep -o 'http://[0-9.:]*' "$folder/serve.txt" | head -1)
  curl -fsS "$url/" | grep -q '<script' || fail "no page at $url"
  kill $server
  wait $server || true
else
  echo "left out: the page was not built"
fi

echo "== A project with find_package(Btms) alone"
cmake -S tests/consumer -B "$folder/consumer" -DCMAKE_PREFIX_PATH="$folder/prefix" -DCMAKE_BUILD_TYPE=Release >"$folder/cmake.txt" ||
  { cat "$folder/cmake.txt"; fail "the consumer isn't configured"; }
cmake --build "$folder/consumer" >"$folder/make.txt" || { cat "$folder/make.txt"; fail "the consumer isn't built"; }
said=$("$folder/consumer/consumer" "$map" 50 50)
echo "$said"
height=$(echo "$said" | sed -n 's/^height \([-0-9.]*\) ok$/\1/p')
query=$($btms query "$map" --at 50,50 --json | sed -n 's/^ *"z": \([-0-9.]*\).*/\1/p' | head -1)
[ "$(printf '%.3f' "${query:-none}")" = "$height" ] || fail "the consumer says $height, btms query $query"

echo "== The Debian package"
rm -rf "$build/package"
(cd "$build" && cpack -B package >cpack.txt 2>&1) || { cat "$build/cpack.txt"; fail "no package"; }
package=$(echo "$build"/package/btms_*.deb)
dpkg-deb --field "$package"
dpkg-deb --contents "$package" >"$folder/contents.txt"
for path in bin/btms include/btms/engine/error.h lib/libbtms_engine.a lib/cmake/Btms/BtmsConfig.cmake share/man/man1/btms.1 \
  share/bash-completion/completions/btms share/doc/btms/copyright share/btms/config.schema.json share/btms/demo.sh; do
  grep -q " ./usr/$path\$" "$folder/contents.txt" || fail "no $path in the package"
done
! grep -q 'usr/local\| \./[^u. ]' "$folder/contents.txt" || fail "files outside /usr"
dpkg-deb --field "$package" Depends | grep -q libhdf5 || fail "the package depends on nothing"
echo "$package: $(du -h "$package" | cut -f1)"
