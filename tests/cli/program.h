// Runs the real program and keeps what it said.
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace btms::test {

namespace fs = std::filesystem;

// A folder that is there for one test.
class TempFolder {
 public:
  TempFolder() {
    std::string name = (fs::temp_directory_path() / "btms-cli-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~TempFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

inline std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

inline void write_text(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Names of everything in a folder, hidden files too, sorted.
inline std::vector<std::string> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

struct Outcome {
  int status = -1;  // exit status, or 128 + signal
  std::string out, err;
  double cpu_seconds = 0;
  // Never less than this process had taken when it started the program.
  std::uint64_t peak_rss_bytes = 0;
  nlohmann::json json() const { return nlohmann::json::parse(out); }
};

// The program, started; wait() ends it.
class Running {
 public:
  // stdout goes to `out` where one is named. `through`: the words of a command that runs the rest of its arguments.
  explicit Running(const std::vector<std::string>& arguments, const std::string& input = {}, std::string out = {},
                   const std::vector<std::string>& through = {}) {
    write_text(folder_ / "in", input);
    if (out.empty()) out = folder_ / "out";
    std::vector<std::string> words = through;
    words.emplace_back(BTMS_PROGRAM);
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t files;
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_addopen(&files, 0, (folder_ / "in").c_str(), O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&files, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_addopen(&files, 2, (folder_ / "err").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    EXPECT_EQ(posix_spawn(&pid_, words[0].c_str(), &files, nullptr, argv.data(), environ), 0);
    posix_spawn_file_actions_destroy(&files);
  }

  pid_t pid() const { return pid_; }
  void send(int signal) const { kill(pid_, signal); }
  std::string err_so_far() const { return read_text(folder_ / "err"); }
  bool has_ended() { return status_known_ || (status_known_ = wait4(pid_, &wait_status_, WNOHANG, &used_) == pid_); }
  Outcome wait() {
    if (!status_known_) wait4(pid_, &wait_status_, 0, &used_);
    status_known_ = true;
    const int status = WIFEXITED(wait_status_) ? WEXITSTATUS(wait_status_) : 128 + WTERMSIG(wait_status_);
    const auto seconds = [](const timeval& t) {
      return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
    };
    return {status, read_text(folder_ / "out"), read_text(folder_ / "err"),
            seconds(used_.ru_utime) + seconds(used_.ru_stime), static_cast<std::uint64_t>(used_.ru_maxrss) * 1024};
  }

 private:
  TempFolder folder_;
  pid_t pid_ = -1;
  int wait_status_ = 0;
  rusage used_{};
  bool status_known_ = false;
};

inline Outcome run(const std::vector<std::string>& arguments, const std::string& input = {}) {
  return Running(arguments, input).wait();
}

// The same in an address space of so many megabytes.
inline Outcome run_in_memory(int megabytes, const std::vector<std::string>& arguments) {
  const std::string limit = "ulimit -v " + std::to_string(megabytes * 1024) + "; exec \"$0\" \"$@\"";
  return Running(arguments, {}, {}, {"/bin/sh", "-c", limit}).wait();
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;  // time and memory say nothing, and address space cannot be limited
#else
constexpr bool kSanitized = false;
#endif

// Runs, expects success, and gives stdout as JSON.
inline nlohmann::json run_json(std::vector<std::string> arguments, const std::string& input = {}) {
  arguments.push_back("--json");
  const Outcome outcome = run(arguments, input);
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  return nlohmann::json::parse(outcome.out, nullptr, false);
}

// A KITTI scan: float32 x, y, z, intensity.
inline void write_scan(const fs::path& path, const std::vector<std::array<float, 3>>& points) {
  std::string bytes;
  for (const auto& [x, y, z] : points) {
    const float record[4] = {x, y, z, 0.5f};
    bytes.append(reinterpret_cast<const char*>(record), sizeof record);
  }
  write_text(path, bytes);
}

// A flat floor of 40 m x 40 m at z = -1.7 with a wall on it.
inline std::vector<std::array<float, 3>> floor_and_wall() {
  std::vector<std::array<float, 3>> points;
  for (int x = -100; x < 100; ++x)
    for (int y = -100; y < 100; ++y)
      points.push_back({0.2f * static_cast<float>(x), 0.2f * static_cast<float>(y), -1.7f});
  for (int y = -50; y < 50; ++y)
    for (int z = 0; z < 20; ++z)
      points.push_back({10.05f, 0.1f * static_cast<float>(y), -1.0f + 0.1f * static_cast<float>(z)});
  return points;
}

}  // namespace btms::test
