/// Comparison of Bullet's sphere-sphere contact points with those of find_contacts().
#include <jfpx/bullet/verify.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/dispatch/point_fields.hpp"

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// A contact point of Bullet between two captured spheres, a before b.
struct BulletPoint {
  SphereIndex a, b;
  btManifoldPoint point;
};

bool operator<(const BulletPoint& p, const BulletPoint& q) {
  return std::pair(p.a, p.b) < std::pair(q.a, q.b);
}

}  // namespace

struct ContactCheck::Impl {
  std::unique_ptr<SphereCollider> collider;
  std::vector<btCollisionObject*> bodies;  ///< spheres, in the order of their proxies' ids
  std::vector<SphereInstance> spheres;
  std::vector<bool> active;
  bool captured = false;
  std::uint64_t compared = 0, mismatches = 0;
  std::optional<Difference> first;

  std::vector<BulletPoint> points_of(btDynamicsWorld& world) const;
  bool are_filtered(btDynamicsWorld& world, SphereIndex a, SphereIndex b) const;
  void mismatch(const FieldDifference& field, SphereIndex a, SphereIndex b, std::uint64_t step);
  void compare_contact(const SphereContact& contact, const btManifoldPoint& point,
                       std::uint64_t step);
};

/// Reads the pair cache, not the dispatcher's array, which also contains the predictive contacts of
/// continuous collision, whose spheres do not touch.
std::vector<BulletPoint> ContactCheck::Impl::points_of(btDynamicsWorld& world) const {
  const auto by_proxy = [](const btCollisionObject* body, const btBroadphaseProxy* proxy) {
    return body->getBroadphaseHandle()->getUid() < proxy->getUid();
  };
  const auto index_of = [&](const btBroadphaseProxy* proxy) -> std::optional<SphereIndex> {
    const auto found = std::lower_bound(bodies.begin(), bodies.end(), proxy, by_proxy);
    if (found == bodies.end() || (*found)->getBroadphaseHandle() != proxy) return std::nullopt;
    return static_cast<SphereIndex>(found - bodies.begin());
  };
  std::vector<BulletPoint> points;
  btOverlappingPairCache& cache = *world.getPairCache();
  btManifoldArray manifolds;
  for (int i = 0; i < cache.getNumOverlappingPairs(); ++i) {
    const btBroadphasePair& pair = cache.getOverlappingPairArrayPtr()[i];
    if (pair.m_algorithm == nullptr) continue;
    const auto a = index_of(pair.m_pProxy0), b = index_of(pair.m_pProxy1);
    if (!a || !b) continue;
    manifolds.resizeNoInitialize(0);
    pair.m_algorithm->getAllContactManifolds(manifolds);
    for (int m = 0; m < manifolds.size(); ++m) {
      for (int k = 0; k < manifolds[m]->getNumContacts(); ++k) {
        points.push_back({*a, *b, manifolds[m]->getContactPoint(k)});
      }
    }
  }
  std::sort(points.begin(), points.end());
  return points;
}

bool ContactCheck::Impl::are_filtered(btDynamicsWorld& world, SphereIndex a, SphereIndex b) const {
  const btCollisionObject& body_a = *bodies[a];
  const btCollisionObject& body_b = *bodies[b];
  return !world.getPairCache()->needsBroadphaseCollision(bodies[a]->getBroadphaseHandle(),
                                                         bodies[b]->getBroadphaseHandle()) ||
         !body_a.checkCollideWith(&body_b) || !body_b.checkCollideWith(&body_a) ||
         (!active[a] && !active[b]);
}

void ContactCheck::Impl::mismatch(const FieldDifference& field, SphereIndex a, SphereIndex b,
                                  std::uint64_t step) {
  ++mismatches;
  if (first) return;
  const auto index = [this](SphereIndex i) {
    return static_cast<std::uint64_t>(bodies[i]->getWorldArrayIndex());
  };
  first = {step,
           "pair",
           index(a),
           index(b),
           field.field,
           field.expected,
           field.actual,
           field.expected_bits,
           field.actual_bits};
}

void ContactCheck::Impl::compare_contact(const SphereContact& contact, const btManifoldPoint& point,
                                         std::uint64_t step) {
  const Vec3 on_b = point_on_b(contact.normal, spheres[contact.b]);
  FieldComparison compare;
  compare("normal.x", point.m_normalWorldOnB.x(), contact.normal.x);
  compare("normal.y", point.m_normalWorldOnB.y(), contact.normal.y);
  compare("normal.z", point.m_normalWorldOnB.z(), contact.normal.z);
  compare("distance", point.m_distance1, contact.distance);
  compare("point on b.x", point.m_positionWorldOnB.x(), on_b.x);
  compare("point on b.y", point.m_positionWorldOnB.y(), on_b.y);
  compare("point on b.z", point.m_positionWorldOnB.z(), on_b.z);
  if (compare.first()) mismatch(*compare.first(), contact.a, contact.b, step);
}

ContactCheck::ContactCheck(std::unique_ptr<SphereCollider> collider)
    : impl_(std::make_unique<Impl>()) {
  if (collider == nullptr) throw InvalidArgument("collider is null; it must be a SphereCollider");
  impl_->collider = std::move(collider);
}
ContactCheck::~ContactCheck() = default;
ContactCheck::ContactCheck(ContactCheck&&) noexcept = default;
ContactCheck& ContactCheck::operator=(ContactCheck&&) noexcept = default;

void ContactCheck::capture(const btDynamicsWorld& world) {
  Impl& impl = *impl_;
  impl.captured = true;
  impl.bodies.clear();
  impl.spheres.clear();
  impl.active.clear();
  const btCollisionObjectArray& all = world.getCollisionObjectArray();
  for (int i = 0; i < all.size(); ++i) {
    if (all[i]->getCollisionShape()->getShapeType() == SPHERE_SHAPE_PROXYTYPE) {
      impl.bodies.push_back(all[i]);
    }
  }
  // Bullet puts the body with the lower proxy id first; the same order yields the same direction of
  // normals.
  std::sort(impl.bodies.begin(), impl.bodies.end(), [](const auto* a, const auto* b) {
    return a->getBroadphaseHandle()->getUid() < b->getBroadphaseHandle()->getUid();
  });
  for (const btCollisionObject* body : impl.bodies) {
    const btVector3& centre = body->getWorldTransform().getOrigin();
    const auto* sphere = static_cast<const btSphereShape*>(body->getCollisionShape());
    impl.spheres.push_back({{centre.x(), centre.y(), centre.z()}, sphere->getRadius()});
    impl.active.push_back(body->isActive());
  }
}

std::uint64_t ContactCheck::compare(btDynamicsWorld& world, std::uint64_t step) {
  Impl& impl = *impl_;
  if (!impl.captured) throw InvalidArgument("nothing was captured; call capture() before the step");
  const ContactSpan contacts = impl.collider->find_contacts(impl.spheres);
  const std::vector<BulletPoint> points = impl.points_of(world);
  std::uint64_t compared = 0;
  std::size_t k = 0;
  // Both lists are sorted by (a, b), so they are merged.
  const auto extra = [&](const BulletPoint& p) {
    ++compared;
    impl.mismatch({"touching", 1, 0, 1, 0}, p.a, p.b, step);
  };
  for (const SphereContact& contact : contacts) {
    const BulletPoint key{contact.a, contact.b, {}};
    while (k < points.size() && points[k] < key) extra(points[k++]);
    if (k < points.size() && !(key < points[k])) {
      ++compared;
      impl.compare_contact(contact, points[k++].point, step);
    } else if (!impl.are_filtered(world, contact.a, contact.b)) {
      ++compared;
      impl.mismatch({"touching", 0, 1, 0, 1}, contact.a, contact.b, step);
    }
  }
  while (k < points.size()) extra(points[k++]);
  impl.compared += compared;
  return compared;
}

std::uint64_t ContactCheck::compared() const noexcept { return impl_->compared; }
std::uint64_t ContactCheck::mismatches() const noexcept { return impl_->mismatches; }
const std::optional<Difference>& ContactCheck::first() const noexcept { return impl_->first; }

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
