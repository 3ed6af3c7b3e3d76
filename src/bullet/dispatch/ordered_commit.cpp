/// Traversal of the pairs in Bullet's order.
#include "src/bullet/dispatch/ordered_commit.hpp"

#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/prefetch.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

class OrderedCommit::Walk final : public btOverlapCallback {
 public:
  Walk(const OrderedCommit& commit, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info,
       const SphereBatch& batch, std::span<const btBroadphasePair> pairs,
       std::span<const PairContact> touching, const Visited& visited)
      : actions_(commit.actions_),
        contacts_(commit.contacts_),
        dispatcher_(dispatcher),
        info_(info),
        batch_(batch),
        pairs_(pairs),
        touching_(touching),
        visited_(visited) {}

  bool processOverlap(btBroadphasePair& pair) override {
    const std::size_t i = (reinterpret_cast<std::uintptr_t>(&pair) -
                           reinterpret_cast<std::uintptr_t>(pairs_.data())) /
                          sizeof(btBroadphasePair);
    if (i >= pairs_.size()) {  // added by a callback during this traversal
      visit_stock(pair);
      return false;
    }
    prefetch_commit(i + kAhead);
    const bool current = visit(i, pair);
    if (visited_ && batch_.kind(i) == PairKind::spheres && batch_.both_are_spheres(i)) {
      visited_(i, current);
    }
    return false;
  }
  std::uint64_t written() const { return written_; }

 private:
  /// Prefetch distance: hides memory latency, and the prefetched lines stay in the cache.
  static constexpr std::size_t kAhead = 12;

  void prefetch_commit(std::size_t i) const {
    if (i >= pairs_.size() || actions_[i] != Action::commit) return;
    prefetch_header(batch_.manifold(i));
    prefetch_first_point(batch_.manifold(i));
    prefetch_for_contact(*batch_.body_a(i));
    prefetch_for_contact(*batch_.body_b(i));
  }

  static bool is_plain(const btPersistentManifold& manifold, const btCollisionObject& a,
                       const btCollisionObject& b) {
    const int flags = a.getCollisionFlags() | b.getCollisionFlags();
    return (flags & special_collision_flags()) == 0 && manifold.getBody0() == &a;
  }

  void visit_stock(btBroadphasePair& pair) const {
    (*dispatcher_.getNearCallback())(pair, dispatcher_, info_);
  }

  bool visit(std::size_t i, btBroadphasePair& pair) {
    // A callback may set a near callback during the traversal.
    if (dispatcher_.getNearCallback() != &btCollisionDispatcher::defaultNearCallback) {
      visit_stock(pair);
      return false;
    }
    const btCollisionObject *a = batch_.body_a(i), *b = batch_.body_b(i);
    switch (actions_[i]) {
      case Action::stock:
        visit_stock(pair);
        return true;
      case Action::skip:
        return true;
      case Action::filter:
        dispatcher_.needsCollision(a, b);
        return true;
      case Action::commit:
        break;
    }
    btPersistentManifold* manifold = batch_.manifold(i);
    // Evaluated for every contact, because a callback may set another callback.
    const PairContact* contact = contacts_[i] != kNone ? &touching_[contacts_[i]] : nullptr;
    const bool is_not_finite = contact != nullptr && !has_finite_values(*contact);
    if (contacts_are_observed() || is_not_finite || !is_plain(*manifold, *a, *b)) {
      visit_stock(pair);
      return false;  // the near callback calls the filter itself and does not return its result
    }
    if (!dispatcher_.needsCollision(a, b)) return false;
    ++written_;
    manifold->setNumContacts(0);
    // Reads the current materials, because callbacks may change those of their bodies.
    if (contact != nullptr) {
      write_contact(manifold, *contact, state_of(*a), state_of(*b), batch_.radius_b(i));
    }
    return true;
  }

  std::span<const Action> actions_;
  std::span<const std::uint32_t> contacts_;
  btCollisionDispatcher& dispatcher_;
  const btDispatcherInfo& info_;
  const SphereBatch& batch_;
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairContact> touching_;
  const Visited& visited_;
  std::uint64_t written_ = 0;
};

CommitCounts OrderedCommit::plan(const SphereBatch& batch, std::span<const PairContact> touching,
                                 bool may_override_filter) {
  constexpr std::size_t kAhead = 16;
  const std::size_t n = batch.pairs().size();
  actions_.assign(n, Action::stock);
  contacts_.assign(n, kNone);
  for (std::size_t k = 0; k < touching.size(); ++k) {
    contacts_[touching[k].pair] = static_cast<std::uint32_t>(k);
  }
  CommitCounts counts;
  for (std::size_t i = 0; i < n; ++i) {
    if (i + kAhead < n && batch.kind(i + kAhead) == PairKind::spheres) {
      prefetch_count(batch.manifold(i + kAhead));
    }
    if (!batch.both_are_spheres(i)) continue;
    ++counts.sphere_pairs;
    counts.touching += contacts_[i] != kNone ? 1 : 0;
    if (batch.kind(i) != PairKind::spheres) continue;
    if (contacts_[i] != kNone || batch.manifold(i)->getNumContacts() != 0) {
      actions_[i] = Action::commit;
    } else {
      const bool filtered = may_override_filter || (batch.either_trait(i) & kOverridesFilter) != 0;
      actions_[i] = filtered ? Action::filter : Action::skip;
    }
  }
  return counts;
}

std::uint64_t OrderedCommit::run(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                                 const btDispatcherInfo& info, btDispatcher* argument,
                                 const SphereBatch& batch, std::span<const btBroadphasePair> pairs,
                                 std::span<const PairContact> touching, const Visited& visited) {
  Walk walk(*this, dispatcher, info, batch, pairs, touching, visited);
  cache.processAllOverlappingPairs(&walk, argument, info);
  return walk.written();
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
