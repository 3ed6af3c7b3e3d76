/// Random worlds for tests of a constraint solver: joints of every type, solver settings that
/// change, factors, gyroscopic forces, heaps. They run with Bullet's components and with others.
#pragma once

#include <jfpx/bullet/constraint_solver.hpp>

#include "tests/bullet/random_world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

inline constexpr std::uint64_t kJointKinds = 11;

struct SolverJoint {
  std::uint64_t kind = 0;  ///< below kJointKinds
  std::size_t a = 0, b = 0;
  bool alone = false;  ///< joint of body a and the world, if the type supports it
  bool collide = true;
  bool limits = false, motor = false, feedback = false;
  int iterations = -1;  ///< override; -1: none
  Real breaking = Real(1e30);
  Real low = 0, high = 0, speed = 0, strength = 0;
};

/// Change of Bullet's solver settings at a step.
struct SolverChange {
  int step = 0;
  btContactSolverInfo info;
};

/// Properties of a body in addition to those of a RandomBody.
struct SolverBody {
  Vec3 linear_factor = {1, 1, 1}, angular_factor = {1, 1, 1};
  int gyroscopic = 0;  ///< flags; 0: Bullet's default
  Real linear_damping = 0;
  bool massive = false;  ///< kinematic with a mass
};

struct SolverWorld {
  RandomWorld base;
  std::vector<SolverBody> bodies;
  std::vector<SolverJoint> joints;
  std::vector<SolverChange> changes;
  unsigned threads = 1;
  bool vectors = true;  ///< otherwise the scalar kernels
};

SolverWorld make_solver_world(std::uint64_t seed);
SolverWorld make_solver_world(test::Bytes& bytes);  ///< from the bytes of a fuzzer
std::ostream& operator<<(std::ostream& out, const SolverWorld& world);

struct SolverTotals {
  std::uint64_t steps = 0, groups = 0, on_device = 0, contacts = 0, joints = 0;
  std::uint64_t fallbacks[kSolverFallbacks] = {};
};

/// Returns the components under test, except for the dispatcher.
using MakeParts = WorldParts (*)(const SolverWorld&);
WorldParts our_solver(const SolverWorld& world);
WorldParts our_world(const SolverWorld& world);
WorldParts our_solver_and_world(const SolverWorld& world);

std::optional<Failure> run(const SolverWorld& world, SolverTotals* totals,
                           MakeParts parts = our_solver, MakeDispatcher dispatcher = make_stock);
/// Removes steps, bodies, joints, events and changes as long as the world still fails.
SolverWorld shrink(SolverWorld world, MakeParts parts, MakeDispatcher dispatcher = make_stock);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
