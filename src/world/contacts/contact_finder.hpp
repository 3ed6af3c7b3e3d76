/// Contact detection of a world: broad phase and pair tests of all shapes.
#pragma once

#include <jfpx/world.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/contact_set.hpp"
#include "src/ranks/domain.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/bodies/sub_shape_table.hpp"
#include "src/world/contacts/broad_phase_search.hpp"
#include "src/world/contacts/candidate_test.hpp"
#include "src/world/contacts/detected_contacts.hpp"
#include "src/world/contacts/fixed_trees.hpp"
#include "src/world/contacts/hidden_points.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// The broad phase tests all spheres and the bounding spheres of other solids of movable bodies. It
/// returns contacts of two spheres and candidate pairs with another solid. Other solids of bodies
/// of mass 0 (immovable or kinematic) are in trees, which each solid of a movable body traverses.
/// Walls are tested against every solid of a movable body. Contacts within one body, between two
/// bodies of mass 0, and of pairs that BodyStore::may_collide() excludes are discarded.
class ContactFinder {
 public:
  /// @param broad_phase not null
  /// @param simd widest vector instructions of the pair tests
  ContactFinder(std::unique_ptr<BroadPhaseSearch> broad_phase, SimdLevel simd);

  /// Must be called after a body was added or removed, or got another state by set_state().
  void set_bodies(const BodyStore& bodies);

  /// Limits the search to the bodies that are present, and to the contacts that this rank detects.
  /// Must be called before each search. @param domain null: a single rank
  void set_domain(const Domain* domain);

  /// Finds the contacts at the current poses and the speculative contacts: pairs that are closer
  /// than a margin, or whose velocities let them touch during the step. Contacts of two spheres
  /// precede all others; both are sorted by (a.index, b.index), then by the sub-shapes of a and of
  /// b. Contact defines which body is a. Friction and restitution are 0. The forces of the step
  /// must have been summed before.
  /// @param margin   [m], >= 0: SoftStepSettings::speculative_margin
  /// complete() must be called afterwards.
  /// @param recyclable contacts of the last step
  /// @param set      receives all pairs; contacts of two spheres sorted by key
  /// @param detected receives the contacts with distance <= 0 that are not in set->spheres
  /// @returns the number of contacts in set->spheres with distance <= 0
  /// @throws the exceptions of SphereCollider::find_pairs()
  std::size_t find_speculative_contacts(const BodyStore& bodies, Real margin, ThreadPool* pool,
                                        const soft_step::ContactSet& recyclable,
                                        soft_step::ContactSet* set, DetectedContacts* detected);

  /// Whether the next searches fill DetectedContacts::keys.
  void set_keeps_keys(bool keeps) noexcept { keeps_keys_ = keeps; }
  /// Marks that manifolds of the last search have no points any more: complete() removes them.
  void note_empty() noexcept { any_empty_ = true; }
  /// Removes hidden points and empty contacts of the last search, and sorts the manifolds by key.
  void complete(soft_step::ContactSet* set, ThreadPool* pool);

  /// With several ranks: the sub-shapes before SubShapeRanges::fixed_begin() of the bodies that are
  /// present, ascending.
  std::span<const SubShapeTable::SubShape> present() const noexcept { return present_; }
  /// With several ranks: the numbers of the contacts of two spheres of the last search whose body b
  /// is of another rank, ascending.
  std::span<const std::uint32_t> crossing_spheres() const noexcept { return crossing_spheres_; }

  SubShapeTable& sub_shapes() noexcept { return sub_shapes_; }
  /// The trees of the last search.
  FixedTreesView fixed_trees() const noexcept { return fixed_trees_.view(); }
  BroadPhaseSearch& broad_phase() noexcept { return *broad_phase_; }
  const SphereCollider& collider() const noexcept { return broad_phase_->collider(); }

  // Parts of a search among the current poses, without margin and motion.

  using SubShape = SubShapeTable::SubShape;
  /// Computes bounds of the sub-shapes at their current poses, for find_fixed_pairs(). The poses
  /// must be up to date.
  JFPX_API const SweptBounds& enclose_bounds(const BodyStore& bodies);
  /// Appends the pairs of a movable sub-shape and a wall or solid of mass 0 other than a sphere
  /// whose bounds touch; sorted for each sub-shape.
  /// @param first,last range of movable sub-shapes
  JFPX_API void find_fixed_pairs(SubShape first, SubShape last,
                                 std::vector<Candidate>* candidates) const;

 private:
  /// Results of a chunk of a parallel loop.
  /// Aligned, because threads change parts that are next to each other.
  struct alignas(128) Part {
    std::vector<soft_step::SphereContactInput> spheres;
    std::vector<soft_step::ManifoldInput> manifolds;
    std::vector<soft_step::PointInput> points;
    std::size_t touching_spheres = 0;         ///< contacts in `spheres` with distance <= 0
    std::vector<Contact> touches;             ///< other contacts with distance <= 0
    std::vector<soft_step::ContactKey> keys;  ///< of `touches`, if they are kept
    std::vector<Candidate> candidates, compounds;
    std::vector<std::uint32_t> crossing;  ///< with several ranks: numbers in `spheres`
    /// A contact of a body, and its hidden points (bit i: point i).
    struct Surface {
      SurfaceContact contact;
      soft_step::ManifoldInput* manifold = nullptr;
      std::uint32_t hidden = 0;
    };
    std::vector<Surface> surfaces;
    bool any_hidden = false;
    std::array<std::size_t, 6> places{};  ///< of its lists, where they are appended
    void add(const BodyStore& bodies, const CandidateManifold& found, bool keeps_keys);
    void clear() {
      spheres.clear();
      crossing.clear();
      manifolds.clear();
      points.clear();
      touching_spheres = 0;
      touches.clear();
      keys.clear();
      candidates.clear();
      compounds.clear();
      any_hidden = false;
    }
  };
  void start_bounds(const BodyStore& bodies, Real margin);
  template <class Sweep>
  void sweep_fixed(const Sweep& sweep);
  void sweep_bounds(const BodyStore& bodies, Real margin, ThreadPool* pool);
  void test_sphere_pairs(const BodyStore& bodies, std::span<const SpherePair> pairs,
                         Part* part) const;
  struct Results;
  void test_candidates(const BodyStore& bodies, std::span<const Candidate> candidates,
                       const soft_step::ContactSet& recyclable, Results* results, ThreadPool* pool);
  bool hide_points_of_body(std::span<soft_step::ManifoldInput> run, soft_step::PointInput* points,
                           Part* part) const;
  void hide_points(soft_step::ContactSet* set, ThreadPool* pool);
  void remove_empty(soft_step::ContactSet* set);
  template <class Find, class AppendAll>
  void for_each_batch(ThreadPool* pool, std::size_t count, std::size_t chunk, const Find& find,
                      const AppendAll& append_all);

  bool detects(std::uint32_t a, std::uint32_t b) const {
    return domain_ == nullptr || domain_->detects(a, b);
  }
  std::span<const SphereInstance> present_bounds(ThreadPool* pool);

  std::unique_ptr<BroadPhaseSearch> broad_phase_;
  const Domain* domain_ = nullptr;
  // With several ranks:
  std::uint64_t domain_version_ = 0;            ///< that of present_; 0: none
  std::vector<SubShape> present_;               ///< sub-shapes before fixed_begin(), ascending
  std::vector<SphereInstance> present_bounds_;  ///< swept bounds of present_
  std::vector<std::uint32_t> crossing_spheres_;
  const cpu::HullKernels* hull_kernels_;
  SubShapeTable sub_shapes_;
  std::vector<Candidate> candidates_, merged_candidates_;
  FixedTrees fixed_trees_;
  bool fixed_changed_ = true;          ///< whether solids of mass 0 need new bounds
  std::vector<Vec3> motion_;           ///< by body [m]
  std::vector<SphereInstance> swept_;  ///< by solid: bounds of the step's motion
  std::vector<Real> margins_;          ///< by solid [m]
  std::vector<Aabb> boxes_;            ///< SweptBounds::boxes
  SweptBounds swept_bounds_;           ///< of the arrays above, during a search
  // Of find_speculative_contacts():
  std::vector<Candidate> compounds_;  ///< pairs of spheres, at least one of a compound
  std::vector<Part> parts_;
  std::vector<Contact> merged_;                     ///< copy of the contacts of compounds
  std::vector<soft_step::ContactKey> merged_keys_;  ///< copy of their keys
  bool keeps_keys_ = false;
  std::size_t first_of_candidates_ = 0;  ///< first manifold of candidates_
  bool any_empty_ = false;               ///< whether a manifold has lost points
};

}  // namespace JFPX_ABI
}  // namespace jfpx
