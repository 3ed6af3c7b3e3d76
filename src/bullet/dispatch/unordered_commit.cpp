/// Processes the pairs of spheres first, in two passes per chunk: a scan of the numbers of contact
/// points, which completes most pairs, and a visit of the remaining pairs. Then processes the
/// remaining convex pairs in small chunks, because they take a hundred times as long.
#include "src/bullet/dispatch/unordered_commit.hpp"

#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <cstring>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Number of pairs per chunk of the loop over convex pairs; a pair takes about a microsecond.
constexpr std::size_t kConvexChunk = 64;
constexpr std::size_t kConvexAhead = 4;
/// Minimum number of pairs for several threads: below, waking threads takes longer.
constexpr std::size_t kSharedConvexPairs = 512;

/// Commits the pairs of spheres among the pairs [begin, end).
class Committer {
 public:
  /// @param touching contacts of all pairs, not only of this range
  /// @param scratch,remaining memory for as many pairs as are in the range
  Committer(btCollisionDispatcher& dispatcher, const SphereBatch& batch,
            std::span<const PairContact> touching, std::size_t begin, std::size_t end,
            std::uint32_t* scratch, std::uint32_t* remaining)
      : dispatcher_(dispatcher),
        batch_(batch),
        next_(first_contact(touching, begin)),
        last_(touching.data() + touching.size()),
        begin_(begin),
        end_(end),
        found_(scratch),
        remaining_(remaining) {}

  /// Writes the pairs that Bullet must process to `remaining` and returns their number.
  std::size_t run() {
    // At most as many pairs remain as have been visited, so both lists share their memory.
    const std::span<const std::uint32_t> visits = find_visits();
    counts_.sphere_pairs += end_ - begin_ - visits.size();
    std::size_t count = 0;
    for (std::size_t k = 0; k < std::min(visits.size(), kVisitsAhead); ++k)
      prefetch_commit(visits[k]);
    for (std::size_t k = 0; k < visits.size(); ++k) {
      if (k + kVisitsAhead < visits.size()) prefetch_commit(visits[k + kVisitsAhead]);
      const std::uint32_t i = visits[k];
      while (next_ != last_ && next_->pair < i) ++next_;  // pairs that are not active
      const bool touches = next_ != last_ && next_->pair == i;
      if (!commit(i, touches ? next_++ : nullptr)) remaining_[count++] = i;
    }
    return count;
  }
  const CommitCounts& counts() const { return counts_; }

 private:
  /// Reading a count takes about 1 ns, a cache miss about 100 ns.
  static constexpr std::size_t kCountsAhead = 128;
  /// A visit takes longer and reads a dozen cache lines.
  static constexpr std::size_t kVisitsAhead = 10;

  /// The pairs that need a visit: sphere pairs that touch or have points, and all other pairs. The
  /// number of points must be read for every sphere pair of an active body, because Bullet also
  /// clears points that a user has added. The loop does nothing else, so that it is limited only by
  /// memory.
  std::span<const std::uint32_t> find_visits() {
    std::size_t count = 0;
    for (std::size_t i = begin_; i < std::min(end_, begin_ + kCountsAhead); ++i)
      prefetch_point_count(i);
    for (std::size_t i = begin_; i < end_; ++i) {
      if (i + kCountsAhead < end_) prefetch_point_count(i + kCountsAhead);
      found_[count] = static_cast<std::uint32_t>(i);
      const bool is_empty = batch_.kind(i) == PairKind::spheres &&
                            (!is_active(i) || batch_.manifold(i)->getNumContacts() == 0);
      count += is_empty ? 0 : 1;
    }
    return with_touching({found_, count});
  }
  /// The union of two ascending lists: `found`, and the active touching pairs of this range.
  std::span<const std::uint32_t> with_touching(std::span<const std::uint32_t> found) {
    std::uint32_t* out = remaining_;
    const PairContact* touching = next_;
    const PairContact* const end = first_contact({next_, last_}, end_);
    const auto add_touching = [&] {
      const std::uint32_t i = touching++->pair;
      if (is_active(i)) {
        *out++ = i;
      } else if (batch_.both_are_spheres(i)) {
        ++counts_.touching;
      }
    };
    for (const std::uint32_t i : found) {
      while (touching != end && touching->pair < i) add_touching();
      if (touching != end && touching->pair == i) ++touching;
      *out++ = i;
    }
    while (touching != end) add_touching();
    return {remaining_, out};
  }
  /// Bullet does not process a pair of two inactive bodies.
  bool is_active(std::size_t i) const { return (batch_.either_trait(i) & kActive) != 0; }
  void prefetch_point_count(std::size_t i) const {
    if (batch_.kind(i) == PairKind::spheres && is_active(i)) prefetch_count(batch_.manifold(i));
  }
  void prefetch_commit(std::size_t i) const {
    if (batch_.kind(i) != PairKind::spheres) return;
    prefetch_header(batch_.manifold(i));
    prefetch_first_point(batch_.manifold(i));
    batch_.prefetch_states(i);
  }

  /// `contact` is null if the spheres do not touch. Returns false if Bullet must process the pair.
  bool commit(std::size_t i, const PairContact* contact) {
    if (batch_.kind(i) == PairKind::spheres) return commit_spheres(i, contact);
    if (batch_.kind(i) == PairKind::other && batch_.both_are_spheres(i)) count_pair(contact);
    return false;
  }

  bool commit_spheres(std::size_t i, const PairContact* contact) {
    btPersistentManifold* manifold = batch_.manifold(i);
    if (!batch_.both_are_spheres(i)) return false;  // the user has replaced a shape
    count_pair(contact);
    const unsigned traits = batch_.either_trait(i);
    if ((traits & kCustomMaterial) != 0 || manifold->getBody0() != batch_.body_a(i)) return false;
    if (contact != nullptr && !has_finite_values(*contact)) return false;
    if ((traits & kHasIgnoreList) != 0 && !needs_collision(i)) return true;
    ++counts_.written;
    manifold->setNumContacts(0);  // btPersistentManifold::clearManifold without callbacks
    if (contact == nullptr) return true;
    write_contact(manifold, *contact, batch_.state_a(i), batch_.state_b(i), batch_.radius_b(i));
    return true;
  }

  /// Calls the qualified function, because no class overrides it here.
  bool needs_collision(std::size_t i) const {
    return dispatcher_.btCollisionDispatcher::needsCollision(batch_.body_a(i), batch_.body_b(i));
  }

  void count_pair(const PairContact* contact) {
    ++counts_.sphere_pairs;
    counts_.touching += contact != nullptr ? 1 : 0;
  }

  btCollisionDispatcher& dispatcher_;
  const SphereBatch& batch_;
  const PairContact *next_, *last_;
  std::size_t begin_, end_;
  std::uint32_t *found_, *remaining_;
  CommitCounts counts_;
};

}  // namespace

OrderReason reason_for_order(const SphereBatch& batch, bool may_override_filter) {
  if (materials_are_combined_by_user()) return OrderReason::combine_callback;
  if (contacts_are_observed()) return OrderReason::contact_callback;
  if (gContactProcessedCallback != nullptr) return OrderReason::processed_callback;
  if (gContactAddedCallback != nullptr &&
      (batch.any_collision_flag() & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) != 0) {
    return OrderReason::added_callback;
  }
  const bool filtered = may_override_filter || (batch.any_trait() & kOverridesFilter) != 0;
  return filtered ? OrderReason::filter : OrderReason::none;
}

void UnorderedCommit::reserve(std::size_t pairs) {
  remaining_.resize(pairs);
  found_.resize(pairs);
  chunks_.resize((pairs + kConvexChunk - 1) / kConvexChunk);
}

CommitCounts UnorderedCommit::run(const ConvexDispatch& dispatch,
                                  std::span<const PairContact> touching, ThreadPool& pool) {
  CommitCounts counts = commit_spheres(dispatch, touching, pool);
  counts += commit_convex_pairs(dispatch, pool);
  return counts;
}

CommitCounts UnorderedCommit::commit_spheres(const ConvexDispatch& dispatch,
                                             std::span<const PairContact> touching,
                                             ThreadPool& pool) {
  const std::size_t n = dispatch.pairs.size();
  const std::size_t chunks = (n + kPairChunk - 1) / kPairChunk;
  pool.run(chunks, [&](std::size_t chunk) {
    const std::size_t begin = chunk * kPairChunk;
    Committer committer(dispatch.dispatcher, dispatch.batch, touching, begin,
                        std::min(n, begin + kPairChunk), &found_[begin], &remaining_[begin]);
    chunks_[chunk].remaining = committer.run();
    chunks_[chunk].counts = committer.counts();
  });
  return collect(chunks, kPairChunk);
}

CommitCounts UnorderedCommit::commit_convex_pairs(const ConvexDispatch& dispatch,
                                                  ThreadPool& pool) {
  const std::size_t n = remaining_count_;
  if (n == 0) return {};
  const std::size_t size = n < kSharedConvexPairs ? n : kConvexChunk;
  const std::size_t chunks = (n + size - 1) / size;
  pool.run(chunks, [&](std::size_t chunk) {
    const std::size_t begin = chunk * size, end = std::min(n, begin + size);
    Chunk part;
    for (std::size_t k = begin; k < end; ++k) {
      if (k + 2 * kConvexAhead < end)
        prefetch_algorithm(dispatch, remaining_[k + 2 * kConvexAhead]);
      if (k + kConvexAhead < end) prefetch_convex(dispatch, remaining_[k + kConvexAhead]);
      const std::uint32_t i = remaining_[k];
      if (!commit_convex(dispatch, i, &part.counts)) remaining_[begin + part.remaining++] = i;
    }
    chunks_[chunk] = part;
  });
  return collect(chunks, size);
}

/// Joins the lists of the chunks, and returns the sum of their counts.
CommitCounts UnorderedCommit::collect(std::size_t chunks, std::size_t chunk_size) {
  CommitCounts sum;
  remaining_count_ = 0;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const Chunk& part = chunks_[chunk];
    std::memmove(&remaining_[remaining_count_], &remaining_[chunk * chunk_size],
                 part.remaining * sizeof(std::uint32_t));
    remaining_count_ += part.remaining;
    sum += part.counts;
  }
  return sum;
}

void UnorderedCommit::sort(std::span<std::uint32_t> numbers,
                           std::span<const btBroadphasePair> pairs, bool deterministic) {
  if (!deterministic) return;  // already ascending, which is the order of the array
  const auto ids = [&](std::uint32_t i) {
    return std::pair(pairs[i].m_pProxy0->m_uniqueId, pairs[i].m_pProxy1->m_uniqueId);
  };
  std::sort(numbers.begin(), numbers.end(),
            [&](std::uint32_t p, std::uint32_t q) { return ids(p) > ids(q); });
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
