// Counts for /metrics, in Prometheus' text form. Thread-safe.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace btms {

class Metrics {
 public:
  void answered(const char* route, int status, std::size_t bytes, std::chrono::steady_clock::duration took);
  std::string text() const;

  std::atomic<std::int64_t> connections{0}, listeners{0};
  std::atomic<std::uint64_t> refused{0};  // connections

 private:
  static constexpr std::array<double, 8> kBounds_s{0.0005, 0.001, 0.005, 0.01, 0.05, 0.1, 0.5, 5};
  mutable std::mutex mutex_;
  std::map<std::pair<std::string, int>, std::uint64_t> requests_;
  std::array<std::uint64_t, kBounds_s.size() + 1> latencies_{};
  double seconds_ = 0;
  std::uint64_t bytes_ = 0;
};

}  // namespace btms
