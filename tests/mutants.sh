#!/bin/sh
# Breaks the engine on purpose, one way at a time, and expects the invariance suite to fail each time.
#   sh tests/mutants.sh          all mutants (about 10 minutes), after a look whether the suite passes without any
#   sh tests/mutants.sh NAME...  some of them
#   sh tests/mutants.sh --sanitized NAME...  the same by a few quick tests, built with the address and undefined
#                                            behaviour sanitizers, which have to pass without a mutant first
# Works on a copy of the sources; the checkout is not touched.
set -eu
flags= tests= look=
if [ "${1:-}" = --sanitized ]; then
  shift
  flags='-DCMAKE_BUILD_TYPE=RelWithDebInfo -DBTMS_SANITIZE=address,undefined,float-cast-overflow -DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1'
  tests=--gtest_filter=InvarianceScene.OfThePredecessorsMode:InvarianceScene.OfTies:InvarianceScene.CoarseToFineBelowAMetre
  look=yes
fi
[ $# -gt 0 ] || look=yes
root=$(cd "$(dirname "$0")/.." && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM
mkdir "$work/source"
(cd "$root" && tar cf - CMakeLists.txt cmake engine io apps tests bench) | (cd "$work/source" && tar xf -)

# name | file | sed script
mutants() {
  cat <<'TABLE'
link-halo|engine/tiling/build.cpp|s/exchange_halo(table, nodes, kLinkHalo, /exchange_halo(table, nodes, kLinkHalo - 1, /
merge-halo|engine/tiling/link_pass.cpp|s/exchange_halo(context.table, ids, kLinkHalo, /exchange_halo(context.table, ids, kLinkHalo - 1, /
complete-halo|engine/tiling/build.cpp|s/exchange_halo(table, nodes, reach, /exchange_halo(table, nodes, reach - 1, /
fit-halo|engine/tiling/build.cpp|s/exchange_halo(table, nodes, kFitHalo, /exchange_halo(table, nodes, kFitHalo - 1, /
moments-in-double|engine/terrain/lane_moments.h|s/^  Sum n{}, x{}, /  Lanes metres_x{};\n&/; s/^    x += kx;/&\n    metres_x += (keep ? px : Lanes{}) * 1e-3;/; s/^  const Lanes n = to_lanes(m.n), scale/  const_cast<Moments<Sum>\&>(m).x = lanes_to<Sum>(m.metres_x * 1e3);\n&/
kernel-sum-in-doubles|engine/terrain/completion.cpp|s/^    z += lanes_to<Sum>(k) \* /    plain_k += kernel_polynomial(t) * to_lanes_within(d9 < reach9);\n    plain_z += kernel_polynomial(t) * to_lanes_within(d9 < reach9) * terms.at(Terms::kZ, i);\n&/; s/^  Sum support{}, z{}, /  Lanes plain_k{}, plain_z{};\n&/; s/^  m.normal = {total(nx)/  m.plain_z = total(plain_z) \/ total(plain_k);\n&/; s/^  std::int64_t support = 0, z = 0;/&\n  double plain_z = 0;/; s/static_cast<double>(means.z) \/ support/means.plain_z/; s/^BTMS_INLINE Lanes round_lanes/BTMS_INLINE Lanes to_lanes_within(const LongLanes\& m) { return m ? Lanes{} + 1.0 : Lanes{}; }\n&/
candidate-dropped|engine/tiling/neighbour_index.cpp|s/for (const auto& \[i, distance2\] : found_) squares/if (!found_.empty()) found_.pop_back();\n    &/
level-link-halo|engine/tiling/level_link.cpp|s/rules.completion_halo()) : kLinkHalo;/rules.completion_halo()) : kLinkHalo - 1;/
level-complete-halo|engine/tiling/level_build.cpp|s/exchange_halo(table, nodes.fields, rules.completion_halo(), /exchange_halo(table, nodes.fields, rules.completion_halo() - 1, /
level-corner-halo|engine/tiling/level_build.cpp|s/exchange_halo(table, completed, kFitHalo, /exchange_halo(table, completed, kFitHalo - 1, /
told-halo|engine/tiling/level_link.cpp|s/rules.completion_halo()) : kLinkHalo;/rules.completion_halo()) - 1 : kLinkHalo;/
told-names|engine/tiling/level_link.cpp|s/pairs.insert(pairs.end(), names.begin(), names.end())/pairs.insert(pairs.end(), names.begin(), names.begin())/
told-verdicts|engine/tiling/level_link.cpp|s/if (j != i) for_each_node(strip, judge_node)/if (false) for_each_node(strip, judge_node)/
scatter-halo|engine/tiling/level_finish.cpp|s/(coarsest, scatters, kScatterHalo, /(coarsest, scatters, kScatterHalo - 1, /
layer-step-halo|engine/tiling/layer_pass.cpp|s/exchange_halo(table, corners, kStepHalo, /exchange_halo(table, corners, kStepHalo - 1, /
layer-cost-halo|engine/tiling/layer_pass.cpp|s/exchange_halo(table, costs, vehicle.rings(), /exchange_halo(table, costs, vehicle.rings() - 1, /
sheet-halo|engine/tiling/above_pass.cpp|0,/exchange_halo(table, sheets, kLinkHalo, /s//exchange_halo(table, sheets, kLinkHalo - 1, /
sheet-components-not-merged|engine/tiling/above_pass.cpp|s/merged(components, links, /merged(components, {}, /
sheet-joints-of-one-tile|engine/tiling/above_pass.cpp|s/total[[]merged.whole(s.component)[]] += /total[merged.whole(s.component)] = /
sums-of-one-rank|engine/tiling/merged_components.h|s/values[[]part.number[]] += part.value/values[part.number] = part.value/
islands-of-one-rank|engine/tiling/merged_components.h|s/^    if (ranks_.size() == 1) return;/    return;/
links-of-one-rank|engine/tiling/merged_components.h|s/^    for (const Pair& pair : ranks.gather(same))/    for (const Pair\& pair : same)/
span-halo|engine/tiling/span_pass.cpp|s/exchange_halo(context.table, heights, span.halo(), /exchange_halo(context.table, heights, span.halo() \/ 3, /
visiting-order|engine/tiling/link_pass.cpp|s/members_[[]merged_.whole(c.id)[]] += /members_[merged_.whole(c.id)] = /
parked-unwritten|engine/tiling/link_pass.cpp|s/"merge", {writes(nodes), /"merge", {reads(nodes), /
update-far-verdicts|engine/tiling/level_link.cpp|s/(known\[i\].rejected\[k\] != 0)) far/(known[i].rejected[k] != 0) \&\& false) far/
update-reach|engine/tiling/level_build.cpp|s/TileSet wanted = within(table, completed_anew, kFitHalo)/TileSet wanted = within(table, completed_anew, 0)/
update-far-bridges|engine/tiling/above_pass.cpp|s/if (!join_tiles\[i\] \&\& now != v) overturned/if (false) overturned/
lowest-by-order|engine/tiling/ordered_points.cpp|s/^    lowest = std::min(lowest, points.z_mm\[i\]/    if (lowest >> 32 > points.z_mm[i]) lowest = std::min(lowest, points.z_mm[i]/
TABLE
}

cmake -S "$work/source" -B "$work/build" -G Ninja -DBTMS_BUILD_BENCH=OFF $flags > "$work/log" 2>&1 || { cat "$work/log"; exit 1; }
run_suite() {
  cmake --build "$work/build" --target btms_invariance > "$work/log" 2>&1 || { cat "$work/log"; echo "does not compile"; exit 1; }
  timeout 900 "$work/build/bin/btms_invariance" --gtest_fail_fast $tests > "$work/log" 2>&1 || true
}
failed() { grep -q '^\[  FAILED  \]' "$work/log"; }  # a crash or a hang is not a test that noticed
if [ -n "$look" ]; then
  run_suite
  grep -q '^\[  PASSED  \]' "$work/log" && ! failed || { cat "$work/log"; echo "the suite fails without a mutant"; exit 1; }
fi

killed=0 alive=0
mutants | while IFS='|' read -r name file script; do echo "$name"; done > "$work/names"
for name in $(if [ $# -gt 0 ]; then echo "$@"; else cat "$work/names"; fi); do
  line=$(mutants | grep "^$name|") || { echo "no mutant '$name'; there are:"; cat "$work/names"; exit 2; }
  file=$(printf "%s\n" "$line" | cut -d"|" -f2)
  mutants | sed -n "s/^$name|[^|]*|//p" > "$work/script"
  cp "$work/source/$file" "$work/saved"
  sed -i -f "$work/script" "$work/source/$file"
  if cmp -s "$work/saved" "$work/source/$file"; then echo "$name: the sed script no longer finds its place in $file"; exit 1; fi
  run_suite
  if failed; then
    killed=$((killed + 1))
    echo "killed  $name by $(grep -m1 -oE '^\[  FAILED  \] [A-Za-z.]+' "$work/log" | cut -c14-)"
  else
    alive=$((alive + 1))
    echo "ALIVE   $name"
  fi
  cp "$work/saved" "$work/source/$file"
done
echo "$killed passed, $alive failed"
[ "$alive" -eq 0 ]
