#include "apps/server/body_cache.h"

namespace btms {
namespace {

constexpr std::size_t kEntry_bytes = 512;  // about what keeping an empty one takes

}  // namespace

Body BodyCache::find(const std::string& key) {
  const std::lock_guard lock(mutex_);
  const auto it = at_.find(key);
  ++(it == at_.end() ? counts_.misses : counts_.hits);
  if (it == at_.end()) return nullptr;
  entries_.splice(entries_.begin(), entries_, it->second);
  return it->second->second;
}

void BodyCache::keep(const std::string& key, Body body) {
  const std::size_t bytes = body->size() + kEntry_bytes;
  if (bytes > budget_bytes_ / 4) return;
  const std::lock_guard lock(mutex_);
  if (at_.contains(key)) return;
  counts_.bytes += bytes;
  entries_.emplace_front(key, std::move(body));
  at_.emplace(key, entries_.begin());
  while (counts_.bytes > budget_bytes_) {
    counts_.bytes -= entries_.back().second->size() + kEntry_bytes;
    at_.erase(entries_.back().first);
    entries_.pop_back();
  }
}

BodyCache::Counts BodyCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

}  // namespace btms
