/// Shared code of benchmarks that compare two Bullet worlds: medians, alternation, main function.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Times of Bullet and of jfpx. A ratio is the median over pairs of samples, because samples that
/// are adjacent in time have the same noise.
struct Series {
  std::vector<double> stock, jfpx, ratio;
  void add(double stock_ms, double jfpx_ms) {
    stock.push_back(stock_ms);
    jfpx.push_back(jfpx_ms);
    ratio.push_back(stock_ms / jfpx_ms);
  }
  void report(benchmark::State& state, const std::string& name) const {
    state.counters[name + "_stock_ms"] = median(stock);
    state.counters[name + "_jfpx_ms"] = median(jfpx);
    state.counters[name + "_ratio"] = median(ratio);
  }
};

/// Executes two functions in alternating order, so that neither always runs second.
template <class First, class Second>
void alternate(bool swap, First first, Second second) {
  if (swap) {
    second();
    first();
  } else {
    first();
    second();
  }
}

/// The main function of a program that registers its benchmarks at run time.
inline int run_benchmarks(int argc, char** argv, void (*register_all)()) {
  register_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
