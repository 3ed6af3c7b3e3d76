/// Synchronization with the pair array: a streaming comparison finds the few changed entries.
#include "src/bullet/dispatch/pair_table.hpp"

#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"
#include "src/bullet/reveal.hpp"

#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>
#include <BulletCollision/NarrowPhaseCollision/btGjkEpaPenetrationDepthSolver.h>

#include <algorithm>
#include <bit>
#include <new>
#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

// Of a btConvexConvexAlgorithm: the number of perturbations and the penetration depth solver, which
// it copies from its configuration. Of a btConvexPlaneCollisionAlgorithm and a
// btConvexConcaveCollisionAlgorithm: whether the plane or concave shape is the first body.
struct PerturbationTag {
  friend int btConvexConvexAlgorithm::*member_of(PerturbationTag);
};
struct DepthSolverTag {
  friend btConvexPenetrationDepthSolver* btConvexConvexAlgorithm::*member_of(DepthSolverTag);
};
struct PlaneFirstTag {
  friend bool btConvexPlaneCollisionAlgorithm::*member_of(PlaneFirstTag);
};
struct ConcaveFirstTag {
  friend bool btConvexConcaveCollisionAlgorithm::*member_of(ConcaveFirstTag);
};
template struct Reveal<PerturbationTag, &btConvexConvexAlgorithm::m_numPerturbationIterations>;
template struct Reveal<DepthSolverTag, &btConvexConvexAlgorithm::m_pdSolver>;
template struct Reveal<PlaneFirstTag, &btConvexPlaneCollisionAlgorithm::m_isSwapped>;
template struct Reveal<ConcaveFirstTag, &btConvexConcaveCollisionAlgorithm::m_isSwapped>;

namespace {

constexpr std::size_t kAhead = 16;

struct AlgorithmFields : btCollisionAlgorithm {
  static constexpr auto dispatcher = &AlgorithmFields::m_dispatcher;
};

/// Whether Bullet's EPA computes the penetration of deep contacts. Unlike
/// btMinkowskiPenetrationDepthSolver, it has no state shared by threads.
bool uses_epa(const btConvexConvexAlgorithm& algorithm) {
  const btConvexPenetrationDepthSolver* solver = algorithm.*member_of(DepthSolverTag());
  return solver != nullptr && is_exactly<btGjkEpaPenetrationDepthSolver>(*solver);
}

/// The manifold of an algorithm of exactly this class; null if it does not own one. The call is
/// qualified, so that it can be inlined.
template <class Algorithm>
btPersistentManifold* manifold_of(btCollisionAlgorithm* algorithm) {
  btPersistentManifold* room[1];
  btManifoldArray found;
  found.initializeFromBuffer(room, 0, 1);
  static_cast<Algorithm*>(algorithm)->Algorithm::getAllContactManifolds(found);
  return found.size() == 1 ? found[0] : nullptr;
}

}  // namespace

void PairTable::note_release(const btPersistentManifold* manifold) noexcept {
  if (invalid_ || keys_.empty()) return;
  if (released_.size() > 1024 + keys_.size() / 4) {
    invalid_ = true;
    return;
  }
  try {
    released_.push_back(manifold);
  } catch (const std::bad_alloc&) {
    invalid_ = true;
  }
}

void PairTable::clear() {
  keys_.clear();
  pairs_.clear();
  links_.clear();
  proxies_.clear();
}

void PairTable::resize(std::size_t pairs) {
  for (std::size_t i = pairs; i < keys_.size(); ++i) {
    if (keys_[i].proxy0 == nullptr) continue;
    proxies_.release(pairs_[i].a);
    proxies_.release(pairs_[i].b);
  }
  keys_.resize(pairs);
  pairs_.resize(pairs);
  links_.resize(pairs);
  changed_.resize(pairs);
  changed_counts_.resize((pairs + kPairChunk - 1) / kPairChunk);
}

/// Builds the Bloom filter of was_released(), with at least 32 bits per manifold, two of which are
/// set. The false-positive rate is about 1 in 100. With one bit it would be about 1 in 10, and
/// rereading those links would cost more than all other work for releases.
void PairTable::build_release_filter() {
  if (released_.empty()) return;
  const std::size_t bits = std::bit_ceil(std::max<std::size_t>(1024, 32 * released_.size()));
  release_shift_ = 64 - std::countr_zero(bits);
  release_bits_.assign(bits / 64, 0);
  for (const btPersistentManifold* manifold : released_) {
    for (const std::uint64_t bit : release_bits_of(manifold)) {
      release_bits_[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
  }
}

/// Two indices of bits in the filter: the highest bits of a hash, and the bits that follow them.
std::array<std::uint64_t, 2> PairTable::release_bits_of(
    const btPersistentManifold* manifold) const {
  const std::uint64_t hash = reinterpret_cast<std::uintptr_t>(manifold) * 0x9e3779b97f4a7c15u;
  return {hash >> release_shift_, hash << (64 - release_shift_) >> release_shift_};
}

bool PairTable::was_released(const btPersistentManifold* manifold) const {
  const auto is_set = [&](std::uint64_t bit) {
    return (release_bits_[bit / 64] >> (bit % 64) & 1) != 0;
  };
  const auto [first, second] = release_bits_of(manifold);
  return is_set(first) && is_set(second);
}

std::size_t PairTable::find_changed(std::span<const btBroadphasePair> pairs, std::size_t begin,
                                    std::size_t end, std::uint32_t* changed) const {
  const bool check_releases = !released_.empty();
  std::size_t count = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const btBroadphasePair& pair = pairs[i];
    const Key& key = keys_[i];
    const bool same = key.proxy0 == pair.m_pProxy0 && key.proxy1 == pair.m_pProxy1 &&
                      key.algorithm == pair.m_algorithm && links_[i].cacheable();
    if (same && !(check_releases && was_released(links_[i].manifold()))) continue;
    changed[count++] = static_cast<std::uint32_t>(i);
  }
  return count;
}

PairLink read_link(btCollisionAlgorithm* algorithm, const btDispatcher* owner) {
  if (algorithm == nullptr) return {};
  const std::type_info* type = type_info_of(*algorithm);
  btPersistentManifold* manifold = nullptr;
  PairKind kind = PairKind::other;
  if (type == &typeid(btSphereSphereCollisionAlgorithm)) {
    manifold = manifold_of<btSphereSphereCollisionAlgorithm>(algorithm);
    kind = PairKind::spheres;
  } else if (type == &typeid(btConvexConvexAlgorithm)) {
    auto* convex = static_cast<btConvexConvexAlgorithm*>(algorithm);
    if (convex->*member_of(PerturbationTag()) != 0 || !uses_epa(*convex)) return {};
    manifold = manifold_of<btConvexConvexAlgorithm>(algorithm);
    kind = PairKind::convex;
  } else if (type == &typeid(btConvexPlaneCollisionAlgorithm)) {
    // The perturbation of this algorithm applies to polyhedra only.
    auto* plane = static_cast<btConvexPlaneCollisionAlgorithm*>(algorithm);
    manifold = manifold_of<btConvexPlaneCollisionAlgorithm>(algorithm);
    kind = plane->*member_of(PlaneFirstTag()) ? PairKind::plane_convex : PairKind::convex_plane;
  } else if (type == &typeid(btBoxBoxCollisionAlgorithm)) {
    manifold = manifold_of<btBoxBoxCollisionAlgorithm>(algorithm);
    kind = PairKind::boxes;
  } else if (type == &typeid(btConvexConcaveCollisionAlgorithm)) {
    // Creates the algorithms for triangles through its own dispatcher.
    if (algorithm->*AlgorithmFields::dispatcher != owner) return {};
    auto* concave = static_cast<btConvexConcaveCollisionAlgorithm*>(algorithm);
    manifold = manifold_of<btConvexConcaveCollisionAlgorithm>(algorithm);
    kind = concave->*member_of(ConcaveFirstTag()) ? PairKind::concave_convex
                                                  : PairKind::convex_concave;
  }
  if (!PairLink::can_hold(manifold)) return {};
  return {manifold, kind, algorithm->*AlgorithmFields::dispatcher == owner};
}

void PairTable::update(std::span<const btBroadphasePair> pairs,
                       std::span<const std::uint32_t> changed, const PairOwner& owner) {
  for (std::size_t k = 0; k < changed.size(); ++k) {
    if (k + kAhead < changed.size()) {
      const btBroadphasePair& later = pairs[changed[k + kAhead]];
      proxies_.prefetch(later.m_pProxy0);
      proxies_.prefetch(later.m_pProxy1);
      prefetch_ends(later.m_algorithm, sizeof(btSphereSphereCollisionAlgorithm));
    }
    const std::size_t i = changed[k];
    const btBroadphasePair& pair = pairs[i];
    Key& key = keys_[i];
    if (key.proxy0 != pair.m_pProxy0 || key.proxy1 != pair.m_pProxy1) {
      const SpherePair old = pairs_[i];
      pairs_[i] = {proxies_.acquire(pair.m_pProxy0), proxies_.acquire(pair.m_pProxy1)};
      if (key.proxy0 != nullptr) {
        proxies_.release(old.a);
        proxies_.release(old.b);
      }
    }
    key = {pair.m_pProxy0, pair.m_pProxy1, pair.m_algorithm};
    links_[i] = read_link(pair.m_algorithm, owner.dispatcher);
  }
}

void PairTable::refresh(std::span<const btBroadphasePair> pairs, const PairOwner& owner,
                        ThreadPool& pool) {
  if (invalid_ || proxies_.wasteful() || proxies_.size() == 0) clear();
  resize(pairs.size());
  build_release_filter();
  const auto end_of = [&](std::size_t chunk) {
    return std::min(pairs.size(), (chunk + 1) * kPairChunk);
  };
  pool.run(changed_counts_.size(), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kPairChunk;
    changed_counts_[chunk] = find_changed(pairs, begin, end_of(chunk), &changed_[begin]);
  });
  for (std::size_t chunk = 0; chunk < changed_counts_.size(); ++chunk) {
    const std::span<const std::uint32_t> changed(&changed_[chunk * kPairChunk],
                                                 changed_counts_[chunk]);
    update(pairs, changed, owner);
  }
  released_.clear();
  invalid_ = false;
  if (owner.reports_releases) return;
  pool.run(changed_counts_.size(), [&](std::size_t chunk) {
    const std::size_t end = end_of(chunk);
    for (std::size_t i = chunk * kPairChunk; i < end; ++i) {
      if (i + kAhead < end) {
        prefetch_ends(pairs[i + kAhead].m_algorithm, sizeof(btSphereSphereCollisionAlgorithm));
      }
      links_[i] = read_link(pairs[i].m_algorithm, owner.dispatcher);
    }
  });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
