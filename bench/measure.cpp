#include "bench/measure.h"

#include <fcntl.h>
#include <malloc.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <ctime>
#include <fstream>
#include <set>
#include <stdexcept>
#include <vector>

#include "io/files/descriptor.h"

namespace btms::bench {
namespace {

namespace fs = std::filesystem;

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "btms-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a temporary folder: " + name);
    path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

// "VmHWM" or "VmRSS", in MB.
double memory_MB(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(field + ":")) return std::stod(line.substr(field.size() + 1)) / 1024;
  return 0;
}

// Gives free memory back and lets VmHWM start again from what is held now. Where the kernel refuses, peak_MB is that of
// the run so far.
double reset_peak() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << 5;
  return memory_MB("VmRSS");
}

template <class Body>
double median_seconds(int times, Body&& body) {
  std::vector<double> seconds;
  for (int i = 0; i < times; ++i) {
    const auto begun = std::chrono::steady_clock::now();
    body();
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  }
  std::nth_element(seconds.begin(), seconds.begin() + times / 2, seconds.end());
  return seconds[static_cast<std::size_t>(times / 2)];
}

constexpr std::size_t kBuffer = std::size_t{1} << 18;  // what the readers use

template <class Take>
void stream(const fs::path& file, Take&& take) {
  const Descriptor from(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  verify(from.get() >= 0, "cannot open " + file.string());
  static std::vector<char> buffer(kBuffer);
  ssize_t n = 0;
  while ((n = ::read(from.get(), buffer.data(), buffer.size())) > 0) take(buffer.data(), static_cast<std::size_t>(n));
  verify(n == 0, "cannot read " + file.string());
}

}  // namespace

void verify(bool right, const std::string& what) {
  if (!right) throw std::logic_error("verification failed: " + what);
}

void verify_once(const std::string& key, const std::function<void()>& check) {
  static std::set<std::string> verified;
  if (verified.contains(key)) return;
  check();
  verified.insert(key);
}

const fs::path& folder() {
  static const TemporaryFolder folder;
  return folder.path();
}

void remove_folder_however_this_ends() {
  int ends[2];
  verify(::pipe2(ends, O_CLOEXEC) == 0, "cannot make a pipe");
  const fs::path path = folder();
  if (::fork() != 0) {
    ::close(ends[0]);
    return;  // keeps the other end open as long as it lives
  }
  ::close(ends[1]);
  ::setsid();  // a signal to the group is not for this process
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_IGN);
  char byte = 0;
  while (::read(ends[0], &byte, 1) < 0) continue;  // until the benchmarks have ended
  std::error_code ignored;
  fs::remove_all(path, ignored);
  ::_exit(0);
}

double copy_memory(std::uint64_t bytes) {
  std::vector<char> from(static_cast<std::size_t>(bytes), 1),
      to(from.size(), 2);  // touched: page faults are not copying
  return median_seconds(5, [&] {
    std::memcpy(to.data(), from.data(), from.size());
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
  });
}

double read_file(const fs::path& file) {
  return median_seconds(5,
                        [&] { stream(file, [](const char* bytes, std::size_t) { benchmark::DoNotOptimize(bytes); }); });
}

double copy_file(const fs::path& file) {
  const fs::path copy = folder() / "plain-copy";
  const double seconds = median_seconds(5, [&] {
    fs::remove(copy);
    const Descriptor to(::open(copy.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    verify(to.get() >= 0, "cannot create " + copy.string());
    stream(file, [&](const char* bytes, std::size_t n) {
      for (std::size_t done = 0; done < n;) {
        const ssize_t written = ::write(to.get(), bytes + done, n - done);
        verify(written > 0, "cannot write " + copy.string());
        done += static_cast<std::size_t>(written);
      }
    });
    verify(::fsync(to.get()) == 0, "cannot sync " + copy.string());
  });
  fs::remove(copy);
  return seconds;
}

Measure::Measure(benchmark::State& state, std::uint64_t points, double plain_copy_s, double points_per_node)
    : state_(state),
      points_(static_cast<double>(points)),
      plain_copy_s_(plain_copy_s),
      points_per_node_(points_per_node),
      held_MB_(reset_peak()) {}

Measure::~Measure() {
  if (times_ == 0) return;
  const double each = seconds_ / times_, peak_MB = memory_MB("VmHWM");
  state_.SetItemsProcessed(static_cast<std::int64_t>(points_ * times_));
  state_.counters["ns_per_point"] = 1e9 * each / points_;
  state_.counters["cpu_ns"] = 1e9 * cpu_s_ / times_ / points_;
  state_.counters["cores"] = cpu_s_ / seconds_;
  state_.counters["points_per_node"] = points_per_node_;
  state_.counters["copies"] = plain_copy_s_ > 0 ? each / plain_copy_s_ : 0;
  state_.counters["peak_MB"] = peak_MB;
  state_.counters["added_MB"] = peak_MB - held_MB_;
}

double Measure::cpu_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace btms::bench
