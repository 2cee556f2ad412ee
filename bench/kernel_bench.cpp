// The BGK kernel (Eq 7): ns per value.
#include <benchmark/benchmark.h>

#include <cmath>
#include <stdexcept>
#include <vector>

#include "engine/terrain/kernel.h"
#include "engine/trigonometry.h"

namespace btms {
namespace {

void BM_Kernel(benchmark::State& state) {
  std::vector<double> t;
  for (int i = 0; i < 4096; ++i) t.push_back(i / 4096.0);
  for (const double v : t) {  // the answer before the time
    const double printed = (2 + std::cos(2 * kPi * v)) * (1 - v) / 3 + std::sin(2 * kPi * v) / (2 * kPi);
    if (std::abs(kernel_real(v) - printed) > 1e-9) throw std::logic_error("kernel differs from Eq 7");
  }
  for (auto _ : state) {
    std::int64_t sum = 0;
    for (const double v : t) sum += kernel(v);
    benchmark::DoNotOptimize(sum);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(t.size()));
}
BENCHMARK(BM_Kernel);

}  // namespace
}  // namespace btms
