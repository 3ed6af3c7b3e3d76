/// Options of twin worlds in which ours has all three classes of jfpx.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>

#include "tests/bullet/twin_worlds.hpp"

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// On the CPU, with as many threads for each class.
inline TwinOptions all_parts(unsigned threads, const DispatcherOptions& dispatch = {},
                             const ConstraintSolverOptions& solve = {}) {
  TwinOptions options;
  options.ours = [threads, dispatch](btCollisionConfiguration* configuration) {
    DispatcherOptions chosen = dispatch;
    chosen.collider = {.backend = Backend::cpu, .threads = threads};
    return std::make_unique<CollisionDispatcher>(configuration, chosen);
  };
  options.parts.solver = [threads, solve] {
    ConstraintSolverOptions chosen = solve;
    chosen.backend = Backend::cpu;
    chosen.threads = threads;
    return std::make_unique<ConstraintSolver>(chosen);
  };
  options.parts.world = [threads](btDispatcher* dispatcher, btBroadphaseInterface* broadphase,
                                  btConstraintSolver* solver,
                                  btCollisionConfiguration* configuration) {
    return std::make_unique<DynamicsWorld>(dispatcher, broadphase, solver, configuration,
                                           DynamicsWorldOptions{.threads = threads});
  };
  return options;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
