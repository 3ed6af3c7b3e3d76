/// A dynamics world that measures the time of its stages.
#pragma once

#include <jfpx/bullet/scene_world.hpp>

#include "src/base/stopwatch.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Measures each stage by overriding its virtual function. Bullet's profiler callbacks would also
/// work, but they are global and reserved for the user.
template <class World>
class TimedWorld final : public World {
 public:
  /// @param times must outlive the world
  template <class... Arguments>
  explicit TimedWorld(StageTimes* times, const Arguments&... arguments)
      : World(arguments...), times_(*times) {}

  int stepSimulation(btScalar dt, int max_sub_steps, btScalar fixed_dt) override {
    times_ = {};
    int sub_steps = 0;
    time(&times_.total, [&] { sub_steps = World::stepSimulation(dt, max_sub_steps, fixed_dt); });
    return sub_steps;
  }
  void updateAabbs() override {
    time(&times_.broadphase, [&] { World::updateAabbs(); });
  }
  void computeOverlappingPairs() override {
    time(&times_.broadphase, [&] { World::computeOverlappingPairs(); });
  }
  void performDiscreteCollisionDetection() override {
    const double broadphase = times_.broadphase;
    time(&times_.dispatch, [&] { World::performDiscreteCollisionDetection(); });
    times_.dispatch -= times_.broadphase - broadphase;
  }
  void solveConstraints(btContactSolverInfo& info) override {
    time(&times_.solve, [&] { World::solveConstraints(info); });
  }

 protected:
  void predictUnconstraintMotion(btScalar dt) override {
    time(&times_.integrate, [&] { World::predictUnconstraintMotion(dt); });
  }
  void integrateTransforms(btScalar dt) override {
    time(&times_.integrate, [&] { World::integrateTransforms(dt); });
  }
  void updateActivationState(btScalar dt) override {
    time(&times_.integrate, [&] { World::updateActivationState(dt); });
  }
  void calculateSimulationIslands() override {
    time(&times_.islands, [&] { World::calculateSimulationIslands(); });
  }

 private:
  template <class Stage>
  static void time(double* milliseconds, Stage stage) {
    Stopwatch watch;
    stage();
    *milliseconds += watch.lap_ms();
  }

  StageTimes& times_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
