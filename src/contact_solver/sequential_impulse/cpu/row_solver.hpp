/// Sweeps of sequential impulses over contact rows. Rows that share no moving body are solved in
/// parallel, in vector lanes and in threads, with the bits of the serial order.
#pragma once

#include <jfpx/math.hpp>
#include <jfpx/simd_level.hpp>

#include "src/base/buffer.hpp"
#include "src/base/sized_chooser.hpp"
#include "src/base/thread_pool.hpp"
#include "src/contact_solver/sequential_impulse/coloring.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_kernels.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

using rows::RowPair;
using rows::RowSweepReport;

/// Rows of other constraints, which are solved serially at the start of each sweep.
class SerialRows {
 public:
  virtual void sweep(int iteration, RowResidual* residual) = 0;

 protected:
  ~SerialRows() = default;
};

struct RowSweepSettings {
  int iterations = 10;
  SerialRows* serial = nullptr;
  int serial_iterations = 0;  ///< iterations of the serial rows, if more than `iterations`
  Real threshold = 0;         ///< sweeps end when the largest squared residual is no larger
  bool interleave = false;    ///< solve the friction of each contact directly after the contact
  bool warm_start = false;    ///< begin with the impulses in the rows
  bool split_impulse = true;  ///< also run the sweeps of the split impulse
};

/// Owns its buffers, which grow and never shrink. Functions must be called in the order of their
/// declaration, by one thread at a time.
class JFPX_API RowSolver {
 public:
  /// @param threads upper limit; 0: one per core. Sweeps use one thread where that has been faster.
  explicit RowSolver(unsigned threads = 1, SimdLevel simd = SimdLevel::automatic);
  ~RowSolver();

  ThreadPool& pool() noexcept { return pool_; }
  unsigned lanes() const noexcept { return kernels_.lanes; }

  /// Reserves bodies [0, count). Body 0 is set to Bullet's fixed body; the caller fills the others.
  void resize_bodies(std::size_t count);
  std::size_t bodies() const noexcept { return body_count_; }
  Real* body(std::size_t i) { return bodies_.data() + i * rows::kBodyFields; }
  Real* velocity(std::size_t i) { return velocities_.data() + slot_of(i) * rows::kVelocityFields; }
  Real* push_velocity(std::size_t i) {
    return push_velocities_.data() + slot_of(i) * rows::kVelocityFields;
  }
  Real* factors(std::size_t i) { return factors_.data() + slot_of(i) * rows::kFactorFields; }
  /// Positions determine how threads share the bodies; they affect the speed only.
  void set_position(std::size_t i, const Vec3& position) { positions_[i] = position; }

  /// Arranges the contacts, given in their serial order, in blocks of one color and one part of the
  /// bodies each. Removes all rolling friction rows. Call once after resize_bodies().
  /// @param pairs must remain valid until the rows are set up
  /// @param directions number of friction directions: 1 or 2
  void schedule(std::span<const RowPair> pairs, std::uint32_t directions);
  std::uint32_t blocks() const noexcept { return blocks_; }
  std::uint32_t colors() const noexcept { return coloring_.colors(); }
  /// The index of the contact in each lane of a block; kNoContact in unused lanes.
  static constexpr std::uint32_t kNoContact = UINT32_MAX;
  const std::uint32_t* contacts_of(std::uint32_t block) const {
    return order_.data() + std::size_t{block} * kernels_.lanes;
  }
  Real* contact_rows(std::uint32_t block) {
    return contacts_.data() + std::size_t{block} * kernels_.lanes * rows::kContactFields;
  }
  /// The rows of one friction direction.
  Real* friction_rows(std::uint32_t block, std::uint32_t direction = 0) {
    return frictions_.data() +
           (std::size_t{block} * directions_ + direction) * kernels_.lanes * rows::kFrictionFields;
  }

  /// Selects the blocks that have rolling or spinning friction rows, for which has(block) is true.
  template <class Has>
  void select_rolling_frictions(const Has& has) {
    select(has, &rolling_friction_blocks_);
    rolling_frictions_.reserve(blocks_ * rolling_numbers(), "rows of a solver");
  }
  /// Number of fields and lanes of the kRollingRows rolling friction rows of a block.
  std::size_t rolling_numbers() const {
    return std::size_t{rows::kRollingRows} * rows::kRollingFields * kernels_.lanes;
  }
  Real* rolling_friction_rows(std::uint32_t block) {
    return rolling_frictions_.data() + block * rolling_numbers();
  }

  /// The bodies of a block: all bodies a, then all bodies b.
  using BlockIds = std::array<std::int32_t, 2 * rows::kMaxLanes>;
  BlockIds ids_of(std::uint32_t block) const;
  /// Sets up the contact rows of a block from its inputs. Thread-safe for different blocks.
  /// @param ids ids_of() the block
  /// @return one bit per lane: whether `second` holds the second friction direction
  unsigned set_up_contacts(const rows::RowSettings& settings, std::uint32_t block,
                           const BlockIds& ids, const Real* inputs, Real* second);
  void set_up_frictions(const rows::RowSettings& settings, std::uint32_t block, const BlockIds& ids,
                        std::uint32_t direction, const Real* inputs);
  /// Set up the rolling friction rows of a selected block, in two steps: see
  /// rows::set_up_rolling_axes() and rows::set_up_rolling_frictions().
  void set_up_rolling_axes(std::uint32_t block, const Real* normals) {
    kernels_.set_up_rolling_axes(normals, rolling_friction_rows(block));
  }
  void set_up_rolling_frictions(std::uint32_t block, const BlockIds& ids) {
    note_regular(kernels_.set_up_rolling_frictions(bodies_.data(), ids.data(),
                                                   rolling_friction_rows(block)));
  }

  /// @param factors whether any body has a linear or angular factor other than 1
  RowSweepReport solve(const RowSweepSettings& settings, bool factors);

 private:
  static constexpr std::size_t kPrograms = 3;
  static constexpr unsigned kMaxParts = 64;   // sets of parts are words
  static constexpr unsigned kIsShared = 128;  // of a body, in part_of_body_
  struct PartProgress;
  struct Program;
  /// Blocks [first, last).
  struct BlockRange {
    std::uint32_t first, last;
    std::uint32_t size() const { return last - first; }
  };
  /// Selected blocks, by group.
  struct BlockSubset {
    Buffer<std::uint32_t> blocks;
    Buffer<BlockRange> ranges;
    std::uint32_t count = 0;
  };

  template <class Has>
  void select(const Has& has, BlockSubset* subset) {
    const std::size_t groups = group_count();
    subset->blocks.reserve(blocks_, "rows of a solver");
    subset->ranges.reserve(groups, "rows of a solver");
    subset->count = 0;
    for (std::size_t group = 0; group < groups; ++group) {
      const std::uint32_t before = subset->count;
      for (std::uint32_t i = ranges_[group].first; i < ranges_[group].last; ++i) {
        if (has(i)) subset->blocks[subset->count++] = i;
      }
      subset->ranges[group] = {before, subset->count};
    }
  }

  /// Groups of contacts: 2 * (color * parts + part) for contacts that move a shared body, which
  /// contacts of another part also move; the next number for other contacts.
  std::size_t group_count() const { return std::size_t{2} * colors() * parts_; }
  /// Within a group, contacts whose bodies a are not moved precede those whose bodies b are not
  /// moved, because blocks without moved bodies on one side take less time.
  static constexpr std::uint32_t kKindsOfContacts = 3;
  static std::uint32_t kind_of(const RowPair& pair) { return pair.a < 0 ? 0 : pair.b < 0 ? 1 : 2; }
  void choose_parts();
  void divide_bodies();
  void assign_slots();
  void to_slots(Buffer<Real>* values, std::size_t fields);
  /// Index of a body in the arrays that sweeps change.
  std::size_t slot_of(std::size_t body) const { return is_divided_ ? slots_[body] : body; }
  std::int32_t slot_of_id(std::int32_t id) const {
    const auto slot = [&](std::int32_t i) {
      return static_cast<std::int32_t>(slot_of(static_cast<std::size_t>(i)));
    };
    return id >= 0 ? slot(id) : ~slot(~id);
  }
  std::uint32_t part_of(const RowPair& pair) const;
  void note_regular(bool is_regular) {
    if (!is_regular) all_regular_.store(false, std::memory_order_relaxed);
  }
  void assign_groups();
  void mark_shared_bodies();

  const RowKernels& kernels_;
  ThreadPool pool_;
  std::uint32_t blocks_ = 0, directions_ = 1, parts_ = 1;
  std::size_t body_count_ = 0;
  ContactColoring coloring_;
  Buffer<Real> bodies_, velocities_, push_velocities_, factors_;
  Buffer<Vec3> positions_;
  std::span<const RowPair> pairs_;
  bool is_divided_ = false;            ///< whether the bodies have parts and slots
  Buffer<std::uint8_t> part_of_body_;  ///< with kIsShared if contacts of other parts move the body
  Buffer<std::uint32_t> slots_;        ///< by body, in the order of the parts; 0 for the fixed body
  Buffer<Real> spare_values_;
  Buffer<Real> contacts_, frictions_, rolling_frictions_;
  Buffer<std::int32_t> ids_;
  Buffer<std::uint32_t> order_, next_lane_;
  Buffer<std::uint32_t> groups_;  ///< by contact: kKindsOfContacts * group + kind
  Buffer<BlockRange> ranges_;     ///< of the blocks, by group
  Buffer<std::uint64_t>
      parts_of_body_;  ///< by shared body: its part, and the parts whose contacts move it
  std::array<std::uint64_t, kMaxParts> conflicts_{};  ///< by part: set of parts with common bodies
  BlockSubset split_impulse_blocks_, rolling_friction_blocks_;
  Buffer<std::uint8_t> split_rows_;      ///< by block: number of contacts with a split impulse
  std::atomic<bool> all_regular_{true};  ///< whether all effective masses are normal numbers
  std::unique_ptr<std::atomic<Real>[]> residuals_;
  std::size_t residual_capacity_ = 0;
  std::uint32_t most_parts_ = 1;
  std::unique_ptr<PartProgress[]> progress_;  ///< by program and part
  SizedChooser chooser_;      ///< of several threads or one, by the number of blocks
  bool is_measured_ = false;  ///< whether the chooser needs the time of an iteration
  double division_us_ = 0;    ///< [us], of the division of the bodies
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
