/// Common parts of the benchmarks: statistics, timing, and the context of results.
#pragma once

#include <jfpx/backend.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <time.h>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {

inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

inline double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

inline bool cuda_is_usable() {
  static const bool usable = available_backends()[1].usable;
  return usable;
}

/// Wall-clock time if a GPU is usable, otherwise CPU time, which depends less on other load.
template <class Call>
double microseconds_of(const Call& call) {
  const auto now = [] {
    timespec time{};
    clock_gettime(cuda_is_usable() ? CLOCK_MONOTONIC : CLOCK_PROCESS_CPUTIME_ID, &time);
    return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
  };
  const double start = now();
  call();
  return now() - start;
}

/// The program's name and arguments, without folders and output options.
inline std::string command_line(int argc, char** argv) {
  const std::string_view program = argv[0];
  std::string command(program.substr(program.find_last_of('/') + 1));
  for (int i = 1; i < argc; ++i) {
    if (!std::string_view(argv[i]).starts_with("--benchmark_out")) {
      command += std::string(" ") + argv[i];
    }
  }
  return command;
}

/// Runs the registered benchmarks; returns the exit status of the program.
inline int run_benchmarks(int argc, char** argv) {
  for (const BackendStatus& status : available_backends()) {
    if (status.usable) {
      benchmark::AddCustomContext(std::string(to_string(status.backend)), status.device);
    }
  }
  benchmark::AddCustomContext("precision", sizeof(Real) == 4 ? "float" : "double");
  benchmark::AddCustomContext("version", JFPX_VERSION);
  benchmark::AddCustomContext("command", command_line(argc, argv));
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx
