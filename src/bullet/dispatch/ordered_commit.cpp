/// Traversal of the pairs in Bullet's order.
#include "src/bullet/dispatch/ordered_commit.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

thread_local OrderedCommit::Walk* OrderedCommit::running_ = nullptr;
thread_local std::uint64_t OrderedCommit::default_calls_ = 0;
thread_local std::uint64_t OrderedCommit::stock_dispatches_ = 0;

class OrderedCommit::Walk final : public btOverlapCallback {
 public:
  Walk(const OrderedCommit& commit, btCollisionDispatcher& dispatcher,
       btOverlappingPairCache& cache, const btDispatcherInfo& info, const SphereBatch& batch,
       std::span<const btBroadphasePair> pairs, std::span<const PairContact> touching,
       const ConvexDispatch* convex, const Visited& visited)
      : actions_(commit.actions_),
        contacts_(commit.contacts_),
        dispatcher_(dispatcher),
        cache_(cache),
        info_(info),
        batch_(batch),
        pairs_(pairs),
        touching_(touching),
        convex_(convex),
        visited_(visited) {}

  bool processOverlap(btBroadphasePair& pair) override {
    const std::size_t i = index_of(pair);
    if (!has_current_entry(pair, i)) {
      visit_stock(pair);
      return false;
    }
    prefetch_visit(i + kAhead);
    if (i + kConvexAhead < pairs_.size() && actions_[i + kConvexAhead] == Action::stock) {
      if (convex_ != nullptr) prefetch_convex(*convex_, i + kConvexAhead);
    }
    const bool current = visit(i, pair);
    note_changes(i, pair);
    if (is_changed_) return false;
    if (visited_ && batch_.kind(i) == PairKind::spheres && batch_.both_are_spheres(i) &&
        batch_.has_current_spheres(i)) {
      visited_(i, current);
    }
    return false;
  }
  const CommitCounts& counts() const { return counts_; }

  /// Processes the pair for a near callback. Returns false if Bullet must process it.
  bool process_default(btBroadphasePair& pair, const btCollisionDispatcher& dispatcher,
                       const btDispatcherInfo& info) {
    const std::size_t i = index_of(pair);
    if (&dispatcher != &dispatcher_ || &info != &info_ || !has_current_entry(pair, i)) return false;
    note_changes(i, pair);  // by the near callback
    if (is_changed_ || (actions_[i] == Action::stock && convex_ == nullptr)) return false;
    visit_default(i, pair);
    return true;
  }

 private:
  /// Prefetch distance: hides memory latency, and the prefetched lines stay in the cache.
  static constexpr std::size_t kAhead = 12;
  static constexpr std::size_t kConvexAhead = 5;

  void prefetch_visit(std::size_t i) const {
    if (i >= pairs_.size()) return;
    switch (actions_[i]) {
      case Action::stock:
        if (convex_ != nullptr) prefetch_algorithm(*convex_, i);
        return;
      case Action::skip:
      case Action::filter:
        prefetch_count(batch_.manifold(i));
        prefetch_geometry(*batch_.body_a(i));
        prefetch_geometry(*batch_.body_b(i));
        return;
      case Action::commit:
        prefetch_header(batch_.manifold(i));
        prefetch_first_point(batch_.manifold(i));
        prefetch_for_contact(*batch_.body_a(i));
        prefetch_for_contact(*batch_.body_b(i));
    }
  }

  static bool is_plain(const btPersistentManifold& manifold, const btCollisionObject& a,
                       const btCollisionObject& b) {
    constexpr int kSpecial = btCollisionObject::CF_HAS_CONTACT_STIFFNESS_DAMPING |
                             btCollisionObject::CF_HAS_FRICTION_ANCHOR;
    const int flags = a.getCollisionFlags() | b.getCollisionFlags();
    return (flags & kSpecial) == 0 && manifold.getBody0() == &a;
  }
  static bool calls_added(const btCollisionObject& a, const btCollisionObject& b) {
    const int flags = a.getCollisionFlags() | b.getCollisionFlags();
    return gContactAddedCallback != nullptr &&
           (flags & btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK) != 0;
  }

  static bool is_observed(const btCollisionObject& a, const btCollisionObject& b) {
    return contacts_are_observed() || gContactProcessedCallback != nullptr || calls_added(a, b);
  }

  /// Notes whether user code has changed the pair cache. Bodies, which may have been removed, are
  /// not read.
  void note_changes(std::size_t i, const btBroadphasePair& pair) {
    // Bullet may have created the algorithm of the pair.
    is_changed_ = is_changed_ ||
                  static_cast<std::size_t>(cache_.getNumOverlappingPairs()) != pairs_.size() ||
                  !batch_.is_entry_of_proxies(pair, i);
  }

  std::size_t index_of(const btBroadphasePair& pair) const {
    return (reinterpret_cast<std::uintptr_t>(&pair) -
            reinterpret_cast<std::uintptr_t>(pairs_.data())) /
           sizeof(btBroadphasePair);
  }
  /// False if a callback has added, removed or moved the pair, has replaced its algorithm or
  /// changed the kind of the dispatch, or has run another dispatch: algorithms and manifolds may
  /// then be others at the same addresses.
  bool has_current_entry(const btBroadphasePair& pair, std::size_t i) const {
    return !is_changed_ && is_discrete() && stock_dispatches_ == stock_before_ &&
           i < pairs_.size() && batch_.is_entry_of(pair, i);
  }
  bool is_discrete() const { return info_.m_dispatchFunc == btDispatcherInfo::DISPATCH_DISCRETE; }

  void visit_stock(btBroadphasePair& pair) const {
    (*dispatcher_.getNearCallback())(pair, dispatcher_, info_);
  }
  /// The rest of btCollisionDispatcher::defaultNearCallback after needsCollision() is true.
  void run_algorithm(btBroadphasePair& pair, btCollisionObject& a, btCollisionObject& b) const {
    const btCollisionObjectWrapper wrapper_a = wrapper_of(a), wrapper_b = wrapper_of(b);
    if (pair.m_algorithm == nullptr) {
      pair.m_algorithm =
          dispatcher_.findAlgorithm(&wrapper_a, &wrapper_b, nullptr, BT_CONTACT_POINT_ALGORITHMS);
    }
    if (pair.m_algorithm == nullptr) return;
    btManifoldResult result(&wrapper_a, &wrapper_b);
    if (is_discrete()) {
      pair.m_algorithm->processCollision(&wrapper_a, &wrapper_b, info_, &result);
      return;
    }
    info_.m_timeOfImpact = std::min(
        info_.m_timeOfImpact, pair.m_algorithm->calculateTimeOfImpact(&a, &b, info_, &result));
  }

  /// Returns false if user code may have prevented or changed the update of a pair of spheres.
  bool visit(std::size_t i, btBroadphasePair& pair) {
    // A callback may set a near callback during the traversal.
    if ((actions_[i] == Action::stock && convex_ == nullptr) ||
        dispatcher_.getNearCallback() != &btCollisionDispatcher::defaultNearCallback) {
      visit_stock(pair);
      return false;
    }
    return visit_default(i, pair);
  }
  bool visit_default(std::size_t i, btBroadphasePair& pair) {
    const Action action = actions_[i];
    if (action == Action::skip && is_still_apart(i)) return true;
    // If a callback has replaced the bodies of a pair without an algorithm, the batch has others.
    auto& a = *static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject);
    auto& b = *static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject);
    if (!dispatcher_.needsCollision(&a, &b)) return action != Action::commit;
    note_changes(i, pair);
    if (!has_current_entry(pair, i)) {
      run_algorithm(pair, a, b);
      return false;
    }
    switch (action) {
      case Action::stock:
        if (!commit_other(i, pair, a, b)) run_algorithm(pair, a, b);
        return true;
      case Action::skip:
      case Action::filter:
        if (is_still_apart(i)) return true;
        run_algorithm(pair, a, b);
        return false;
      case Action::commit:
        break;
    }
    // Evaluated for every contact, because a callback may have changed it.
    const PairContact* contact = contacts_[i] != kNone ? &touching_[contacts_[i]] : nullptr;
    const bool is_not_finite = contact != nullptr && !has_finite_values(*contact);
    if (!batch_.has_current_spheres(i) || materials_are_combined_by_user() || is_not_finite ||
        !is_plain(*batch_.manifold(i), a, b)) {
      run_algorithm(pair, a, b);
      return false;
    }
    return commit_spheres(i, contact, a, b);
  }

  /// Whether two spheres that were apart, without a contact point, still are.
  bool is_still_apart(std::size_t i) const {
    return batch_.manifold(i)->getNumContacts() == 0 && batch_.has_current_spheres(i);
  }

  /// Updates a pair that is not two spheres. Returns false if Bullet's algorithm must run.
  bool commit_other(std::size_t i, const btBroadphasePair& pair, const btCollisionObject& a,
                    const btCollisionObject& b) {
    if (pair.m_algorithm == nullptr) return false;  // the batch may have other bodies
    if (!is_observed(a, b)) return commit_unobserved(*convex_, i, &counts_);
    if (!has_sphere(batch_, i)) return false;
    commit_in_order(*convex_, i, &counts_);
    return true;
  }

  /// Returns false if callbacks may have changed the point.
  bool commit_spheres(std::size_t i, const PairContact* contact, const btCollisionObject& a,
                      const btCollisionObject& b) {
    btPersistentManifold* manifold = batch_.manifold(i);
    ++counts_.written;
    if (!contacts_are_observed() && !calls_added(a, b)) {
      manifold->setNumContacts(0);
      // Reads the current materials, because callbacks may change those of their bodies.
      if (contact != nullptr) {
        write_contact(manifold, *contact, state_of(a), state_of(b), batch_.radius_b(i));
      }
      return true;
    }
    // Calls gContactDestroyedCallback and gContactEndedCallback. Like Bullet's algorithm, the rest
    // has the distance from before these calls, and all else from after them.
    const Real radius_b = batch_.radius_b(i);
    manifold->clearManifold();
    if (contact != nullptr) add_observed(manifold, *contact, a, b, radius_b);
    return false;
  }

  /// Adds the point of a touching pair to an empty manifold, and calls gContactAddedCallback and
  /// gContactStartedCallback.
  static void add_observed(btPersistentManifold* manifold, const PairContact& contact,
                           const btCollisionObject& a, const btCollisionObject& b, Real radius_b) {
    if (materials_are_combined_by_user() || !is_plain(*manifold, a, b)) {
      const btCollisionObjectWrapper wrapper_a = wrapper_of(a), wrapper_b = wrapper_of(b);
      btManifoldResult result(&wrapper_a, &wrapper_b);
      result.setPersistentManifold(manifold);
      const btVector3 normal(contact.normal.x, contact.normal.y, contact.normal.z);
      result.addContactPoint(normal, b.getWorldTransform().getOrigin() + radius_b * normal,
                             contact.distance);
      return;
    }
    write_contact(manifold, contact, state_of(a), state_of(b), radius_b);
    if (manifold->getNumContacts() == 0) return;  // farther than the breaking threshold
    if (calls_added(a, b)) {
      const btCollisionObjectWrapper wrapper_a = wrapper_of(a), wrapper_b = wrapper_of(b);
      btManifoldPoint& point = manifold->getContactPoint(0);
      gContactAddedCallback(point, &wrapper_a, point.m_partId0, point.m_index0, &wrapper_b,
                            point.m_partId1, point.m_index1);
    }
    if (gContactStartedCallback != nullptr) gContactStartedCallback(manifold);
  }

  std::span<const Action> actions_;
  std::span<const std::uint32_t> contacts_;
  btCollisionDispatcher& dispatcher_;
  btOverlappingPairCache& cache_;
  const btDispatcherInfo& info_;
  const SphereBatch& batch_;
  std::span<const btBroadphasePair> pairs_;
  std::span<const PairContact> touching_;
  const ConvexDispatch* convex_;
  const Visited& visited_;
  CommitCounts counts_;
  bool is_changed_ = false;  ///< Bullet processes all remaining pairs
  std::uint64_t stock_before_ = stock_dispatches_;
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

void OrderedCommit::process_default(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                                    const btDispatcherInfo& info) {
  ++default_calls_;
  if (running_ != nullptr && running_->process_default(pair, dispatcher, info)) return;
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

CommitCounts OrderedCommit::run(btCollisionDispatcher& dispatcher, btOverlappingPairCache& cache,
                                const btDispatcherInfo& info, btDispatcher* argument,
                                const SphereBatch& batch, std::span<const btBroadphasePair> pairs,
                                std::span<const PairContact> touching, const ConvexDispatch* convex,
                                const Visited& visited) {
  Walk walk(*this, dispatcher, cache, info, batch, pairs, touching, convex, visited);
  struct Restore {
    ~Restore() { running_ = before; }
    Walk* before;
  };
  const Restore restore{std::exchange(running_, &walk)};  // also if a callback throws
  cache.processAllOverlappingPairs(&walk, argument, info);
  return walk.counts();
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
