/// Shared code of benchmarks that compare two Bullet worlds: medians, alternation, main function.
#pragma once

#include <jfpx/bullet/verify.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstddef>
#include <ctime>
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

inline double clock_ms(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

/// Steps two worlds in turn, compares them, and sets the counters. Measures the time of the thread
/// if jfpx has one thread, otherwise the time that passes.
/// @param state its first argument is the number of threads of jfpx
template <class World>
void compare_steps(benchmark::State& state, World* stock, World* ours) {
  const clockid_t clock = state.range(0) == 1 ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC;
  const auto time_step = [&](World* world) {
    const double start = clock_ms(clock);
    world->step();
    return clock_ms(clock) - start;
  };
  std::vector<double> stock_ms, our_ms, ratios;
  bool swap = false;
  for (auto _ : state) {
    double stock_step = 0, our_step = 0;
    alternate(
        swap, [&] { stock_step = time_step(stock); }, [&] { our_step = time_step(ours); });
    swap = !swap;
    stock_ms.push_back(stock_step);
    our_ms.push_back(our_step);
    ratios.push_back(our_step / stock_step);
    state.SetIterationTime(our_step * 1e-3);
  }
  if (first_difference(stock->world(), ours->world(), 0)) state.SkipWithError("the worlds differ");
  state.counters["stock_ms"] = median(stock_ms);
  state.counters["jfpx_ms"] = median(our_ms);
  state.counters["ratio"] = median(ratios);
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
