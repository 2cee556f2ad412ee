// What the server bears. Checked before work is done or memory taken.
#pragma once

#include <chrono>
#include <cstddef>

namespace btms {

struct ServerLimits {
  std::size_t target_bytes = 2048, header_bytes = 8192, body_bytes = std::size_t{8} << 20;
  std::size_t connections = 4096;
  std::size_t connections_an_address = 64;           // loopback excepted
  std::size_t points = 100'000;                      // of a request
  std::size_t window_values = std::size_t{1} << 24;  // squares times layers
  std::size_t ids = 20'000;                          // of a diff
  std::size_t bundle = 256;                          // tiles
  std::size_t route_nodes = 1'000'000;               // a search may settle
  std::size_t waiting = 256;                         // requests for the workers
  std::chrono::milliseconds header{10'000}, body{30'000}, write{30'000}, idle{60'000}, handler{5'000},
      event_comment{15'000}, shutdown{5'000};
};

}  // namespace btms
