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
  /// `touching` are the contacts of all pairs.
  Committer(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
            std::span<const PairContact> touching, std::size_t begin, std::size_t end)
      : dispatcher_(dispatcher),
        batch_(batch),
        next_(first_contact(touching, begin)),
        last_(touching.data() + touching.size()),
        begin_(begin),
        end_(end) {}

  /// Writes the pairs that are left to Bullet to `left` and returns their number.
  std::size_t run(std::uint32_t* left) {
    std::size_t count = 0;
    for (std::size_t i = begin_; i < std::min(end_, begin_ + kCountAhead); ++i) ask_for_count(i);
    for (std::ptrdiff_t k = 0; k < kContactsAhead; ++k) ask_for_contact(k);
    for (std::size_t i = begin_; i < end_; ++i) {
      if (i + kCountAhead < end_) ask_for_count(i + kCountAhead);
      const PairContact* contact = nullptr;
      if (next_ != last_ && next_->pair == i) {
        ask_for_contact(kContactsAhead);
        contact = next_++;
      }
      if (!commit(i, contact)) left[count++] = static_cast<std::uint32_t>(i);
    }
    return count;
  }
  const CommitCounts& counts() const { return counts_; }

 private:
  /// Most pairs take a nanosecond or two, and memory some hundred.
  static constexpr std::size_t kCountAhead = 64;
  /// Contacts take longer, and need half a dozen cache lines of their manifold.
  static constexpr std::ptrdiff_t kContactsAhead = 10;

  void ask_for_count(std::size_t i) const {
    if (batch_.kind(i) != PairKind::other) prefetch_count(batch_.manifold(i));
  }
  /// For the contact `k` behind the next one.
  void ask_for_contact(std::ptrdiff_t k) const {
    if (last_ - next_ <= k || batch_.kind(next_[k].pair) != PairKind::spheres) return;
    const std::size_t i = next_[k].pair;
    prefetch_header(batch_.manifold(i));
    prefetch_first_point(batch_.manifold(i));
    batch_.prefetch_states(i);
  }

  /// `contact` is null if the spheres do not touch. False if the pair is left to Bullet.
  bool commit(std::size_t i, const PairContact* contact) {
    switch (batch_.kind(i)) {
      case PairKind::other:
        if (batch_.both_are_spheres(i)) count_pair(contact);
        return false;
      case PairKind::spheres:
        return commit_spheres(i, contact);
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

  bool commit_spheres(std::size_t i, const PairContact* contact) {
    btPersistentManifold* manifold = batch_.manifold(i);
    if (contact == nullptr && manifold->getNumContacts() == 0) {
      ++counts_.sphere_pairs;
      return true;
    }
    if (!batch_.both_are_spheres(i)) return false;  // the shape was exchanged under the algorithm
    count_pair(contact);
    const unsigned traits = batch_.either_trait(i);
    if ((traits & kActive) == 0) return true;
    if ((traits & kSpecial) != 0 || manifold->getBody0() != batch_.body_a(i)) return false;
    if (contact != nullptr && !has_stocks_bits(*contact)) return false;
    if ((traits & kPicky) != 0 && !needs_collision(i)) return true;
    ++counts_.written;
    manifold->setNumContacts(0);  // btPersistentManifold::clearManifold without callbacks
    if (contact == nullptr) return true;
    write_contact(manifold, *contact, batch_.state_a(i), batch_.state_b(i), batch_.radius_b(i));
    return true;
  }

  /// Qualified: nobody has overridden it.
  bool needs_collision(std::size_t i) const {
    return dispatcher_.btCollisionDispatcher::needsCollision(batch_.body_a(i), batch_.body_b(i));
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
    if ((batch_.either_trait(i) & kPicky) != 0 && !needs_collision(i)) return true;
    if (!update(batch_.manifold(i), *a, *b, sphere_first)) return false;
    ++*count;
    return true;
  }

  void count_pair(const PairContact* contact) {
    ++counts_.sphere_pairs;
    counts_.touching += contact != nullptr ? 1 : 0;
  }

  btCollisionDispatcher& dispatcher_;
  const SphereBatch& batch_;
  const PairContact *next_, *last_;
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
                              std::span<const PairContact> touching, x86::ThreadPool& pool) {
  const std::size_t n = batch.pairs().size();
  pool.run(chunks_.size(), [&](std::size_t chunk) {
    const std::size_t begin = chunk * kPairChunk;
    Committer committer(dispatcher, batch, touching, begin, std::min(n, begin + kPairChunk));
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
