/// One pass over the pairs: most need no more than a look at the number of points.
#include "src/bullet/quiet_commit.hpp"

#include "src/bullet/contact_point.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>

#include <algorithm>
#include <cstring>
#include <typeinfo>
#include <utility>

namespace jfpx::inline JFPX_ABI::bullet {
namespace {

class Committer {
 public:
  Committer(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
            std::span<const PairResult> results, std::size_t begin, std::size_t end)
      : dispatcher_(dispatcher), batch_(batch), results_(results), begin_(begin), end_(end) {}

  /// Writes the pairs that are left to Bullet to `left` and returns their number.
  std::size_t run(std::uint32_t* left) {
    std::size_t count = 0;
    for (std::size_t i = begin_; i < std::min(end_, begin_ + kCountAhead); ++i) ask_for_count(i);
    for (std::size_t i = begin_; i < std::min(end_, begin_ + kWriteAhead); ++i) ask_for_rest(i);
    for (std::size_t i = begin_; i < end_; ++i) {
      if (i + kCountAhead < end_) ask_for_count(i + kCountAhead);
      if (i + kWriteAhead < end_) ask_for_rest(i + kWriteAhead);
      if (!commit(i)) left[count++] = static_cast<std::uint32_t>(i);
    }
    return count;
  }
  const CommitCounts& counts() const { return counts_; }

 private:
  /// Most pairs take a nanosecond or two, and memory some hundred.
  static constexpr std::size_t kCountAhead = 64;
  /// Pairs that touch take longer, and need a dozen cache lines.
  static constexpr std::size_t kWriteAhead = 16;

  void ask_for_count(std::size_t i) const {
    if (batch_.kind(i) != PairKind::other) prefetch_count(batch_.manifold(i));
  }
  void ask_for_rest(std::size_t i) const {
    if (results_[i].touching == 0 || batch_.kind(i) == PairKind::other) return;
    prefetch_first_point(batch_.manifold(i));
    prefetch_for_contact(*batch_.body_a(i));
    prefetch_for_contact(*batch_.body_b(i));
  }

  /// False if the pair is left to Bullet.
  bool commit(std::size_t i) {
    switch (batch_.kind(i)) {
      case PairKind::other:
        if (batch_.both_are_spheres(i)) count_pair(i);
        return false;
      case PairKind::spheres:
        return commit_spheres(i);
      case PairKind::convex:
        return commit_with(kBox, (batch_.trait_a(i) & kSphere) != 0, i, update_sphere_box,
                           &counts_.sphere_boxes);
      case PairKind::convex_plane:
        return commit_with(kPlane, true, i, update_sphere_plane, &counts_.sphere_planes);
      case PairKind::plane_convex:
        return commit_with(kPlane, false, i, update_sphere_plane, &counts_.sphere_planes);
    }
    return false;
  }

  bool commit_spheres(std::size_t i) {
    btPersistentManifold* manifold = batch_.manifold(i);
    if (results_[i].touching == 0 && manifold->getNumContacts() == 0) {
      ++counts_.sphere_pairs;
      return true;
    }
    if (!batch_.both_are_spheres(i)) return false;  // the shape was exchanged under the algorithm
    count_pair(i);
    if ((batch_.either_trait(i) & kActive) == 0) return true;
    const btCollisionObject *a = batch_.body_a(i), *b = batch_.body_b(i);
    if (!is_plain(*manifold, *a, *b)) return false;
    // Qualified: nobody has overridden it.
    if (!dispatcher_.btCollisionDispatcher::needsCollision(a, b)) return true;
    ++counts_.written;
    write_contact(manifold, results_[i], *a, *b, batch_.spheres()[batch_.pairs()[i].b].radius);
    return true;
  }

  /// A sphere and a body that has the trait `other`.
  template <class Update>
  bool commit_with(BodyTrait other, bool sphere_first, std::size_t i, Update update,
                   std::uint64_t* count) {
    const unsigned a_is = batch_.trait_a(i), b_is = batch_.trait_b(i);
    // The shapes may have been exchanged under the algorithm.
    if (((sphere_first ? a_is : b_is) & kSphere) == 0) return false;
    if (((sphere_first ? b_is : a_is) & other) == 0) return false;
    if ((batch_.either_trait(i) & kActive) == 0) return true;
    const btCollisionObject *a = batch_.body_a(i), *b = batch_.body_b(i);
    const btCollisionShape* sphere = (sphere_first ? a : b)->getCollisionShape();
    if (&typeid(*sphere) != &typeid(btSphereShape)) return false;
    if (!dispatcher_.btCollisionDispatcher::needsCollision(a, b)) return true;
    if (!update(batch_.manifold(i), *a, *b, sphere_first)) return false;
    ++*count;
    return true;
  }

  void count_pair(std::size_t i) {
    ++counts_.sphere_pairs;
    counts_.touching += results_[i].touching;
  }

  btCollisionDispatcher& dispatcher_;
  const SphereBatch& batch_;
  std::span<const PairResult> results_;
  std::size_t begin_, end_;
  CommitCounts counts_;
};

}  // namespace

bool is_quiet(const SphereBatch& batch, bool ask_all) {
  if (ask_all || (batch.any_trait() & kForeign) != 0) return false;
  if (contacts_are_heard() || gContactProcessedCallback != nullptr) return false;
  return gContactAddedCallback == nullptr ||
         (batch.any_collision_flag() & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) == 0;
}

void QuietCommit::reserve(std::size_t pairs) {
  left_.resize(pairs);
  chunks_.resize((pairs + kPairChunk - 1) / kPairChunk);
}

CommitCounts QuietCommit::run(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
                              std::span<const PairResult> results, x86::ThreadPool& pool) {
  const std::size_t n = results.size();
  pool.run(chunks_.size(), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kPairChunk;
    Committer committer(dispatcher, batch, results, begin, std::min(n, begin + kPairChunk));
    chunks_[chunk].left = committer.run(&left_[begin]);
    chunks_[chunk].counts = committer.counts();
  });
  CommitCounts sum;
  left_count_ = 0;
  for (std::size_t chunk = 0; chunk < chunks_.size(); ++chunk) {
    const Chunk& part = chunks_[chunk];
    std::memmove(&left_[left_count_], &left_[chunk * kPairChunk],
                 part.left * sizeof(std::uint32_t));
    left_count_ += part.left;
    sum.sphere_pairs += part.counts.sphere_pairs;
    sum.touching += part.counts.touching;
    sum.written += part.counts.written;
    sum.sphere_boxes += part.counts.sphere_boxes;
    sum.sphere_planes += part.counts.sphere_planes;
  }
  return sum;
}

void QuietCommit::sort_left(std::span<const btBroadphasePair> pairs, bool deterministic) {
  if (!deterministic) return;  // ascending already: the order of the array
  const auto ids = [&](std::uint32_t i) {
    return std::pair(pairs[i].m_pProxy0->m_uniqueId, pairs[i].m_pProxy1->m_uniqueId);
  };
  std::sort(left_.begin(), left_.begin() + static_cast<std::ptrdiff_t>(left_count_),
            [&](std::uint32_t p, std::uint32_t q) { return ids(p) > ids(q); });
}

}  // namespace jfpx::inline JFPX_ABI::bullet
