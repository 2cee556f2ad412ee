// The same bits on every CPU: the C library's code for CPUs without AVX2 and FMA changes nothing, and the program holds
// no fused multiply-add, whose single rounding would. (tests/portable.sh compares a build without the AVX2 clones.)
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include "tests/cli/program.h"

namespace btms::test {
namespace {

std::string output_of(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string out;
  std::array<char, 4096> piece;
  while (const std::size_t n = std::fread(piece.data(), 1, piece.size(), pipe.get())) out.append(piece.data(), n);
  return out;
}

constexpr const char* kOlderCpu = "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX512F";

TEST(Portable, OlderCodeOfTheCLibraryGivesTheSameDigests) {
  // Unknown names are ignored without a word: see that these are not.
  const std::string features = " /lib64/ld-linux-x86-64.so.2 --list-diagnostics 2>&1 | grep 'features.*active'";
  const std::string now = output_of(features);
  if (now.empty()) GTEST_SKIP() << "another C library";
  EXPECT_NE(now, output_of(std::string("GLIBC_TUNABLES=") + kOlderCpu + features));

  const TempFolder folder;
  run_json({"synth", "--scene", "city", "--points", "30000", "-o", folder / "city"});
  for (const std::string preset : {"city", "partial-map", "paper-partial-map", "paper-single-scan"}) {
    std::array<std::string, 2> digests;
    for (const bool older : {false, true}) {
      if (older) setenv("GLIBC_TUNABLES", kOlderCpu, 1);
      const auto built = run_json({"build", folder / "city", "--preset", preset, "-o", folder / (older ? "b" : "a")});
      unsetenv("GLIBC_TUNABLES");
      digests[older ? 1 : 0] = built["digest"].dump();
    }
    EXPECT_EQ(digests[0], digests[1]) << preset;
    EXPECT_GE(digests[0].size(), 32u);
  }
}

TEST(Portable, NoFusedMultiplyAdd) {
  if (std::system("command -v objdump > /dev/null") != 0) GTEST_SKIP() << "no objdump";
  const std::string count = output_of(std::string("objdump -d --no-show-raw-insn ") + BTMS_PROGRAM +
                                      " | awk '/\\tvf(n)?m(add|sub)/ {++fused} /%[xy]mm/ {++vectors} "
                                      "END {print fused + 0, (vectors > 1000)}'");
  EXPECT_EQ(count, "0 1\n") << "fused instructions, and whether it was disassembled at all";
}

}  // namespace
}  // namespace btms::test
