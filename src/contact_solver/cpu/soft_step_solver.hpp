/// Sweeps of the soft step over the contacts of all colors.
#pragma once

#include <jfpx/material.hpp>

#include "src/base/thread_pool.hpp"
#include "src/contact_solver/contact_set.hpp"
#include "src/contact_solver/greedy_coloring.hpp"
#include "src/contact_solver/manifold_row.hpp"
#include "src/contact_solver/sphere_row.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Properties of the bodies, by body, at the start of a step.
struct BodyProperties {
  std::span<const Mat3> inverse_inertia;  ///< [1/(kg m^2)], world axes
  std::span<const Vec3> acceleration;     ///< [m/s^2], of this step
  std::span<const Real> radius;           ///< [m]; 0: not a sphere
  std::span<const std::uint8_t> awake;    ///< of an immovable body: 0; kinematic: 1 if it moves
  std::span<const Real> friction, restitution;
  std::span<const Real> rolling_friction, spinning_friction;  ///< [m]
  MaterialSettings rules;
  Real restitution_threshold = 0;  ///< [m/s]
};

/// Solves contacts in this order: those without a color, one after the other; the colors in
/// ascending order; the contacts with immovable and kinematic bodies. Contacts of one color share
/// no movable body, so threads may solve them in any order, and so may contacts of different
/// movable bodies with fixed bodies.
///
/// Owns its buffers, which only grow. In a step: build(), then warm_start(), solve() and
/// restitute() as the integrator requires, then store().
class SoftStepSolver {
 public:
  /// @param pool outlives the solver
  explicit SoftStepSolver(ThreadPool* pool) : pool_(pool) {}

  /// Makes rows of the contacts that have an awake movable body.
  /// @param contacts   are not changed until store()
  /// @param properties its arrays are valid until store()
  /// @param bodies     at the start of the step, before its accelerations
  void build(const ContactSet& contacts, const BodyProperties& properties,
             const StepConstants& constants, std::span<const SolverBody> bodies);
  /// Applies the impulses of the last step.
  void warm_start(std::span<SolverBody> bodies);
  /// One sweep over all contacts. @param soft whether penetrations are pushed out
  void solve(std::span<SolverBody> bodies, bool soft);
  /// Makes the bodies of impacts rebound.
  void restitute(std::span<SolverBody> bodies);
  /// Writes the impulses to the contacts that build() received.
  void store(ContactSet* contacts);

 private:
  /// Groups of rows: without a color, the colors, with a fixed body.
  static constexpr std::size_t kGroups = kColors + 2, kFixedGroup = kGroups - 1;
  /// Rows of one kind, sorted by group. @param Row SphereRow or ManifoldRow
  template <class Row>
  struct Rows {
    std::vector<Row> rows;
    std::vector<std::uint32_t> contacts;  ///< by row
    std::array<std::uint32_t, kGroups + 1> begin{};
  };
  /// A contact with a fixed body.
  struct FixedContact {
    std::uint32_t body = 0;  ///< the movable one
    std::uint32_t contact = 0;
    std::uint32_t row = 0;
    bool is_sphere_row = false;
  };
  /// Numbers of rows by group, of a chunk of contacts.
  struct Counts {
    std::array<std::uint32_t, kGroups> spheres{}, manifolds{};
    std::uint32_t fixed = 0;
  };
  enum class Kind : std::uint8_t { asleep, sphere_row, manifold_row };

  Kind kind_of(std::uint32_t contact) const;
  bool is_flipped(const ContactKey& key) const;
  bool is_round(std::uint32_t body) const;
  std::size_t group_of(std::uint32_t contact) const;
  void sort_contacts();
  void count_contacts();
  void place_contacts(std::uint32_t first, std::uint32_t last, Counts before);
  void place_fixed_contacts();
  template <bool kFixed>
  void fill(SphereRow* row, std::uint32_t contact) const;
  template <bool kFixed>
  void fill(ManifoldRow* row, std::uint32_t contact);
  Real rebound_speed(const Vec3& velocity, const Vec3& normal, Real distance, std::uint32_t a,
                     std::uint32_t b, Real restitution) const;
  template <class Operation>
  void sweep(const Operation& operation);
  BodyPair pair_of(const ManifoldRow& row, std::span<SolverBody> bodies) const;

  ThreadPool* pool_;
  const ContactSet* contacts_ = nullptr;  ///< from build() to store()
  BodyProperties properties_;
  StepConstants constants_;
  std::span<const SolverBody> start_;  ///< during build()

  std::vector<Kind> kinds_;     ///< by contact
  std::vector<Counts> counts_;  ///< by chunk of contacts
  Rows<SphereRow> spheres_;
  Rows<ManifoldRow> manifolds_;
  std::vector<PointRow> points_;
  std::vector<FixedContact> fixed_;  ///< sorted by (body, contact)
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
