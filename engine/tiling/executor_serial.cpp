#include "engine/tiling/executor.h"

namespace btms {
namespace {

class SerialThreads final : public Threads {
 public:
  int count() const override { return 1; }
  void for_each(std::size_t n, const std::function<void(std::size_t, int)>& body) const override {
    for (std::size_t i = 0; i < n; ++i) body(i, 0);
  }
};

class SingleRank final : public Ranks {
 public:
  int rank() const override { return 0; }
  int size() const override { return 1; }

 private:
  std::vector<Bytes> do_exchange(std::vector<Bytes> out) override { return out; }
};

}  // namespace

std::unique_ptr<Threads> serial_threads() { return std::make_unique<SerialThreads>(); }
std::unique_ptr<Ranks> single_rank() { return std::make_unique<SingleRank>(); }

}  // namespace btms
