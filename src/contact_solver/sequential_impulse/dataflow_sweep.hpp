/// Dependency-driven (dataflow) sweeps over a group of contacts, without barriers: each contact
/// waits only for the earlier contacts at its two bodies, so that all sweeps overlap. Compiled by
/// g++ and nvcc.
#pragma once

#include "src/contact_solver/cell.hpp"
#include "src/contact_solver/sequential_impulse/contact_rows.hpp"
#include "src/contact_solver/sequential_impulse/scalar_lane.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

// A step is the work on one contact in one pass, for example on its friction rows. A worker
// executes all steps of its contacts, in the order of passes and, within a pass, in the order of
// the schedule.
//
// The velocities of a body are stored in cells of 16 bytes, which are loaded and stored atomically.
// Each cell contains the body's sequence number: the number of steps that have moved the body. If
// all cells of a body have the sequence number of a worker's step, the same 16-byte loads have
// returned the velocities, and no other worker writes the cells before this worker does. Only the
// worker of a contact changes its rows; the programs for velocities and for the split impulse
// change different fields. So no lock, flag or fence is needed.
//
// In the schedule, every contact follows the contacts on which it depends (see RowOrder). So the
// first incomplete step, in the order of passes and of the schedule, is always ready, and its
// worker has no earlier step to execute. Hence the sweeps terminate if every worker makes progress.

inline constexpr int kBodyCells = 6 / kCellNumbers;

inline constexpr std::uint32_t kNoRollingFriction = UINT32_MAX;

/// A contact in the order of the sweeps. Its index in a schedule is its slot.
struct ScheduledContact {
  std::int32_t a, b;             ///< the bodies, as in RowPair
  std::uint32_t rank_a, rank_b;  ///< number of earlier contacts in the schedule that move a, and b
  std::uint32_t slot;            ///< slot in the schedule of all contacts, which addresses the rows
};

/// Kinds of passes over the scheduled contacts. `both` solves each contact and then its friction.
/// `frictions` and `rolling_frictions` read only the impulse of the contact row, other passes the
/// whole row.
enum class RowStep : std::uint8_t {
  warm_start,
  contacts,
  both,
  frictions,
  rolling_frictions,
  split_impulse
};
/// Sequence of passes: the warm start, then `steps` in each iteration.
struct RowProgram {
  RowStep steps[3];
  std::uint32_t steps_per_iteration, iterations;
  std::uint32_t warm_starts;  ///< 0 or 1
  std::uint32_t directions;   ///< number of friction directions

  JFPX_HD std::uint32_t passes() const { return warm_starts + iterations * steps_per_iteration; }
};

/// Schedule of one program, and the velocities that the program changes.
struct ScheduleArrays {
  const ScheduledContact* schedule;
  const std::uint32_t* contact_counts;  ///< by body: scheduled contacts that move it
  Cell* cells;                          ///< by body, kBodyCells each
  std::uint32_t count;                  ///< scheduled contacts
};

/// Results of a contact for the host.
struct ContactOutcome {
  Real direction[3];         ///< first friction direction
  Real second[3];            ///< second direction, if has_second or there is friction along it
  Real impulse, lateral[2];  ///< impulses of the contact and of its friction
  std::uint32_t has_second;  ///< 1 if the contact does not slide; see set_up_contact()
};

struct RowGroupArrays {
  RowSettings settings;
  ScheduleArrays main, split_impulse;
  const Real* bodies;             ///< kBodyFields each
  const Real* factors;            ///< kFactorFields each; null if all are 1
  const Real* inputs;             ///< by contact, kInputFields each
  const std::uint32_t* contacts;  ///< by slot of `main`: index of the contact
  /// By contact: index of its kRollingRows rows, or kNoRollingFriction; null if no contact
  /// has rolling friction.
  const std::uint32_t* rolling_frictions;
  Real* contact_rows;           ///< by slot
  Real* friction_rows;          ///< by slot, then by direction
  Real* rolling_friction_rows;  ///< kRollingRows * kRollingFields each
  ContactOutcome* outcomes;     ///< by contact
  Real* velocities;  ///< by body: linear, angular, push, turn velocity; kOutcomeVelocities each
  std::uint32_t body_count, directions;

  JFPX_HD Real* contact_at(std::uint32_t slot) const {
    return contact_rows + std::size_t{slot} * kContactFields;
  }
  JFPX_HD Real* friction_at(std::uint32_t slot, std::uint32_t direction) const {
    return friction_rows + (std::size_t{slot} * directions + direction) * kFrictionFields;
  }
};
inline constexpr int kOutcomeVelocities = 12;

/// One of the two bodies of a row: whether it is body b, whether it is not Bullet's fixed body, and
/// whether rows move it. A worker copies the velocities of both bodies. Elements of the copy are
/// selected by value, not by address, so that a GPU keeps them in registers.
struct LocalBody {
  bool second, real, moved;
};
struct LocalLane : OneLane {
  using Id = LocalBody;
  JFPX_HD static Mask is_real(const Id* id) { return id->real; }
  JFPX_HD static void gather4(const Real* base, const Id* id, int stride, Vec* out) {
    for (int k = 0; k < 4; ++k) out[k] = id->second ? base[stride + k] : base[k];
  }
  JFPX_HD static void scatter8(Real* base, const Id* id, int stride, const Vec* u, const Vec* w) {
    for (int k = 0; k < 8; ++k) {
      const Real value = k < 4 ? u[k] : w[k - 4];
      base[k] = id->moved && !id->second ? value : base[k];
      base[stride + k] = id->moved && id->second ? value : base[stride + k];
    }
  }
};

/// Postpones the slow division of the last residual until no thread waits for the step.
struct DeferredResidual {
  Residual<OneLane> sum;
  Real impulse = 0, inverse = 1;
  bool active = false;

  JFPX_ROW void add(Real new_impulse, Real new_inverse, bool new_active) {
    finish();
    impulse = new_impulse, inverse = new_inverse, active = new_active;
  }
  JFPX_ROW void finish() {
    if (active) sum.add(impulse, inverse, true);
    active = false;
  }
};

template <int kFields>
JFPX_ROW void copy_row(const Real* from, Real* to) {
#if defined(__CUDA_ARCH__)
#pragma unroll
#endif
  for (int i = 0; i < kFields; ++i) to[i] = from[i];
}

/// Writes the rows of the contact in a slot, and sets its rolling friction impulses to 0.
/// @return whether the contact has a split impulse
JFPX_ROW bool set_up_slot(const RowGroupArrays& group, std::uint32_t slot) {
  const ScheduledContact scheduled = group.main.schedule[slot];
  const std::uint32_t contact = group.contacts[slot];
  const std::int32_t ids[2] = {scheduled.a, scheduled.b};
  Real in[kInputFields], row[kContactFields], friction[kFrictionFields], second[3];
  for (int i = 0; i < kInputFields; ++i) {
    in[i] = group.inputs[std::size_t{contact} * kInputFields + static_cast<std::size_t>(i)];
  }
  const bool has_second =
      set_up_contact<OneLane>(group.settings, in, group.bodies, ids, row, friction, second);
  set_up_friction<OneLane>(group.settings, in, group.bodies, ids, friction);
  copy_row<kContactFields>(row, group.contact_at(slot));
  copy_row<kFrictionFields>(friction, group.friction_at(slot, 0));
  ContactOutcome& outcome = group.outcomes[contact];
  store3<OneLane>(outcome.direction, load3<OneLane>(friction));
  if (group.directions == 2) {
    if (!has_second) {
      store3<OneLane>(second,
                      across<OneLane>(load3<OneLane>(friction), load3<OneLane>(in + kInNormal)));
    }
    store3<OneLane>(friction, load3<OneLane>(second));
    set_up_friction<OneLane>(group.settings, in, group.bodies, ids, friction);
    copy_row<kFrictionFields>(friction, group.friction_at(slot, 1));
  }
  store3<OneLane>(outcome.second, load3<OneLane>(second));
  outcome.has_second = has_second ? 1 : 0;
  if (group.rolling_frictions != nullptr &&
      group.rolling_frictions[contact] != kNoRollingFriction) {
    Real* rows = group.rolling_friction_rows +
                 std::size_t{group.rolling_frictions[contact]} * kRollingRows * kRollingFields;
    for (std::uint32_t t = 0; t < kRollingRows; ++t) rows[t * kRollingFields + kRollingImpulse] = 0;
  }
  return row[kRowSplitRhs] != 0;
}

/// Writes the impulses of the contact in a slot to its outcome.
/// @return whether the outcome contains no NaN, whose bits would differ between processors
JFPX_ROW bool finish_slot(const RowGroupArrays& group, std::uint32_t slot) {
  ContactOutcome& outcome = group.outcomes[group.contacts[slot]];
  outcome.impulse = group.contact_at(slot)[kRowImpulse];
  for (std::uint32_t k = 0; k < group.directions; ++k) {
    outcome.lateral[k] = group.friction_at(slot, k)[kRowImpulse];
  }
  if (group.directions == 1) outcome.lateral[1] = 0;
  bool numbers = outcome.impulse == outcome.impulse;
  for (const Real v : outcome.direction) numbers &= v == v;
  for (const Real v : outcome.second) numbers &= v == v;
  for (const Real v : outcome.lateral) numbers &= v == v;
  return numbers;
}

/// Writes the velocities of a body to the results. @return whether they are all finite
JFPX_ROW bool finish_body(const RowGroupArrays& group, std::uint32_t body) {
  bool finite = true;
  Real* out = group.velocities + std::size_t{body} * kOutcomeVelocities;
  for (int program = 0; program < 2; ++program) {
    const Cell* cells = program == 0 ? group.main.cells : group.split_impulse.cells;
    for (int k = 0; k < 6; ++k, ++out) {
      *out = cells[std::size_t{body} * kBodyCells + static_cast<std::size_t>(k / kCellNumbers)]
                 .numbers[k % kCellNumbers];
      finite &= jfpx::absolute(*out) <= kMaxReal;
    }
  }
  return finite;
}

/// Solves some contacts of a program in all passes, one step at a time, for one thread. `Cells`
/// loads and stores cells atomically. `Results` receives the largest squared residual of every
/// iteration, and a call of broken() for a residual that is NaN.
template <class Cells, bool kFactors, bool kSplitImpulse>
class SweepWorker {
 public:
  /// Solves the scheduled contacts first, first + stride, ...
  JFPX_ROW SweepWorker(const RowGroupArrays& group, const RowProgram& program, std::uint32_t first,
                       std::uint32_t stride)
      : group_(group),
        program_(program),
        order_(kSplitImpulse ? group.split_impulse : group.main),
        first_(first),
        stride_(stride),
        index_(first),
        passes_(first < order_.count ? program.passes() : 0),
        step_(program.warm_starts > 0 ? RowStep::warm_start : program.steps[0]) {
    if (!done()) {
      load_slot();
      prepare_row();
    }
  }

  JFPX_ROW bool done() const { return pass_ >= passes_; }

  /// Executes the next step if all earlier steps at its bodies are done. Must not be called when
  /// done().
  /// @return 0 if the step was executed, else a lower bound of the number of steps that must
  /// precede
  ///   it
  template <class Results>
  JFPX_ROW std::uint32_t step(Results* results) {
    std::uint32_t missing = 0;
    if (bodies_[0].moved && !has_a_) missing = poll(scheduled_.a, sequence_a_, 0, &has_a_);
    if (bodies_[1].moved && !has_b_) {
      const std::uint32_t missing_b = poll(scheduled_.b, sequence_b_, 1, &has_b_);
      if (missing_b > missing) missing = missing_b;
    }
    if (missing > 0) return missing;
    DeferredResidual residual;
    residual.sum.largest = largest_;
    solve(&residual);
    if (bodies_[0].moved) publish(scheduled_.a, sequence_a_, 0);
    if (bodies_[1].moved) publish(scheduled_.b, sequence_b_, 1);
    // From here on no other thread waits for this step.
    store_impulse();
    residual.finish();
    largest_ = residual.sum.largest;
    if (residual.sum.broken) results->broken();
    advance(results);
    if (!done()) prepare_row();
    return 0;
  }

 private:
  static constexpr int kImpulse = kSplitImpulse ? kRowSplitImpulse : kRowImpulse;

  JFPX_ROW void load_slot() {
    scheduled_ = order_.schedule[index_];
    count_a_ = count_b_ = 0;
    const std::int32_t ids[2] = {scheduled_.a, scheduled_.b};
    for (int i = 0; i < 2; ++i) {
      const std::int32_t id = ids[i];
      bodies_[i] = {i == 1, id != kFixedBody, id >= 0};
      const auto slot = static_cast<std::size_t>(id < 0 ? ~id : id);
      for (int k = 0; k < kVelocityFields; ++k) velocities_[kVelocityFields * i + k] = 0;
      velocities_[kVelocityFields * i + 3] = group_.bodies[slot * kBodyFields + 3];
      if (id >= 0) (i == 0 ? count_a_ : count_b_) = order_.contact_counts[slot];
    }
  }
  /// Loads the row while the bodies are not ready.
  JFPX_ROW void prepare_row() {
    sequence_a_ = pass_ * count_a_ + scheduled_.rank_a;
    sequence_b_ = pass_ * count_b_ + scheduled_.rank_b;
    has_a_ = has_b_ = false;
    const Real* const contact = group_.contact_at(scheduled_.slot);
    if (kSplitImpulse || step_ <= RowStep::both) {
      copy_row<kContactFields>(contact, row_);
    } else {
      pressure_ = contact[kRowImpulse];
      if (step_ == RowStep::frictions) {
        copy_row<kFrictionFields>(group_.friction_at(scheduled_.slot, 0), row_);
      }
    }
  }
  JFPX_ROW void store_impulse() const {
    if (kSplitImpulse || step_ == RowStep::contacts || step_ == RowStep::both) {
      group_.contact_at(scheduled_.slot)[kImpulse] =
          kSplitImpulse || step_ == RowStep::contacts ? row_[kImpulse] : pressure_;
    }
  }

  /// Loads the velocities of a body if its sequence number has been reached.
  /// @param side 0 for body a, 1 for body b
  /// @return 0 on success, else the number of steps of the body that must precede
  JFPX_ROW std::uint32_t poll(std::int32_t body, std::uint32_t sequence, int side, bool* has) {
    const Cell* cells = order_.cells + std::size_t{static_cast<std::uint32_t>(body)} * kBodyCells;
    Cell read[kBodyCells];
    for (int c = 0; c < kBodyCells; ++c) read[c] = Cells::load(cells + c);
    std::uint32_t missing = 0;
    // NOLINTNEXTLINE(modernize-loop-convert): as above, so that a GPU keeps `read` in registers
    for (int c = 0; c < kBodyCells; ++c) {
      if (sequence - read[c].sequence > missing) missing = sequence - read[c].sequence;
    }
    if (missing > 0) return missing;
    Real* v = velocities_ + kVelocityFields * side;
    for (int k = 0; k < 6; ++k) {
      v[k < 3 ? k : k + 1] = read[k / kCellNumbers].numbers[k % kCellNumbers];
    }
    *has = true;
    return 0;
  }
  /// Stores the velocities of a body, and the sequence number of its next step.
  JFPX_ROW void publish(std::int32_t body, std::uint32_t sequence, int side) {
    Cell* cells = order_.cells + std::size_t{static_cast<std::uint32_t>(body)} * kBodyCells;
    const Real* v = velocities_ + kVelocityFields * side;
    for (int c = 0; c < kBodyCells; ++c) {
      Cell cell;
      for (int j = 0; j < kCellNumbers; ++j) {
        const int k = c * kCellNumbers + j;
        cell.numbers[j] = v[k < 3 ? k : k + 1];
      }
      cell.sequence = sequence + 1;
      Cells::store(cells + c, cell);
    }
  }

  JFPX_ROW void solve(DeferredResidual* residual) {
    Real factors[2 * kFactorFields];
    if constexpr (kFactors) load_factors(factors);
    if (kSplitImpulse || step_ == RowStep::contacts || step_ == RowStep::both) {
      solve_contact<LocalLane, kFactors, kSplitImpulse>(
          bodies_, velocities_, kFactors ? factors : nullptr, row_, residual);
    }
    if constexpr (!kSplitImpulse) {
      if (step_ == RowStep::frictions) {
        solve_friction_rows(factors, residual);
      } else if (step_ == RowStep::both) {
        pressure_ = row_[kRowImpulse];
        copy_row<kFrictionFields>(group_.friction_at(scheduled_.slot, 0), row_);
        solve_friction_rows(factors, residual);
      } else if (step_ == RowStep::rolling_frictions) {
        solve_rolling_friction_rows(factors, residual);
      } else if (step_ == RowStep::warm_start) {
        rows::warm_start<LocalLane, kFactors>(bodies_, velocities_, factors, row_);
      }
    }
  }
  /// Requires the first friction row in row_.
  JFPX_ROW void solve_friction_rows(const Real* factors, DeferredResidual* residual) {
    Real contact[kRowImpulse + 1];
    contact[kRowImpulse] = pressure_;
    if (!(0 < pressure_)) return;
    for (std::uint32_t k = 0; k < program_.directions; ++k) {
      Real* const at = group_.friction_at(scheduled_.slot, k);
      if (k > 0) copy_row<kFrictionFields>(at, row_);
      solve_friction<LocalLane, kFactors>(bodies_, velocities_, factors, contact, row_, residual);
      at[kRowImpulse] = row_[kRowImpulse];
    }
  }
  JFPX_ROW void solve_rolling_friction_rows(const Real* factors, DeferredResidual* residual) {
    const std::uint32_t index = group_.rolling_frictions[group_.contacts[scheduled_.slot]];
    if (index == kNoRollingFriction) return;
    Real contact[kRowImpulse + 1];
    contact[kRowImpulse] = pressure_;
    solve_rolling_frictions<LocalLane, kFactors>(
        bodies_, velocities_, factors, contact,
        group_.rolling_friction_rows + std::size_t{index} * kRollingRows * kRollingFields,
        residual);
  }
  JFPX_ROW void load_factors(Real* factors) const {
    const std::int32_t ids[2] = {scheduled_.a, scheduled_.b};
    for (int i = 0; i < 2; ++i) {
      const auto slot = static_cast<std::size_t>(ids[i] < 0 ? ~ids[i] : ids[i]);
      for (int k = 0; k < kFactorFields; ++k) {
        factors[kFactorFields * i + k] =
            group_.factors[slot * kFactorFields + static_cast<std::size_t>(k)];
      }
    }
  }

  /// Continues with the next contact, or with the next pass after the last contact.
  template <class Results>
  JFPX_ROW void advance(Results* results) {
    if (order_.count - index_ > stride_) {
      index_ += stride_;
      load_slot();
      return;
    }
    ++pass_;
    if (step_ == RowStep::warm_start) {
      step_ = program_.steps[0];
    } else if (++step_number_ < program_.steps_per_iteration) {
      step_ = program_.steps[step_number_];
    } else {
      results->raise(iteration_++, largest_);
      largest_ = 0;
      step_number_ = 0;
      step_ = program_.steps[0];
    }
    if (index_ != first_) {
      index_ = first_;
      load_slot();
    }
  }

  const RowGroupArrays& group_;
  const RowProgram& program_;
  const ScheduleArrays& order_;
  std::uint32_t first_, stride_, index_, passes_;
  std::uint32_t pass_ = 0, step_number_ = 0, iteration_ = 0;
  RowStep step_;
  ScheduledContact scheduled_;
  LocalBody bodies_[2];
  std::uint32_t count_a_, count_b_, sequence_a_, sequence_b_;
  bool has_a_, has_b_;
  Real velocities_[2 * kVelocityFields];
  Real row_[kContactFields];  ///< the next row
  Real pressure_;             ///< impulse of its contact, in passes that do not solve the contact
  Real largest_ = 0;
};

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
