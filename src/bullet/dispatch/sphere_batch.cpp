/// Gathering of bodies, which is bound by memory latency; all reads are prefetched.
#include "src/bullet/dispatch/sphere_batch.hpp"

#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kBodyChunk = 512;

/// True for exactly the classes whose checkCollideWithOverride is known to be free of side effects.
bool has_stock_filter(const btCollisionObject& body) {
  const std::type_info* type = type_info_of(body);
  return type == &typeid(btRigidBody) || type == &typeid(btCollisionObject) ||
         type == &typeid(btGhostObject) || type == &typeid(btPairCachingGhostObject);
}

bool is_plain_hull(const btCollisionShape& shape) {
  return is_exactly<btConvexHullShape>(shape) &&
         static_cast<const btConvexHullShape&>(shape).getConvexPolyhedron() == nullptr;
}

template <class... Exact>
bool is_one_of(const btCollisionShape& shape) {
  return (is_exactly<Exact>(shape) || ...);
}

/// @param traits of the body, whose shape Bullet reads only if it is active
bool is_wrapped_sphere(const btCollisionShape& shape, unsigned traits) {
  if ((traits & kActive) == 0 || !is_exactly<btCompoundShape>(shape)) return false;
  const auto& compound = static_cast<const btCompoundShape&>(shape);
  return compound.getNumChildShapes() > 0 &&
         compound.getChildShape(0)->getShapeType() == SPHERE_SHAPE_PROXYTYPE;
}

}  // namespace

unsigned traits_of(const btCollisionShape& shape) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return kSphere;
    case BOX_SHAPE_PROXYTYPE:
      return is_exactly<btBoxShape>(shape) ? kBox | kConvex : 0;
    case STATIC_PLANE_PROXYTYPE:
      return is_exactly<btStaticPlaneShape>(shape) ? kPlane : 0;
    case CAPSULE_SHAPE_PROXYTYPE:
      return is_one_of<btCapsuleShape, btCapsuleShapeX, btCapsuleShapeZ>(shape) ? kConvex : 0;
    case CYLINDER_SHAPE_PROXYTYPE:
      return is_one_of<btCylinderShape, btCylinderShapeX, btCylinderShapeZ>(shape) ? kConvex : 0;
    case CONE_SHAPE_PROXYTYPE:
      return is_one_of<btConeShape, btConeShapeX, btConeShapeZ>(shape) ? kConvex : 0;
    case CONVEX_HULL_SHAPE_PROXYTYPE:
      return is_plain_hull(shape) ? kConvex : 0;
    case MULTI_SPHERE_SHAPE_PROXYTYPE:
      return is_exactly<btMultiSphereShape>(shape) ? kConvex : 0;
    default:
      return 0;
  }
}

std::uint8_t SphereBatch::read_body(std::size_t number) {
  constexpr Real kNaN = std::numeric_limits<Real>::quiet_NaN();
  const btCollisionObject& body = *bodies_[number];
  unsigned traits = body.isActive() ? kActive : 0;
  if (body.*BodyFields::check_collide_with != 0) {
    traits |= has_stock_filter(body) ? kHasIgnoreList : kHasIgnoreList | kOverridesFilter;
  }
  if ((body.getCollisionFlags() & special_flags_) != 0) traits |= kCustomMaterial;
  if (copies_states_) states_[number] = state_of(body);
  const btCollisionShape* shape = body.getCollisionShape();
  if (shape->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
    traits |= kSphere;
    const btVector3& centre = body.getWorldTransform().getOrigin();
    spheres_[number] = {{centre.x(), centre.y(), centre.z()},
                        static_cast<const btSphereShape*>(shape)->getRadius()};
  } else {
    traits |= traits_of(*shape);
    spheres_[number] = {{}, kNaN};
  }
  return static_cast<std::uint8_t>(traits);
}

bool SphereBatch::is_current(SphereIndex number) const {
  if ((traits_[number] & kSphere) == 0) return true;
  const btCollisionObject& body = *bodies_[number];
  const btCollisionShape* const shape = body.getCollisionShape();
  if (shape->getShapeType() != SPHERE_SHAPE_PROXYTYPE) return false;
  const btVector3& centre = body.getWorldTransform().getOrigin();
  const SphereInstance now{{centre.x(), centre.y(), centre.z()},
                           static_cast<const btSphereShape*>(shape)->getRadius()};
  const SphereInstance& then = spheres_[number];
  // Bits: the signs of zeros differ in results.
  const Real values[] = {now.centre.x, now.centre.y, now.centre.z, now.radius};
  const Real kept[] = {then.centre.x, then.centre.y, then.centre.z, then.radius};
  return std::memcmp(values, kept, sizeof values) == 0;
}

void SphereBatch::prefetch_states(std::size_t i) const {
  for (const SphereIndex number : {pairs()[i].a, pairs()[i].b}) {
    if (copies_states_) {
      prefetch_ends(&states_[number], sizeof(PackedBody));
    } else {
      prefetch_for_contact(*bodies_[number]);
    }
  }
}

SphereBatch::Summary SphereBatch::read_bodies(std::size_t begin, std::size_t end) {
  const ProxyTable& proxies = table_.proxies();
  constexpr std::size_t kAhead = 12;
  Summary summary;
  for (std::size_t i = begin; i < end + 3 * kAhead; ++i) {
    // Software pipeline: proxy, body and shape are prefetched kAhead iterations apart, because the
    // address of each is read from its predecessor.
    if (i < end && proxies.in_use(i)) prefetch(&proxies.proxy(i)->m_clientObject);
    if (const std::size_t k = i - kAhead; i >= begin + kAhead && k < end) {
      bodies_[k] = proxies.in_use(k)
                       ? static_cast<const btCollisionObject*>(proxies.proxy(k)->m_clientObject)
                       : nullptr;
      if (bodies_[k] != nullptr) {
        copies_states_ ? prefetch_for_contact(*bodies_[k]) : prefetch_geometry(*bodies_[k]);
      }
    }
    if (const std::size_t k = i - 2 * kAhead; i >= begin + 2 * kAhead && k < end) {
      if (bodies_[k] != nullptr) {
        prefetch_ends(bodies_[k]->getCollisionShape(), sizeof(btSphereShape));
      }
    }
    if (i < begin + 3 * kAhead) continue;
    const std::size_t k = i - 3 * kAhead;
    if (bodies_[k] == nullptr) continue;
    traits_[k] = read_body(k);
    summary.traits |= traits_[k];
    summary.collision_flags |= bodies_[k]->getCollisionFlags();
    summary.spheres += (traits_[k] & kSphere) != 0 ? 1 : 0;
    summary.wrapped_spheres +=
        is_wrapped_sphere(*bodies_[k]->getCollisionShape(), traits_[k]) ? 1 : 0;
  }
  return summary;
}

std::size_t SphereBatch::gather(std::span<const btBroadphasePair> pairs, const PairOwner& owner,
                                ThreadPool& pool) {
  table_.refresh(pairs, owner, pool);
  const std::size_t n = table_.proxies().size();
  bodies_.resize(n);
  spheres_.resize(n);
  traits_.resize(n);
  copies_states_ = expected_contacts_ > n;
  if (copies_states_) states_.resize(n);
  special_flags_ = special_collision_flags();
  summaries_.resize((n + kBodyChunk - 1) / kBodyChunk);
  pool.run(summaries_.size(), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kBodyChunk;
    summaries_[chunk] = read_bodies(begin, std::min(n, begin + kBodyChunk));
  });
  Summary all;
  for (const Summary& part : summaries_) {
    all.traits |= part.traits;
    all.collision_flags |= part.collision_flags;
    all.spheres += part.spheres;
    all.wrapped_spheres += part.wrapped_spheres;
  }
  any_trait_ = all.traits;
  any_collision_flag_ = all.collision_flags;
  wrapped_spheres_ = all.wrapped_spheres;
  return all.spheres;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
