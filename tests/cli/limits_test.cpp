// Values out of range, files that change, and too little memory.
#include <cmath>
#include <limits>
#include <thread>

#include "engine/error.h"
#include "engine/terrain/parameters.h"
#include "tests/cli/program.h"

namespace btms::test {
namespace {

struct OutOfRange {
  const char *name, *value, *range;
};

// 73 of docs/malformed_inputs.md: r, theta, sigma, l.
constexpr OutOfRange kOutOfRange[] = {
    {"resolution_m", "0", "0.1 to 64"},    {"resolution_m", "-1", "0.1 to 64"},
    {"resolution_m", "nan", "0.1 to 64"},  {"resolution_m", "1e-9", "0.1 to 64"},
    {"resolution_m", "inf", "0.1 to 64"},  {"slope_max_deg", "0", "0.1 to 89"},
    {"slope_max_deg", "90", "0.1 to 89"},  {"slope_max_deg", "180", "0.1 to 89"},
    {"min_points", "0", "1 to 1000000"},   {"min_points", "-5", "1 to 1000000"},
    {"min_points", "2.5", "1 to 1000000"}, {"min_points", "1e30", "1 to 1000000"},
    {"kernel_radius", "0.99", "1 to 10"},  {"level_kernel_radius", "0.5", "1 to 8"},
    {"kernel_radius", "wide", "1 to 10"},  {"resolution_m", "", "0.1 to 64"},
};

class CliLimits : public testing::Test {
 protected:
  void SetUp() override { write_scan(folder_ / "scan.bin", floor_and_wall()); }
  std::vector<std::string> build(std::vector<std::string> more) const {
    more.insert(more.begin(), {"build", folder_ / "scan.bin", "-o", folder_ / "map.btms"});
    return more;
  }
  TempFolder folder_;
};

TEST_F(CliLimits, AParameterOutOfRangeIsAUsageErrorThatNamesFieldAndRange) {
  for (const auto& [name, value, range] : kOutOfRange) {
    SCOPED_TRACE(std::string(name) + " = " + value);
    std::string flag = std::string("--") + name + "=" + value;
    std::replace(flag.begin(), flag.end(), '_', '-');
    write_text(folder_ / "c.yaml", "# a comment\n" + std::string(name) + ": '" + value + "'\n");
    for (const auto& more : {std::vector<std::string>{flag}, {"--config", folder_ / "c.yaml"}}) {
      if (more[0] == flag && *value == '\0') continue;  // the parser's own error
      const Outcome outcome = run(build(more));
      EXPECT_EQ(outcome.status, 2) << outcome.err;
      EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err;
      EXPECT_NE(outcome.err.find(range), std::string::npos) << outcome.err;
      if (more[0] == flag) continue;
      EXPECT_NE(outcome.err.find("c.yaml: line 2"), std::string::npos) << outcome.err;
    }
    EXPECT_EQ(names_in(folder_.path()), (std::vector<std::string>{"c.yaml", "scan.bin"}));
  }
}

// A library caller fills the struct himself.
TEST(Parameters, EveryNumberOutOfRangeIsRefusedByCheck) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  const auto refused = [](const Parameters& p, const ParameterInfo& info) {
    try {
      check(p);
      ADD_FAILURE() << info.name << " = " << parameter_text(p, info) << " is accepted";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUsage);
      EXPECT_NE(std::string(error.what()).find(info.name), std::string::npos) << error.what();
    }
  };
  for (const ParameterInfo& info : parameter_table()) {
    Parameters p;
    if (const auto* field = std::get_if<double Parameters::*>(&info.field)) {
      for (const double v :
           {info.min - std::max(1e-9, std::abs(info.min) * 1e-6), info.max * 1.001, kNan, -kInf, kInf}) {
        p.*(*field) = v;
        refused(p, info);
      }
    } else if (const auto* whole = std::get_if<int Parameters::*>(&info.field)) {
      for (const int v : {static_cast<int>(info.min) - 1, static_cast<int>(info.max) + 1}) {
        p.*(*whole) = v;
        refused(p, info);
      }
    }
  }
}

// A configuration is a small file; nothing is read without an end, and no nesting overflows the stack.
TEST_F(CliLimits, AConfigurationIsASmallFile) {
  fs::create_symlink("/dev/zero", folder_ / "zero.yaml");
  write_text(folder_ / "large.yaml", std::string(2'000'000, '#'));
  write_text(folder_ / "deep.yaml", "levels: " + std::string(500'000, '['));
  for (const auto& [name, words] :
       {std::pair{"zero.yaml", "not a regular file"}, {"large.yaml", "at most"}, {"deep.yaml", "deep.yaml"}}) {
    const Outcome outcome = run(build({"--config", folder_ / name}));
    EXPECT_EQ(outcome.status, 2) << name << outcome.err.substr(0, 300);
    EXPECT_NE(outcome.err.find(name), std::string::npos) << outcome.err.substr(0, 300);
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err.substr(0, 300);
  }
}

// 72: what has been opened is what is read. The program is held between the two.
TEST_F(CliLimits, AFileThatChangesWhileItIsReadIsRefused) {
  write_text(folder_ / "empty.bin", "");  // warned of when all files are open
  for (const std::uintmax_t size : {std::uintmax_t{16'000'000}, std::uintmax_t{160'000'000}}) {
    for (const char* executor : {"tbb", "ranks:2"}) {
      SCOPED_TRACE(std::to_string(size) + executor);
      Outcome outcome;
      for (int attempt = 0; attempt < 5 && outcome.status <= 0; ++attempt) {  // it may have been too fast
        write_text(folder_ / "large.bin", "");
        fs::resize_file(folder_ / "large.bin", 128'000'000);
        Running program({"build", folder_ / "empty.bin", folder_ / "large.bin", "-o", folder_ / "map.btms", "--preset",
                         "paper-single-scan", "--executor", executor});
        while (program.err_so_far().find("empty.bin") == std::string::npos && !program.has_ended())
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        fs::resize_file(folder_ / "large.bin", size);
        outcome = program.wait();
        if (outcome.status == 0) fs::remove_all(folder_ / "map.btms");
      }
      EXPECT_EQ(outcome.status, 3) << outcome.err;
      EXPECT_NE(outcome.err.find("large.bin"), std::string::npos) << outcome.err;
      EXPECT_NE(outcome.err.find("changed while read"), std::string::npos) << outcome.err;
      EXPECT_EQ(names_in(folder_.path()), (std::vector<std::string>{"empty.bin", "large.bin", "scan.bin"}));
    }
  }
}

// Too little memory for a sound file is a message that says what to do; never a signal, and nothing is left.
TEST_F(CliLimits, TooLittleMemoryIsAMessage) {
  if (kSanitized) GTEST_SKIP() << "the sanitizer needs terabytes of addresses";
  run_json({"build", folder_ / "scan.bin", "-o", folder_ / "map.btms", "--preset", "paper-single-scan"});
  write_text(folder_ / "large.bin", "");
  fs::resize_file(folder_ / "large.bin", 640'000'000);  // 40 million points in one place
  const std::vector<std::vector<std::string>> calls = {
      {"build", folder_ / "large.bin", "-o", folder_ / "new.btms", "--preset", "paper-single-scan"},
      {"build", folder_ / "large.bin", "-o", folder_ / "new.btms", "--preset", "city"},
      {"segment", folder_ / "large.bin", "-o", folder_ / "out"},
      {"eval", "--truth", folder_ / "large.label", "--prediction", folder_ / "large.label", "--sensor-height", "0"},
  };
  fs::create_hard_link(folder_ / "large.bin", folder_ / "large.label");
  for (const auto& call : calls) {
    SCOPED_TRACE(call[0] + " " + call.back());
    const Outcome outcome = run_in_memory(200, call);
    EXPECT_EQ(outcome.status, 1) << outcome.err;
    EXPECT_NE(outcome.err.find("out of memory"), std::string::npos) << outcome.err;
    EXPECT_FALSE(fs::exists(folder_ / "new.btms"));
    EXPECT_TRUE(!fs::exists(folder_ / "out") || names_in(folder_ / "out").empty());
  }
}

}  // namespace
}  // namespace btms::test
