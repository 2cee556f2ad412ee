// Encoded answers by their validator: what is equal is encoded once, whoever asks. Bounded by bytes, the longest unused
// go first. Thread-safe.
#pragma once

#include <list>
#include <mutex>
#include <string>
#include <unordered_map>

#include "apps/server/message.h"

namespace btms {

class BodyCache {
 public:
  explicit BodyCache(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  Body find(const std::string& key);  // nullptr when it is not there
  void keep(const std::string& key, Body body);

  struct Counts {
    std::uint64_t hits = 0, misses = 0;
    std::size_t bytes = 0;
  };
  Counts counts() const;

 private:
  using Entry = std::pair<std::string, Body>;
  const std::size_t budget_bytes_;
  mutable std::mutex mutex_;
  std::list<Entry> entries_;  // last used first
  std::unordered_map<std::string, std::list<Entry>::iterator> at_;
  Counts counts_;
};

}  // namespace btms
