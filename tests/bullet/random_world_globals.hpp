/// Bullet's global settings and callbacks for a random world.
#pragma once

#include "tests/bullet/random_world.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Sets them, and restores them at the end. The callbacks write into the log of g_current.
class Globals {
 public:
  explicit Globals(const RandomWorld& world);
  ~Globals();
  Globals(const Globals&) = delete;
  Globals& operator=(const Globals&) = delete;

  /// Sets the callbacks of these CallbackBits, and resets the others.
  void set_callbacks(unsigned bits);

 private:
  const btScalar breaking_threshold_ = gContactBreakingThreshold;
  const btScalar deactivation_time_ = gDeactivationTime;
  const CalculateCombinedCallback friction_ = gCalculateCombinedFrictionCallback;
  const unsigned allowed_;
};

/// A near callback that logs and then does what Bullet's does.
void logging_near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                           const btDispatcherInfo& info);

/// Logs what contactTest() and contactPairTest() find.
struct LoggingReport : btCollisionWorld::ContactResultCallback {
  btScalar addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a, int, int i,
                           const btCollisionObjectWrapper* b, int, int j) override;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
