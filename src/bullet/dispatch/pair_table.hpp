/// Data of the pairs of a pair cache that persist between dispatches.
#pragma once

#include <jfpx/contact.hpp>

#include "src/base/thread_pool.hpp"
#include "src/bullet/dispatch/proxy_table.hpp"

#include <BulletCollision/BroadphaseCollision/btBroadphaseProxy.h>
#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/BroadphaseCollision/btDispatcher.h>

#include <array>
#include <span>
#include <vector>

class btPersistentManifold;

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Number of pairs per chunk of a parallel loop.
inline constexpr std::size_t kPairChunk = 2048;

/// Class of Bullet's algorithm of a pair.
enum class PairKind : std::uint8_t {
  other,           ///< no algorithm yet, or one that Bullet must run
  spheres,         ///< btSphereSphereCollisionAlgorithm with a manifold
  convex,          ///< btConvexConvexAlgorithm with a manifold, Bullet's EPA, without perturbation
  convex_plane,    ///< btConvexPlaneCollisionAlgorithm with a manifold, the plane second
  plane_convex,    ///< btConvexPlaneCollisionAlgorithm with a manifold, the plane first
  boxes,           ///< btBoxBoxCollisionAlgorithm with a manifold
  convex_concave,  ///< btConvexConcaveCollisionAlgorithm of this dispatcher, the concave shape
                   ///< second
  concave_convex,  ///< btConvexConcaveCollisionAlgorithm of this dispatcher, the concave shape
                   ///< first
};

/// Whether one shape of the pair is concave.
inline bool is_concave(PairKind kind) {
  return kind == PairKind::convex_concave || kind == PairKind::concave_convex;
}

/// The dispatcher that runs the dispatch. Its own algorithms may be cached; algorithms of other
/// dispatchers are read in every refresh().
struct PairOwner {
  const btDispatcher* dispatcher;
  /// Whether note_release() is called for every manifold that this dispatcher releases. If so, the
  /// manifold of an algorithm is read once. Otherwise it is read in every refresh(), because
  /// another algorithm may have been created at the address of a destroyed one.
  bool reports_releases;
};

/// The manifold and the kind of a pair, and whether they may be cached; otherwise they are reread
/// in every dispatch. Packed into one word, because every dispatch streams all links twice.
class PairLink {
 public:
  PairLink() = default;
  PairLink(btPersistentManifold* manifold, PairKind kind, bool cacheable)
      : bits_(reinterpret_cast<std::uintptr_t>(manifold) | static_cast<std::uintptr_t>(kind) |
              (cacheable ? 0 : kNotCacheable)) {}
  /// False for null, and for a manifold whose alignment is lower than that of Bullet's pools.
  static bool can_hold(const btPersistentManifold* manifold) {
    return manifold != nullptr &&
           (reinterpret_cast<std::uintptr_t>(manifold) & (kKind | kNotCacheable)) == 0;
  }
  btPersistentManifold* manifold() const {
    // NOLINTNEXTLINE(performance-no-int-to-ptr): the word also holds the kind
    return reinterpret_cast<btPersistentManifold*>(bits_ & ~(kKind | kNotCacheable));
  }
  PairKind kind() const { return static_cast<PairKind>(bits_ & kKind); }
  bool cacheable() const { return (bits_ & kNotCacheable) == 0; }

 private:
  static constexpr std::uintptr_t kKind = 7, kNotCacheable = 8;
  std::uintptr_t bits_ = 0;
};
/// Reads the class and the manifold of an algorithm; PairKind::other for null. `owner` is the
/// dispatcher that runs the dispatch.
PairLink read_link(btCollisionAlgorithm* algorithm, const btDispatcher* owner);

/// One entry per pair, in the order of the pair array. An entry is valid while the array contains
/// the same proxies and the same algorithm, and the algorithm's manifold has not been released. No
/// cached pointer is dereferenced before this check.
class PairTable {
 public:
  /// Updates the entries to the current pair array. May throw; see invalidate().
  void refresh(std::span<const btBroadphasePair> pairs, const PairOwner& owner, ThreadPool& pool);
  /// Must be called before a manifold is released.
  void note_release(const btPersistentManifold* manifold) noexcept;
  /// Discards all entries. Required after refresh() has thrown.
  void invalidate() noexcept { invalid_ = true; }

  /// The indices of the two proxies of every pair.
  std::span<const SpherePair> pairs() const { return pairs_; }
  PairKind kind(std::size_t i) const { return links_[i].kind(); }
  /// Null for PairKind::other.
  btPersistentManifold* manifold(std::size_t i) const { return links_[i].manifold(); }
  const ProxyTable& proxies() const { return proxies_; }
  /// Whether entry i is that of the proxies of the pair. Dereferences no pointer.
  bool is_entry_of_proxies(const btBroadphasePair& pair, std::size_t i) const {
    return keys_[i].proxy0 == pair.m_pProxy0 && keys_[i].proxy1 == pair.m_pProxy1;
  }
  /// Whether entry i is that of the pair. Dereferences no pointer.
  bool is_entry_of(const btBroadphasePair& pair, std::size_t i) const {
    return is_entry_of_proxies(pair, i) && keys_[i].algorithm == pair.m_algorithm;
  }

 private:
  struct Key {
    const btBroadphaseProxy* proxy0 = nullptr;
    const btBroadphaseProxy* proxy1 = nullptr;
    const btCollisionAlgorithm* algorithm = nullptr;
  };
  void resize(std::size_t pairs);
  void clear();
  void build_release_filter();
  std::array<std::uint64_t, 2> release_bits_of(const btPersistentManifold* manifold) const;
  bool was_released(const btPersistentManifold* manifold) const;
  std::size_t find_changed(std::span<const btBroadphasePair> pairs, std::size_t begin,
                           std::size_t end, std::uint32_t* changed) const;
  void update(std::span<const btBroadphasePair> pairs, std::span<const std::uint32_t> changed,
              const PairOwner& owner);

  ProxyTable proxies_;
  std::vector<Key> keys_;
  std::vector<SpherePair> pairs_;
  std::vector<PairLink> links_;
  std::vector<std::uint32_t> changed_;
  std::vector<std::size_t> changed_counts_;  ///< by chunk
  std::vector<const btPersistentManifold*> released_;
  std::vector<std::uint64_t> release_bits_;  ///< Bloom filter; a false positive costs one read
  int release_shift_ = 0;
  bool invalid_ = false;  ///< refresh() must rebuild all entries
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
