/// Check of a sphere pair against Bullet's own algorithm.
#include "src/bullet/dispatch/pair_check.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/contact_point.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

#include <cstdio>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Disables the global contact callbacks during its lifetime, for the scratch manifold.
class CallbacksDisabled {
 public:
  CallbacksDisabled() = default;
  ~CallbacksDisabled() {
    gContactAddedCallback = added_;
    gContactStartedCallback = started_;
    gContactEndedCallback = ended_;
    gContactDestroyedCallback = destroyed_;
  }
  CallbacksDisabled(const CallbacksDisabled&) = delete;
  CallbacksDisabled& operator=(const CallbacksDisabled&) = delete;

 private:
  ContactAddedCallback added_ = std::exchange(gContactAddedCallback, nullptr);
  ContactStartedCallback started_ = std::exchange(gContactStartedCallback, nullptr);
  ContactEndedCallback ended_ = std::exchange(gContactEndedCallback, nullptr);
  ContactDestroyedCallback destroyed_ = std::exchange(gContactDestroyedCallback, nullptr);
};

}  // namespace

std::optional<FieldDifference> check_pair(btDispatcher* dispatcher, const btDispatcherInfo& info,
                                          const btCollisionObject& body_a,
                                          const btCollisionObject& body_b,
                                          const PairContact* contact,
                                          const btPersistentManifold& thresholds,
                                          const btPersistentManifold* manifold) {
  const CallbacksDisabled callbacks_disabled;
  // Uses the bodies of the manifold, whose order the user may have changed.
  btPersistentManifold scratch(thresholds.getBody0(), thresholds.getBody1(), 0,
                               thresholds.getContactBreakingThreshold(),
                               thresholds.getContactProcessingThreshold());
  const btCollisionObjectWrapper a = wrapper_of(body_a);
  const btCollisionObjectWrapper b = wrapper_of(body_b);
  btManifoldResult out(&a, &b);
  const btCollisionAlgorithmConstructionInfo construction(dispatcher, 1);
  btSphereSphereCollisionAlgorithm algorithm(&scratch, construction, &a, &b);
  algorithm.processCollision(&a, &b, info, &out);

  FieldComparison compare;
  const bool expected = scratch.getNumContacts() != 0;
  // Bullet rejects a touching point if the user has set a negative breaking threshold.
  const bool accepted =
      contact != nullptr && !(contact->distance > thresholds.getContactBreakingThreshold());
  compare("touching", expected ? 1 : 0, accepted ? 1 : 0);
  if (expected && accepted) {
    const btManifoldPoint& point = scratch.getContactPoint(0);
    const btVector3& normal = point.m_normalWorldOnB;
    const PairContact stock{{normal.x(), normal.y(), normal.z()}, point.m_distance1, contact->pair};
    compare("contact is finite", has_finite_values(stock), has_finite_values(*contact));
    if (has_finite_values(*contact)) {
      compare("distance", stock.distance, contact->distance);
      compare("normal.x", stock.normal.x, contact->normal.x);
      compare("normal.y", stock.normal.y, contact->normal.y);
      compare("normal.z", stock.normal.z, contact->normal.z);
    }
  }
  if (manifold != nullptr) {
    compare("number of points", scratch.getNumContacts(), manifold->getNumContacts());
    if (expected && manifold->getNumContacts() == 1) {
      compare_points(scratch.getContactPoint(0), manifold->getContactPoint(0), &compare);
    }
  }
  return compare.first();
}

std::string to_text(const FieldDifference& difference) {
  char text[160];
  std::snprintf(text, sizeof text, ": expected %.17g (0x%llx), actual %.17g (0x%llx)",
                difference.expected, static_cast<unsigned long long>(difference.expected_bits),
                difference.actual, static_cast<unsigned long long>(difference.actual_bits));
  return difference.field + text;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
