/// Times of the parts of a Bullet step, measured by Bullet's profile zones.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "bench/bullet/series.hpp"

#include <LinearMath/btQuickprof.h>
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

inline clockid_t g_clock = CLOCK_MONOTONIC;

inline double now_ms() {
  timespec t{};
  clock_gettime(g_clock, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

/// Profile zones, and the part to which each is added or from which it is subtracted.
enum Part : std::size_t {
  kMotion,
  kBoxes,
  kDispatch,
  kIslands,
  kSetUp,
  kSweeps,
  kFinish,
  kBodies,  // this and the next are included in kSetUp
  kScan,
  kParts
};
inline constexpr const char* kPartNames[kParts] = {
    "motion", "boxes", "dispatch", "islands", "set_up", "sweeps", "finish", "bodies", "scan"};
struct Zone {
  const char* name;
  Part part;
  double sign;
};
inline constexpr Zone kZones[] = {{"predictUnconstraintMotion", kMotion, 1},
                                  {"createPredictiveContacts", kMotion, 1},
                                  {"integrateTransforms", kMotion, 1},
                                  {"updateActivationState", kMotion, 1},
                                  {"updateAabbs", kBoxes, 1},
                                  {"calculateOverlappingPairs", kBoxes, 1},
                                  {"dispatchAllCollisionPairs", kDispatch, 1},
                                  {"calculateSimulationIslands", kIslands, 1},
                                  {"convertBodies", kBodies, 1},
                                  {"find contacts", kScan, 1},
                                  {"solveConstraints", kIslands, 1},
                                  {"solveGroup", kIslands, -1},
                                  {"solveGroupCacheFriendlySetup", kSetUp, 1},
                                  {"solveGroupCacheFriendlyIterations", kSweeps, 1},
                                  {"solveGroupCacheFriendlyFinish", kFinish, 1}};

inline std::array<double, kParts> g_parts;
inline std::vector<std::pair<const Zone*, double>> g_open;

inline void enter_zone(const char* name) {
  const Zone* zone = std::find_if(std::begin(kZones), std::end(kZones),
                                  [&](const Zone& z) { return std::strcmp(z.name, name) == 0; });
  g_open.emplace_back(zone == std::end(kZones) ? nullptr : zone, now_ms());
}
inline void leave_zone() {
  const auto [zone, since] = g_open.back();
  g_open.pop_back();
  if (zone != nullptr) g_parts[zone->part] += zone->sign * (now_ms() - since);
}

struct Samples {
  std::vector<double> total;
  std::array<std::vector<double>, kParts> parts;

  template <class World>
  void step(World& world) {
    g_parts = {};
    const double start = now_ms();
    world.step();
    total.push_back(now_ms() - start);
    for (std::size_t i = 0; i < kParts; ++i) parts[i].push_back(g_parts[i]);
  }
  void report(benchmark::State& state, const std::string& name) const {
    state.counters["step_" + name + "_ms"] = median(total);
    for (std::size_t i = 0; i < kParts; ++i) {
      state.counters[std::string(kPartNames[i]) + "_" + name + "_ms"] = median(parts[i]);
    }
  }
};

/// Measures the zones during its lifetime.
class TimedZones {
 public:
  TimedZones() {
    btSetCustomEnterProfileZoneFunc(enter_zone);
    btSetCustomLeaveProfileZoneFunc(leave_zone);
  }
  ~TimedZones() {
    btSetCustomEnterProfileZoneFunc([](const char*) {});
    btSetCustomLeaveProfileZoneFunc([] {});
  }
  TimedZones(const TimedZones&) = delete;
  TimedZones& operator=(const TimedZones&) = delete;
};

/// Steps both worlds in alternating order, once per iteration of the benchmark.
template <class World>
void sample_in_turn(benchmark::State& state, World& stock, World& ours, Samples* stock_samples,
                    Samples* our_samples) {
  const TimedZones timed;
  bool swap = false;
  for (auto _ : state) {
    alternate(
        swap, [&] { stock_samples->step(stock); }, [&] { our_samples->step(ours); });
    swap = !swap;
    state.SetIterationTime(our_samples->total.back() * 1e-3);
  }
  if (stock.state_hash() != ours.state_hash()) state.SkipWithError("the worlds differ");
}

/// sample_in_turn(), then reports medians of the parts and of the ratio of whole steps.
inline void step_in_turn(benchmark::State& state, SceneWorld& stock, SceneWorld& ours) {
  Samples stock_samples, our_samples;
  sample_in_turn(state, stock, ours, &stock_samples, &our_samples);
  stock_samples.report(state, "stock");
  our_samples.report(state, "jfpx");
  std::vector<double> ratios;
  for (std::size_t i = 0; i < stock_samples.total.size(); ++i) {
    ratios.push_back(stock_samples.total[i] / our_samples.total[i]);
  }
  state.counters["ratio"] = median(ratios);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
