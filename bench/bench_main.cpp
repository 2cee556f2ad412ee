// Runs the benchmarks. Unlike the library's own main, a wrong answer is an exit code, and temporary files go either
// way.
#include <benchmark/benchmark.h>

#include <cstdio>
#include <exception>

#include "bench/measure.h"

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  try {
    btms::bench::remove_folder_however_this_ends();
    benchmark::RunSpecifiedBenchmarks();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "btms_bench: %s\n", e.what());
    return 1;
  }
  benchmark::Shutdown();
  return 0;
}
