// Label files, as `btms eval` pairs and counts them.
#include <algorithm>

#include "apps/btms/eval_files.h"
#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {

void labels(Bytes bytes) {
  Front front(bytes);
  const std::uint8_t mode = front.byte();
  const auto names = label_map_names();
  const TruthRules rules = rules_of_label_map(names[mode % names.size()]);
  const Bytes truth = front.take(front.word());
  const std::size_t n = truth.size() / 4;
  const EvalPair pair{"pair",
                      file_of(truth, ".label"),
                      file_of(front.rest(), mode >= 128 ? ".labels" : ".las"),  // the links differ by extension
                      {}};
  accepted([&] {
    const EvalResult result = evaluate(pair, rules);
    require(result.points + result.left_out == n, "every point of the truth is counted");
    std::uint64_t points = 0;
    for (const auto& [id, count] : result.classes) {
      require(id <= 0xFFFF && count.terrain <= count.points, "a class is counted once a point");
      points += count.points;
    }
    require(points == result.points, "the classes' points are all points");
    const std::vector<Verdict> all = verdicts(pair, rules);
    require(all.size() == n, "a verdict a point");
  });
}

}  // namespace btms::fuzz
