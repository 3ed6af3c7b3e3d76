/// Sweeps of the soft step on the CPU.
#pragma once

#include <jfpx/simd_level.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_pool.hpp"
#include "src/contact_solver/soft_step/cpu/body_blocks.hpp"
#include "src/contact_solver/soft_step/cpu/body_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/frame_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/manifold_sweep.hpp"
#include "src/contact_solver/soft_step/cpu/row_table.hpp"
#include "src/contact_solver/soft_step/cpu/sphere_sweep.hpp"
#include "src/contact_solver/soft_step/row_setup.hpp"
#include "src/ranks/domain.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// A sweep over all rows.
enum class Sweep : std::uint8_t {
  warm_start,    ///< applies the impulses of the last step
  first_joints,  ///< bias sweep over the rows of joints only, the first one of a substep
  joints,        ///< another one
  bias,
  relax,
  /// Of manifolds; rows of spheres rebound in the bias and relax sweeps. The last sweep of a step.
  restitution
};

/// Solves contacts and joints in this order: the overflow (rows without a free color), one after
/// the other; the inner rows, by color; the crossing rows, by color; rows with immovable or
/// kinematic bodies or with the world, by movable body, joints first. In the overflow, rows have
/// the order of RowTypes. Rows of one color share no movable body, and inner rows of different
/// blocks neither, so threads and vectors may solve them in any order. The same holds for rows of
/// different movable bodies with fixed bodies: first the first row of each body, then the second
/// ones.
///
/// Contacts are divided into parts by their body a: blocks, or ranges of bodies in a world of one
/// block. A thread solves all inner rows of a block, so that the bodies stay in the cache of a
/// core. Threads share the colors of crossing rows, and those of a world of one block, by parts: in
/// all colors, a thread has the rows of contacts and joints of about the same bodies.
///
/// Owns its buffers, which grow and never shrink. In a step: build(), then sweep() as the
/// integrator requires, then store().
class SoftStepSolver {
 public:
  /// @param pool not null; outlives the solver
  /// @param simd widest vectors for rows of contacts
  SoftStepSolver(ThreadPool* pool, SimdLevel simd);

  /// Null if bodies are taken one by one.
  const cpu::BodySweepKernels* body_kernels() const;

  /// Builds rows of the contacts and joints whose kind is not kNoRow. Below, "contact" is the
  /// number of a contact or joint; see RowSetup.
  /// @param setup  its arrays must be valid until store()
  /// @param bodies by index; must be valid until the last sweep
  /// @param places by index
  /// @param mobile indices of the bodies that are not immovable, ascending
  /// @param has_blocks whether the world has several blocks; otherwise threads share the colors
  /// @param domain null: a single rank. Otherwise, a row of bodies of two ranks is solved by both:
  ///   before each color with such rows, the ranks exchange their bodies. The bodies of a block
  ///   have one owner.
  void build(const RowSetup& setup, std::span<SolverBody> bodies,
             std::span<const std::uint32_t> mobile, std::span<const std::uint32_t> places,
             bool has_blocks, const ImpactBodies& impacts, const StepConstants& constants,
             Domain* domain = nullptr);
  /// With several ranks, rank 0 solves the overflow, and has one of the bodies of each of its rows.
  /// @returns after build(): bodies that rank 0 must own. If any rank has some, the step must be
  ///   repeated with other owners.
  std::span<const std::uint32_t> stray() const { return stray_; }
  /// A sweep over all rows.
  void sweep(Sweep sweep);
  /// Whether a restitution sweep has an effect.
  bool needs_restitution() const { return any_rebound_.load(std::memory_order_relaxed); }
  /// Writes the impulses to the contacts that build() received.
  void store();

 private:
  /// Numbers of rows and of their points: counts, or the next ones.
  struct Place {
    std::uint32_t row = 0, point = 0;
  };
  /// Whether rows are solved in bundles.
  template <class Row>
  static constexpr bool kHasBundles =
      std::is_same_v<Row, ManifoldRow> || std::is_same_v<Row, FrameRow>;
  /// The rows of a kind.
  template <class RowOfKind>
  struct Rows {
    using Row = RowOfKind;
    using Part = typename Row::Part;
    RowTable table;
    Buffer<Row> rows;
    Buffer<std::uint32_t> contacts;  ///< by row
    Buffer<Part> parts;
    RowTable part_table;  ///< of `parts`, with the cells of `table`

    void start(const RowTable::Shape& shape) {
      table.start(shape, kHasBundles<Row> ? cpu::kBundle : 1);
      if constexpr (kHasParts<Row>) part_table.start(shape);
    }
    void set_size(std::size_t cell, const Place& count) {
      table.set_size(cell, count.row);
      if constexpr (kHasParts<Row>) part_table.set_size(cell, count.point);
    }
    Place begin(std::size_t cell) const {
      return {table.begin(cell), kHasParts<Row> ? part_table.begin(cell) : 0};
    }
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
  /// A contact with a fixed body, or in the overflow.
  struct ListedContact {
    std::uint32_t body = 0;  ///< the movable one
    std::uint32_t contact = 0;
    std::uint32_t row = 0;
    std::uint32_t rank = 0;  ///< number of earlier contacts of the body with fixed bodies
    RowKind kind = kNoRow;
  };
  /// A joint of two movable bodies.
  struct PartJoint {
    std::uint32_t part = 0;     ///< of body a
    std::uint32_t contact = 0;  ///< its number
    friend auto operator<=>(const PartJoint&, const PartJoint&) = default;
  };
  /// Bodies in the rows of a color, or of the overflow, that connect bodies of two ranks.
  struct Border {
    BodyLists mine, foreign;
    void clear(std::size_t ranks) {
      mine.clear(ranks);
      foreign.clear(ranks);
    }
  };
  struct Cursors;

  template <class Row>
  Rows<Row>& rows() {
    return std::get<Rows<Row>>(rows_);
  }
  template <class Row>
  const Rows<Row>& rows() const {
    return std::get<Rows<Row>>(rows_);
  }
  /// Calls f(&rows<Row>()) for all kinds of rows.
  template <class F>
  void for_all_kinds(const F& f) {
    std::apply([&f](auto&... rows) { (f(&rows), ...); }, rows_);
  }
  template <class F>
  void for_all_kinds(const F& f) const {
    std::apply([&f](const auto&... rows) { (f(&rows), ...); }, rows_);
  }

  void inspect_contacts();
  void find_borders();
  void add_to_border(Border* border, const ContactKey& key) const;
  void find_overflow_border();
  void store_overflow();
  void exchange(std::size_t color, Sweep sweep);
  bool exchanges(std::size_t color, Sweep sweep) const;
  template <class Contact>
  void find_ranges(const Contact* contacts, std::uint32_t count,
                   std::vector<std::uint32_t>* ranges);
  void list_joints();
  void group_fixed();
  void count_rows(std::size_t part);
  void count_fixed_rows(std::size_t part);
  void allocate_rows();
  void place_rows(std::size_t part);
  void place_fixed_rows(std::size_t part);
  void place_overflow();
  template <bool kFixed>
  std::uint32_t fill(RowKind kind, std::uint32_t contact, Place* place);
  void count(std::uint32_t contact, Place* place) const;
  template <class F>
  void for_parts(std::size_t parts, const F& f);
  void prefetch_contacts(std::uint32_t body) const;
  template <class F>
  void for_contacts(std::size_t part, const F& f) const;
  /// Number of bodies in parts of a world of one block: those of this rank.
  std::size_t count_bodies() const {
    return domain_ == nullptr ? bodies_.size() : domain_->mine().size();
  }
  /// The number of a body among these; of a ghost, that of the next one.
  std::uint32_t number_of(std::uint32_t body) const {
    return domain_ == nullptr ? body : domain_->count_before(body);
  }
  std::uint32_t part_of(std::uint32_t body) const;
  std::uint32_t fixed_part_of(std::uint32_t body) const;
  std::span<ListedContact> fixed_of(std::size_t part) {
    return std::span(fixed_).subspan(fixed_begin_[part],
                                     fixed_begin_[part + 1] - fixed_begin_[part]);
  }

  /// Whether the rows of a color belong to a block.
  bool is_of_block(std::uint32_t color) const { return has_blocks_ && is_inner_color(color); }
  template <class F>
  void with_operation(Sweep sweep, const F& f);
  template <class Row, bool kFixed>
  std::size_t run_kernel(Sweep sweep, std::size_t first, std::size_t last, std::uint32_t* left);
  template <class Row, class Operation>
  void run_row(Rows<Row>* rows, std::size_t row, const Operation& operation, auto is_fixed);
  template <bool kFixed, class Row, class Operation>
  void run_rows(Rows<Row>* rows, std::size_t first, std::size_t last, Sweep sweep,
                const Operation& operation);
  /// Rows that are independent of each other, or that one thread solves.
  struct Phase {
    enum Kind : std::uint8_t { inner, crossing, fixed } kind;
    std::size_t first_color, last_color;  ///< of crossing rows
    std::size_t chunks;
    bool exchanges = false;  ///< whether ranks exchange bodies before the phase
  };
  template <class Operation>
  void sweep_fixed(std::size_t part, Sweep sweep, const Operation& operation);
  template <class Operation>
  void sweep_inner(std::size_t block, Sweep sweep, const Operation& operation);
  std::size_t chunks_of_color(std::size_t color, Sweep sweep) const;
  template <class Operation>
  void sweep_crossing(std::size_t color, std::size_t chunk, std::size_t chunks, Sweep sweep,
                      const Operation& operation);
  void find_phases(Sweep sweep);
  void sweep_overflow(Sweep sweep);
  void solve_overflow(Sweep sweep);
  template <class F>
  static void for_fixed_and_others(const RowTable& table, std::size_t first, std::size_t last,
                                   const F& f);
  cpu::ManifoldSetup manifold_setup();
  void complete_manifolds();
  template <class Row>
  static std::size_t row_chunk(std::size_t rows);
  void unpack(Rows<ManifoldRow>* rows, std::size_t first, std::size_t last);
  void unpack_manifolds();
  void keep_bundle(std::size_t bundle);
  void store(Rows<ManifoldRow>* rows, std::size_t first, std::size_t last);
  void store(Rows<FrameRow>* rows, std::size_t first, std::size_t last);
  template <class Row>
  void store(Rows<Row>* rows, std::size_t first, std::size_t last);
  cpu::SphereSweep sphere_sweep();
  cpu::ManifoldSweep manifold_sweep(bool is_fixed);
  void pack_bundle(const cpu::FrameSweep& sweep, std::size_t bundle);
  void pack_frames();
  void unpack(Rows<FrameRow>* rows, std::size_t first, std::size_t last);
  cpu::FrameSweep frame_sweep();

  ThreadPool* pool_;
  bool uses_avx2_;  ///< otherwise rows are solved one by one
  RowSetup setup_;  ///< from build() to store()
  ImpactBodies impacts_;
  StepConstants constants_;
  std::span<SolverBody> bodies_;
  BodyBlocks blocks_;
  bool has_blocks_ = false;
  unsigned part_bits_ = 0;  ///< binary logarithm of the bodies of a part, in a world of one block

  std::vector<RowKind> kinds_;                                ///< by contact
  std::vector<std::uint32_t> first_sphere_, first_manifold_;  ///< by body a, and the end
  std::vector<PartJoint> joints_;                             ///< sorted
  std::vector<ListedContact> fixed_;        ///< by part, then by (body, RowSetup::fixed_order())
  std::vector<std::uint32_t> fixed_begin_;  ///< by part, and the end
  std::vector<ListedContact> overflow_;     ///< sorted by (kind, contact)
  std::vector<ListedContact> listed_;       ///< unsorted
  RowTable::Shape shape_;
  // With several ranks:
  Domain* domain_ = nullptr;
  std::vector<std::uint32_t> crossing_contacts_;  ///< that connect bodies of two ranks, ascending
  std::vector<Border> borders_, joint_borders_;   ///< by color: of all rows, and of joints
  std::uint64_t border_colors_ = 0, joint_border_colors_ = 0;  ///< those of any rank, as bits
  bool any_overflow_ = false;                                  ///< on any rank
  Border overflow_border_;
  std::vector<std::uint32_t> stray_;
  std::vector<Phase> phases_;              ///< of a sweep
  std::atomic<bool> any_rebound_ = false;  ///< whether a restitution sweep has an effect
  RowsOfTypes<RowTypes>::type rows_;
  // Of rows of manifolds, if they are solved in vectors.
  std::vector<std::uint32_t> first_point_;  ///< see cpu::ManifoldBundles
  Buffer<cpu::BundleNumbers> bundle_numbers_;
  Buffer<Real> bundle_rows_, bundle_points_, bundle_shares_;
  bool is_packed_ = false;  ///< whether the impulses of the rows are in the bundles
  // Of rows of joints with frames, likewise.
  Buffer<cpu::FrameNumbers> frame_numbers_;
  Buffer<Real> frame_bundles_;
  // Body b of a joint with the world.
  SolverBody world_;
  Mat3 world_inertia_;
  Quat world_orientation_;
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
