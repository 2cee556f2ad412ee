#include "apps/server/metrics.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace btms {

void Metrics::answered(const char* route, int status, std::size_t bytes, std::chrono::steady_clock::duration took) {
  const double s = std::chrono::duration<double>(took).count();
  const auto bucket =
      static_cast<std::size_t>(std::lower_bound(kBounds_s.begin(), kBounds_s.end(), s) - kBounds_s.begin());
  const std::lock_guard lock(mutex_);
  ++requests_[{route, status}];
  ++latencies_[bucket];
  seconds_ += s;
  bytes_ += bytes;
}

std::string Metrics::text() const {
  std::string out;
  const auto head = [&](const char* name, const char* type, const char* help) {
    out += fmt::format("# HELP {0} {2}\n# TYPE {0} {1}\n", name, type, help);
  };
  const std::lock_guard lock(mutex_);
  head("btms_requests_total", "counter", "Answers by route and status");
  for (const auto& [key, n] : requests_)
    out += fmt::format("btms_requests_total{{route=\"{}\",status=\"{}\"}} {}\n", key.first, key.second, n);
  head("btms_request_seconds", "histogram", "From the request's last byte to the answer");
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < kBounds_s.size(); ++i)
    out += fmt::format("btms_request_seconds_bucket{{le=\"{}\"}} {}\n", kBounds_s[i], sum += latencies_[i]);
  sum += latencies_.back();
  out += fmt::format(
      "btms_request_seconds_bucket{{le=\"+Inf\"}} {0}\nbtms_request_seconds_sum {1}\n"
      "btms_request_seconds_count {0}\n",
      sum, seconds_);
  head("btms_sent_bytes_total", "counter", "Bytes of bodies");
  out += fmt::format("btms_sent_bytes_total {}\n", bytes_);
  head("btms_connections", "gauge", "Connections that are open");
  out += fmt::format("btms_connections {}\n", connections.load());
  head("btms_listeners", "gauge", "Connections that hear events");
  out += fmt::format("btms_listeners {}\n", listeners.load());
  head("btms_refused_connections_total", "counter", "Connections beyond a limit");
  out += fmt::format("btms_refused_connections_total {}\n", refused.load());
  return out;
}

}  // namespace btms
