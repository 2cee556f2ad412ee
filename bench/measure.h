// How a benchmark measures: wall time of a body, peak memory, and the time of a plain copy to compare with.
//
// Counters of every benchmark that uses Measure:
//   items_per_second  points per second (queries, where the benchmark asks for heights)
//   ns_per_point      the inverse
//   cpu_ns           processor time per point, of all threads: steadier than wall time where others use the machine
//   cores           processors used on average: 1 with threads:2 means that the machine had no more to give
//   points_per_node   points per node that holds any; 0 where there are no nodes
//   copies            time in units of a plain copy of the same bytes, measured just before; 0 where there is none
//   peak_MB           most memory the process held meanwhile (VmHWM), the city and all fixtures included
//   added_MB          peak_MB less what the process held at the start
#pragma once

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

namespace btms::bench {

// Throws std::logic_error, which ends the run with exit code 1: a wrong answer has no time.
void verify(bool right, const std::string& what);
// Runs `check` on the first call with this key; the library calls a benchmark several times.
void verify_once(const std::string& key, const std::function<void()>& check);

// The run's temporary folder, removed at exit.
const std::filesystem::path& folder();
// Leaves a process behind that removes it after a signal or a crash. Call before any thread starts.
void remove_folder_however_this_ends();

// Seconds of plain copies, medians.
double copy_memory(std::uint64_t bytes);
double read_file(const std::filesystem::path& file);  // into a small buffer
double copy_file(const std::filesystem::path& file);  // to a new file, fsynced

// Resets the peak on construction and sets the counters on destruction. Benchmarks need UseManualTime(), so that
// fixtures are copied and answers dropped outside the time.
class Measure {
 public:
  Measure(benchmark::State& state, std::uint64_t points, double plain_copy_s, double points_per_node = 0);
  Measure(const Measure&) = delete;
  Measure& operator=(const Measure&) = delete;
  ~Measure();

  // Once per iteration. Returns seconds.
  template <class Body>
  double time(Body&& body) {
    const double cpu_begun = cpu_seconds();
    const auto begun = std::chrono::steady_clock::now();
    body();
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begun;
    state_.SetIterationTime(taken.count());
    cpu_s_ += cpu_seconds() - cpu_begun;
    seconds_ += taken.count();
    ++times_;
    return taken.count();
  }

 private:
  static double cpu_seconds();  // of the process

  benchmark::State& state_;
  const double points_, plain_copy_s_, points_per_node_, held_MB_;
  double seconds_ = 0, cpu_s_ = 0, times_ = 0;
};

}  // namespace btms::bench
