/// Sweeps of sequential impulses over contact rows, in an order that gives the bits of the serial
/// one: rows that share no moving body run side by side, in vectors and in threads.
#pragma once

#include <jfpx/simd_level.hpp>

#include "src/base/buffer.hpp"
#include "src/base/thread_choice.hpp"
#include "src/base/thread_pool.hpp"
#include "src/contact_solver/cpu/row_kernels.hpp"

#include <array>
#include <atomic>
#include <memory>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

using rows::RowPair;
using rows::RowSweepReport;

/// Other rows, which are solved one after the other at the start of each sweep.
class SerialRows {
 public:
  virtual void sweep(int iteration, RowResidual* residual) = 0;

 protected:
  ~SerialRows() = default;
};

struct RowSweepSettings {
  int iterations = 10;
  SerialRows* serial = nullptr;
  int serial_iterations = 0;  ///< of the serial rows, where they are more
  Real threshold = 0;         ///< sweeps end when the largest squared residual is no larger
  bool interleave = false;    ///< each contact's friction right after it
  bool warm_start = false;    ///< begin with the impulses in the rows
  bool push = true;           ///< the sweeps against penetration too
};

/// Owns its buffers, which only grow. To be used in the order of its functions; one thread at a
/// time.
class JFPX_API RowSolver {
 public:
  /// @param threads at most; 0: one per core. Sweeps take one where that has been faster.
  explicit RowSolver(unsigned threads = 1, SimdLevel simd = SimdLevel::automatic);

  ThreadPool& pool() noexcept { return pool_; }
  unsigned lanes() const noexcept { return kernels_.lanes; }

  /// Room for bodies [0, count); body 0 is set to Bullet's fixed one, the others must be filled.
  void resize_bodies(std::size_t count);
  std::size_t bodies() const noexcept { return body_count_; }
  Real* body(std::size_t i) { return bodies_.data() + i * rows::kBodyFields; }
  Real* velocity(std::size_t i) { return velocities_.data() + i * rows::kVelocityFields; }
  Real* push(std::size_t i) { return pushes_.data() + i * rows::kVelocityFields; }
  Real* factors(std::size_t i) { return factors_.data() + i * rows::kFactorFields; }

  /// Arranges the contacts, given in their serial order, in blocks. No block has rolling_frictions
  /// then.
  /// @param directions of friction: 1 or 2
  void schedule(std::span<const RowPair> pairs, std::uint32_t directions);
  std::uint32_t blocks() const noexcept { return blocks_; }
  std::uint32_t levels() const noexcept { return levels_; }
  /// Which contact is in a lane; kNoContact in lanes that are left over.
  static constexpr std::uint32_t kNoContact = UINT32_MAX;
  const std::uint32_t* contacts_of(std::uint32_t block) const {
    return order_.data() + std::size_t{block} * kernels_.lanes;
  }
  Real* contact_rows(std::uint32_t block) {
    return contacts_.data() + std::size_t{block} * kernels_.lanes * rows::kContactFields;
  }
  /// The rows of one of the directions of friction.
  Real* friction_rows(std::uint32_t block, std::uint32_t direction = 0) {
    return frictions_.data() +
           (std::size_t{block} * directions_ + direction) * kernels_.lanes * rows::kFrictionFields;
  }

  /// Chooses the blocks that have rows against rolling or spinning, for which has(block); no other
  /// is looked at later.
  template <class Has>
  void choose_rolling_frictions(const Has& has) {
    choose(has, &rolling_friction_choice_);
    rolling_frictions_.reserve(std::size_t{rolling_friction_choice_.count} * kRollingFrictionRows *
                                   kernels_.lanes * rows::kFrictionFields,
                               "rows of a solver");
  }
  std::span<const std::uint32_t> rolling_friction_blocks() const {
    return {rolling_friction_choice_.blocks.data(), rolling_friction_choice_.count};
  }
  /// Rows of the k-th of those blocks; t is below kRollingFrictionRows.
  Real* rolling_friction_rows(std::size_t k, std::uint32_t t) {
    return rolling_frictions_.data() +
           (k * kRollingFrictionRows + t) * kernels_.lanes * rows::kFrictionFields;
  }

  /// Sets up the contact rows of a block from its inputs. Safe for different blocks at once.
  unsigned set_up_contacts(const rows::RowSettings& settings, std::uint32_t block,
                           const Real* inputs, Real* second);
  void set_up_frictions(const rows::RowSettings& settings, std::uint32_t block,
                        std::uint32_t direction, const Real* inputs);

  /// @param factors whether some body has a linear or angular factor other than 1
  RowSweepReport solve(const RowSweepSettings& settings, bool factors);

 private:
  /// A range of blocks that one thread runs in one go, once all tickets before `after` are done.
  struct Ticket {
    std::uint32_t first, last, after;
  };
  struct Program;
  /// Some of the blocks, in order.
  struct Choice {
    Buffer<std::uint32_t> blocks, level_ends;
    Buffer<Ticket> tickets;
    std::uint32_t count = 0, ticket_count = 0;
  };

  template <class Has>
  void choose(const Has& has, Choice* choice) {
    choice->blocks.reserve(blocks_, "rows of a solver");
    choice->level_ends.reserve(levels_, "rows of a solver");
    choice->count = 0;
    std::uint32_t block = 0, levels = 0;
    for (std::uint32_t level = 0; level < levels_; ++level) {
      const std::uint32_t before = choice->count;
      for (; block < level_end_[level]; ++block) {
        if (has(block)) choice->blocks[choice->count++] = block;
      }
      if (choice->count > before) choice->level_ends[levels++] = choice->count;
    }
    make_tickets({choice->level_ends.data(), levels}, &choice->tickets, &choice->ticket_count);
  }
  unsigned useful_threads() const;
  void make_tickets(std::span<const std::uint32_t> level_ends, Buffer<Ticket>* tickets,
                    std::uint32_t* count);

  const RowKernels& kernels_;
  ThreadPool pool_;
  std::uint32_t blocks_ = 0, directions_ = 1, ticket_count_ = 0;
  std::size_t body_count_ = 0;
  std::uint32_t levels_ = 0;
  Buffer<Real> bodies_, velocities_, pushes_, factors_, contacts_, frictions_, rolling_frictions_;
  Buffer<std::int32_t> ids_;
  Buffer<std::uint32_t> order_, body_level_, contact_level_, level_count_, level_end_;
  Buffer<Ticket> tickets_;
  Choice push_choice_, rolling_friction_choice_;
  std::unique_ptr<std::atomic<Real>[]> residuals_;
  std::size_t residual_capacity_ = 0;
  std::array<ThreadChoice, 33> thread_choices_;  ///< by the bits of the number of blocks
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
