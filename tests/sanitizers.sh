#!/bin/sh
# Builds with sanitizers and runs the tests; any report fails.
#   tests/sanitizers.sh asan [CTEST-OPTION...]   addresses, leaks, undefined behaviour, casts out of range: all tests
#   tests/sanitizers.sh tsan [GTEST-FILTER]      data races: what runs in threads, and a planted race that must be found
# tsan needs a TBB built for it: from Debian's source package, once, into build/tsan-tbb.
set -eu
cd "$(dirname "$0")/.."
kind=${1:-}
[ $# = 0 ] || shift

# They bound what a process may allocate or ask of the system, and the address sanitizer wants terabytes of address space
# and calls of its own; they compare memory with what a plain build takes; or Python would have to be built with it.
not_under_asan='Sandbox|CheckedMap.ASound|RepairedMap.DamageToDerived|UntrustedMaps|trial_flips|DryRun.Tells|TooLittleMemory'
not_under_asan=$not_under_asan'|CliVerify.ASoundMap|CliVerify.NamesEvery|CliVerify.DiffFindsNothing|DataCli.OutliersFarOff|^python$'

case $kind in
  asan)
    export ASAN_OPTIONS=detect_leaks=1:strict_string_checks=1:detect_stack_use_after_return=1
    export UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1
    export LSAN_OPTIONS=suppressions=$PWD/tests/sanitizers.supp:print_suppressions=0
    cmake --preset asan > /dev/null
    cmake --build --preset asan
    exec ctest --preset asan --parallel 2 --exclude-regex "$not_under_asan" "$@"
    ;;
  tsan) ;;
  *) sed -n '2,5s/^# //p' "$0"; exit 2 ;;
esac

# Debian's TBB was not built for tsan: dozens of races that are none. Suppressing them would hide real ones.
tbb=$PWD/build/tsan-tbb
if [ ! -e "$tbb/lib/libtbb.so" ]; then
  rm -rf "$tbb"
  mkdir -p "$tbb/lists/partial"
  (
    cd "$tbb"
    mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Codename: bookworm' | sort -u | head -1)
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] $mirror bookworm main" > source.list
    apt="apt-get -qq -o Dir::Etc::SourceList=$tbb/source.list -o Dir::Etc::SourceParts=- -o Dir::State::Lists=$tbb/lists"
    apt="$apt -o Dir::Cache::srcpkgcache= -o Dir::Cache::pkgcache= -o APT::Sandbox::User=root"
    $apt update
    $apt source --download-only onetbb
    dpkg-source --no-check -x onetbb_*.dsc source > /dev/null
    cmake -S source -B made -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_SANITIZE=thread -DTBB_TEST=OFF -DTBB_STRICT=OFF \
      -DTBBMALLOC_BUILD=OFF -DCMAKE_INSTALL_PREFIX="$tbb" -DCMAKE_INSTALL_LIBDIR=lib > made.log 2>&1
    cmake --build made >> made.log 2>&1 && cmake --install made >> made.log 2>&1 || { cat made.log; exit 1; }
  )
fi
export LD_LIBRARY_PATH="$tbb/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
export TSAN_OPTIONS=halt_on_error=1:second_deadlock_stack=1:die_after_fork=0

# A race between two of TBB's threads: without a report the rest would say nothing.
cat > "$tbb/race.cpp" <<'RACE'
#include <tbb/parallel_for.h>
#include <atomic>
int sum = 0;
std::atomic<int> there{0};
int main() {
  for (int round = 1; round <= 100; ++round)
    tbb::parallel_for(0, 2, [round](int) {
      there.fetch_add(1, std::memory_order_relaxed);  // both at once, without an order between them
      for (int i = 0; i < 1000000 && there.load(std::memory_order_relaxed) < 2 * round; ++i) {
      }
      ++sum;
    });
  return 0;
}
RACE
g++ -std=c++20 -O1 -g -fsanitize=thread -I "$tbb/include" "$tbb/race.cpp" -o "$tbb/race" -L "$tbb/lib" -ltbb
if "$tbb/race" > "$tbb/race.log" 2>&1 || ! grep -q 'data race' "$tbb/race.log"; then
  cat "$tbb/race.log"
  echo "sanitizers.sh: the planted race was not found" >&2
  exit 1
fi
echo "the planted race was found"

cmake --preset tsan -DTBB_DIR="$tbb/lib/cmake/TBB" > /dev/null
cmake --build --preset tsan --target btms_tests btms_invariance
filter=${1:-'AboveTheSurface*:Build*:Digest*:Label*:Layer*:MapFolder*:MapStore*:Paged*:ScanSegmenter*:Terrain*:Threads*:TileCache*:Trajectory*'}
build/tsan/bin/btms_tests --gtest_filter="$filter"
build/tsan/bin/btms_invariance
