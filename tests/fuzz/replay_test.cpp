// The kept files of the fuzz targets, through the readers as they are built here: what fuzzing has found, and the
// corpus.
#include <gtest/gtest.h>

#include <ostream>
#include <typeinfo>

#include "tests/fuzz/fuzz.h"

namespace btms::fuzz {

void PrintTo(const Target& target, std::ostream* out) { *out << target.name; }  // for ctest's names

namespace {

class Replay : public testing::TestWithParam<Target> {};

TEST_P(Replay, KeptFilesBreakNoPromise) {
  const Target& target = GetParam();
  std::size_t files = 0;
  for (const char* kind : {"finds", "corpus"}) {
    const auto kept = std::filesystem::path(BTMS_SOURCE_DIR) / "tests/fuzz" / kind / target.name;
    if (!std::filesystem::exists(kept)) continue;
    for (const auto& entry : std::filesystem::directory_iterator(kept)) {
      ++files;
      try {
        target.run(content(entry.path()));
      } catch (const std::exception& e) {
        ADD_FAILURE() << entry.path() << ": " << typeid(e).name() << ": " << e.what();
      }
    }
  }
  EXPECT_GT(files, 0u);
}

INSTANTIATE_TEST_SUITE_P(Fuzz, Replay, testing::ValuesIn(targets().begin(), targets().end()),
                         [](const auto& p) { return std::string(p.param.name); });

}  // namespace
}  // namespace btms::fuzz
