/// Gathers bodies and pairs. Memory latency is all there is to it: piles of 16k spheres have tens
/// of megabytes of bodies, algorithms and manifolds, so everything is prefetched.
#include "src/bullet/sphere_batch.hpp"

#include <BulletCollision/CollisionDispatch/btGhostObject.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletDynamics/Dynamics/btRigidBody.h>

#include <algorithm>
#include <typeinfo>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

constexpr std::size_t kCacheLine = 64;
/// Pairs handled per pass of plan(): enough to overlap their cache misses, few enough to stay in
/// the first-level cache between the passes.
constexpr std::size_t kBlock = 64;

void prefetch(const void* address) { __builtin_prefetch(address); }
void prefetch_bytes(const void* address, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; i += kCacheLine) {
    __builtin_prefetch(static_cast<const char*>(address) + i);
  }
}

/// For an object no larger than a cache line, which may lie across two.
void prefetch_ends(const void* address, std::size_t bytes) {
  prefetch(address);
  prefetch(static_cast<const char*>(address) + bytes - 1);
}

/// Prefetches what getNumContacts() reads. The count is private; two thresholds lie between it and
/// the first public member behind it.
void prefetch_count(const btPersistentManifold* manifold) {
  prefetch(reinterpret_cast<const char*>(&manifold->m_companionIdA) - 3 * sizeof(btScalar));
}

/// True for exactly the classes whose checkCollideWithOverride is known to be free of side effects.
/// typeid compares addresses here: a copy of the class in another library counts as foreign, which
/// costs time and no bits.
bool is_bullets_own_class(const btCollisionObject& body) {
  const std::type_info* type = &typeid(body);
  return type == &typeid(btRigidBody) || type == &typeid(btCollisionObject) ||
         type == &typeid(btGhostObject) || type == &typeid(btPairCachingGhostObject);
}

}  // namespace

bool SphereBatch::gather(std::span<const btBroadphasePair> pairs) {
  table_.reset(std::min(2 * pairs.size(), bodies_.size()));
  pairs_.resize(pairs.size());
  constexpr std::size_t kAhead = 16;
  const std::size_t prefetched = table_.fits_first_level_cache() ? 0 : pairs.size();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (i + kAhead < prefetched) {
      table_.prefetch(pairs[i + kAhead].m_pProxy0);
      table_.prefetch(pairs[i + kAhead].m_pProxy1);
    }
    const std::uint32_t a = table_.number(pairs[i].m_pProxy0);
    const std::uint32_t b = table_.number(pairs[i].m_pProxy1);
    pairs_[i] = {a, b};
  }
  read_bodies();
  return std::count_if(traits_.begin(), traits_.end(),
                       [](std::uint8_t traits) { return (traits & kSphere) != 0; }) >= 2;
}

void SphereBatch::read_bodies() {
  const std::vector<btBroadphaseProxy*>& proxies = table_.proxies();
  const std::size_t n = proxies.size();
  bodies_.resize(n);
  spheres_.assign(n, {});
  traits_.assign(n, 0);
  constexpr std::size_t kAhead = 16;
  for (std::size_t i = 0; i < n + 2 * kAhead; ++i) {
    if (i < n) prefetch(&proxies[i]->m_clientObject);
    if (i >= kAhead && i - kAhead < n) {
      const auto* body = static_cast<const btCollisionObject*>(proxies[i - kAhead]->m_clientObject);
      bodies_[i - kAhead] = body;
      prefetch_bytes(body, 4 * sizeof(btTransform));  // pose and shape
    }
    if (i < 2 * kAhead) continue;
    const std::size_t k = i - 2 * kAhead;
    const btCollisionObject& body = *bodies_[k];
    if (!is_bullets_own_class(body)) traits_[k] |= kForeign;
    const btCollisionShape* shape = body.getCollisionShape();
    if (shape->getShapeType() != SPHERE_SHAPE_PROXYTYPE) continue;
    traits_[k] |= kSphere;
    const btVector3& centre = body.getWorldTransform().getOrigin();
    spheres_[k] = {{centre.x(), centre.y(), centre.z()},
                   static_cast<const btSphereShape*>(shape)->getRadius()};
  }
}

btPersistentManifold* SphereBatch::find_manifold(btCollisionAlgorithm* algorithm) {
  if (algorithm == nullptr || &typeid(*algorithm) != &typeid(btSphereSphereCollisionAlgorithm)) {
    return nullptr;
  }
  found_.resizeNoInitialize(0);
  // Qualified: known not to be overridden, so it inlines.
  auto* spheres = static_cast<btSphereSphereCollisionAlgorithm*>(algorithm);
  spheres->btSphereSphereCollisionAlgorithm::getAllContactManifolds(found_);
  return found_.size() == 1 ? found_[0] : nullptr;
}

void SphereBatch::find_manifolds(std::span<const btBroadphasePair> pairs,
                                 std::span<const PairResult> results, std::size_t begin,
                                 std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    manifolds_[i] = nullptr;
    if ((traits_[pairs_[i].a] & traits_[pairs_[i].b] & kSphere) == 0) continue;
    ++sphere_pair_count_;
    touching_count_ += results[i].touching;
    manifolds_[i] = find_manifold(pairs[i].m_algorithm);
    if (manifolds_[i] != nullptr && results[i].touching == 0) prefetch_count(manifolds_[i]);
  }
}

void SphereBatch::plan(std::span<const btBroadphasePair> pairs, std::span<const PairResult> results,
                       bool ask_all) {
  const std::size_t n = pairs.size();
  actions_.resize(n);
  manifolds_.resize(n);
  sphere_pair_count_ = touching_count_ = 0;
  for (std::size_t begin = 0; begin < n; begin += kBlock) {
    const std::size_t end = std::min(n, begin + kBlock);
    for (std::size_t i = end; i < std::min(n, end + kBlock); ++i) {
      prefetch_ends(pairs[i].m_algorithm, sizeof(btSphereSphereCollisionAlgorithm));
    }
    find_manifolds(pairs, results, begin, end);
    for (std::size_t i = begin; i < end; ++i) {
      if (manifolds_[i] == nullptr) {
        actions_[i] = Action::stock;
      } else if (results[i].touching != 0 || manifolds_[i]->getNumContacts() != 0) {
        actions_[i] = Action::commit;
      } else {
        const bool foreign = ((traits_[pairs_[i].a] | traits_[pairs_[i].b]) & kForeign) != 0;
        actions_[i] = ask_all || foreign ? Action::ask : Action::skip;
      }
    }
  }
}

void SphereBatch::prefetch_commit(std::size_t i) const {
  prefetch_bytes(manifolds_[i], sizeof(btManifoldPoint) + sizeof(btTypedObject));
  prefetch_bytes(body_a(i), sizeof(btCollisionObject));
  prefetch_bytes(body_b(i), sizeof(btCollisionObject));
}

}  // namespace jfpx::inline JFPX_ABI::bullet
