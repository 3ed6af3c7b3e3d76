/// Sweeps of the soft step over the contacts of all colors.
#pragma once

#include <jfpx/simd_level.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/cpu/grouped_rows.hpp"
#include "src/contact_solver/soft_step/cpu/sphere_sweep.hpp"
#include "src/contact_solver/soft_step/row_setup.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// Solves contacts and joints in this order: the overflow (rows without a free color), one after
/// the other; the colors in ascending order; rows with immovable or kinematic bodies or with the
/// world, by movable body, joints first. In the overflow, rows have the order of RowTypes. Rows of
/// one color share no movable body, so threads may solve them in any order. The same holds for rows
/// of different movable bodies with fixed bodies.
///
/// Owns its buffers, which grow and never shrink. In a step: build(), then warm_start(), solve()
/// and restitute() as the integrator requires, then store().
class SoftStepSolver {
 public:
  /// @param pool not null; outlives the solver
  /// @param simd widest vectors for rows of spheres
  SoftStepSolver(ThreadPool* pool, SimdLevel simd);

  /// Builds rows of the contacts and joints whose kind is not kNoRow. Below, "contact" is the
  /// number of a contact or joint; see RowSetup.
  /// @param setup     its arrays must be valid until store()
  /// @param bodies    number of bodies in these arrays
  void build(const RowSetup& setup, std::size_t bodies, const ImpactBodies& impacts,
             const StepConstants& constants);
  /// Applies the impulses of the last step.
  void warm_start(std::span<SolverBody> bodies);
  /// A sweep over all contacts. @param use_bias whether it is a bias sweep or a relax sweep
  void solve(std::span<SolverBody> bodies, bool use_bias);
  /// Applies restitution. Rows of spheres have already rebounded in solve().
  void restitute(std::span<SolverBody> bodies);
  /// Writes the impulses to the contacts that build() received.
  void store();

 private:
  /// The rows of a kind.
  template <class RowOfKind>
  struct Rows : GroupedRows<RowOfKind> {
    using Row = RowOfKind;
    using Part = typename Row::Part;
    Buffer<Part> parts;

    Part* parts_of(const Row& row) {
      if constexpr (kHasParts<Row>) {
        return &parts[row.first];
      } else {
        return nullptr;
      }
    }
  };
  template <class List>
  struct RowsOfTypes;
  template <class... Row>
  struct RowsOfTypes<std::tuple<Row...>> {
    using type = std::tuple<Rows<Row>...>;
  };
  /// A contact with a fixed body.
  struct FixedContact {
    std::uint32_t body = 0;  ///< the movable one
    std::uint32_t contact = 0;
    std::uint32_t row = 0;
    RowKind kind = kNoRow;
  };
  /// Numbers of rows of a chunk of contacts, by kind and group.
  struct Counts {
    std::array<GroupCounts, kRowKinds> by_kind{};
    std::uint32_t fixed = 0;
  };

  template <class Row>
  Rows<Row>& rows() {
    return std::get<Rows<Row>>(rows_);
  }
  /// Calls f(&rows<Row>()) for all kinds of rows.
  template <class F>
  void for_all_kinds(const F& f) {
    std::apply([&f](auto&... rows) { (f(&rows), ...); }, rows_);
  }

  void sort_contacts();
  void count_contacts();
  void place_contacts(std::uint32_t first, std::uint32_t last, Counts before);
  void place_fixed_contacts();
  void place_parts();
  /// Calls run(rows, first, last) for the rows of the overflow and of the colors, and
  /// on_fixed(rows, row) for each row with a fixed body. Overflow rows may share bodies and are
  /// passed one at a time. `rows` is a pointer to Rows.
  template <class Run, class OnFixed>
  void sweep(const Run& run, const OnFixed& on_fixed);
  /// Calls operation(rows, first, last, is_fixed) for ranges of all rows. `rows` is a pointer to
  /// Rows; `is_fixed` is std::true_type if body b is fixed and std::false_type otherwise. The rows
  /// of a block of bodies are consecutive, because their contacts are.
  template <class Operation>
  void for_all_rows(const Operation& operation);
  template <class Operation>
  void run(std::span<SolverBody> bodies, const Operation& operation,
           cpu::SphereSweepFunction kernel);
  cpu::SphereSweep arrays_of(std::span<SolverBody> bodies);

  ThreadPool* pool_;
  const cpu::SphereSweepKernels* kernels_;  ///< null: rows are solved one by one
  RowSetup setup_;                          ///< from build() to store()
  ImpactBodies impacts_;
  StepConstants constants_;
  std::size_t bodies_ = 0;  ///< number of bodies, including those of mass 0

  std::vector<RowKind> kinds_;  ///< by contact
  std::vector<Counts> counts_;  ///< by chunk of contacts
  RowsOfTypes<RowTypes>::type rows_;
  std::size_t colored_end_ = 0;      ///< end of the overflow and of the occurring colors, as groups
  std::vector<FixedContact> fixed_;  ///< sorted by (body, RowSetup::fixed_order())
  // Body b of a joint with the world.
  SolverBody world_;
  Mat3 world_inertia_;
  Quat world_orientation_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
