/// Free motion and sleep of bodies in a step of Solver::worst_first (thesis 4.4.2).
#pragma once

#include "src/world/bodies/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace thesis {

class FreeMotion {
 public:
  /// @param dt [s], length of a step
  FreeMotion(Real dt, const SleepSettings& sleep);

  /// Advances all awake bodies by one step of free motion, puts bodies at rest to sleep, and clears
  /// the accumulated forces and torques.
  void integrate(BodyStore* bodies) const;

 private:
  bool falls_asleep(std::uint32_t body, MotionArrays* moving) const;

  Real sleep_epsilon_;  ///< [m^2/s^2]
  Real motion_kept_;    ///< SleepSettings::bias^dt: weight of the previous mean motion
};

/// Translates and rotates a body, and does not change its velocities.
void displace(BodyStore* bodies, std::uint32_t body, const Vec3& shift, const Vec3& rotation);

}  // namespace thesis
}  // namespace JFPX_ABI
}  // namespace jfpx
