/// Sweeps over a group of contacts without levels and barriers: each contact waits for its own
/// turn at its two bodies, so that all sweeps overlap. For g++ and nvcc alike.
#pragma once

#include "src/contact_solver/contact_rows.hpp"
#include "src/contact_solver/scalar_lane.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

// A body's velocities lie in cells of 16 bytes, which are read and written at once, and each cell
// says how many rows have moved the body. Who finds his own turn in all cells of a body has its
// velocities, and nobody else writes them before he has; so no lock, flag or fence is needed. The
// first row in Bullet's order that is not solved yet never has to wait: walkers that each keep to
// that order, and that all get to run, come to an end.

inline constexpr int kCellNumbers = sizeof(Real) == 4 ? 3 : 1;
inline constexpr int kBodyCells = 6 / kCellNumbers;

struct alignas(16) Cell {
  Real numbers[kCellNumbers];
  std::uint32_t turn;  ///< rows that have moved the body
};
static_assert(sizeof(Cell) == 16);

inline constexpr std::uint32_t kNoRollingFriction = UINT32_MAX;

/// A contact in the order of the sweeps.
struct Place {
  std::int32_t a, b;             ///< the bodies, as in RowPair
  std::uint32_t rank_a, rank_b;  ///< places before this one that move a, and b
  std::uint32_t row;             ///< where the rows lie: the place in the order of all contacts
};

/// What is to be done, pass by pass: the warm start, then the passes of each iteration. The first
/// three begin with the row of the contact.
enum class RowStep : std::uint8_t {
  warm_start,
  contacts,
  both,
  frictions,
  rolling_frictions,
  push
};
struct RowProgram {
  RowStep steps[3];
  std::uint32_t steps_an_iteration, iterations;
  std::uint32_t warm_starts;  ///< 0 or 1
  std::uint32_t directions;   ///< of friction

  JFPX_HD std::uint32_t passes() const { return warm_starts + iterations * steps_an_iteration; }
};

/// Places of one program, and the velocities that it changes.
struct RowOrderArrays {
  const Place* places;
  const std::uint32_t* moves;  ///< by body: places that move it
  Cell* cells;                 ///< by body, kBodyCells each
  std::uint32_t count;
};

/// What the host reads of a contact.
struct ContactOutcome {
  Real direction[3];         ///< of friction
  Real second[3];            ///< the other direction, if has_second or there is friction along it
  Real impulse, lateral[2];  ///< of the contact, of its frictions
  std::uint32_t has_second;  ///< the contact does not slide: see set_up_contact()
};

struct RowGroupArrays {
  RowSettings settings;
  RowOrderArrays main, push;
  const Real* bodies;             ///< kBodyFields each
  const Real* factors;            ///< kFactorFields each; null where all are 1
  const Real* inputs;             ///< by contact, kInputFields each
  const std::uint32_t* contacts;  ///< by place of `main`: the contact
  const std::uint32_t*
      rolling_frictions;  ///< by contact: which kRollingFrictionRows rows; null if there are none
  Real* contact_rows;     ///< by place
  Real* friction_rows;    ///< by place, direction after direction
  Real* rolling_friction_rows;  ///< kRollingFrictionRows * kFrictionFields each
  ContactOutcome* outcomes;     ///< by contact
  Real* velocities;  ///< by body: linear, angular, and those of the push; kOutcomeVelocities each
  std::uint32_t bodies_count, directions;

  JFPX_HD Real* contact_at(std::uint32_t place) const {
    return contact_rows + std::size_t{place} * kContactFields;
  }
  JFPX_HD Real* friction_at(std::uint32_t place, std::uint32_t direction) const {
    return friction_rows + (std::size_t{place} * directions + direction) * kFrictionFields;
  }
};
inline constexpr int kOutcomeVelocities = 12;

/// One of the two bodies of a row, in a walker's own copy of their velocities. The places there are
/// chosen by value, not by address: a GPU then keeps them in registers.
struct WalkBody {
  bool second, real, moved;
};
struct WalkLane : OneLane {
  using Id = WalkBody;
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

/// Keeps the last residual until others no longer wait for the row: its division takes long.
struct LateResidual {
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

/// Makes the rows of the contact at a place, and sets its impulses against rolling to 0.
/// @return whether it is to be pushed apart
JFPX_ROW bool set_up_place(const RowGroupArrays& group, std::uint32_t index) {
  const Place place = group.main.places[index];
  const std::uint32_t contact = group.contacts[index];
  const std::int32_t ids[2] = {place.a, place.b};
  Real in[kInputFields], row[kContactFields], friction[kFrictionFields], second[3];
  for (int i = 0; i < kInputFields; ++i) {
    in[i] = group.inputs[std::size_t{contact} * kInputFields + static_cast<std::size_t>(i)];
  }
  const bool has_second =
      set_up_contact<OneLane>(group.settings, in, group.bodies, ids, row, friction, second);
  set_up_friction<OneLane>(group.settings, in, group.bodies, ids, friction);
  copy_row<kContactFields>(row, group.contact_at(index));
  copy_row<kFrictionFields>(friction, group.friction_at(index, 0));
  ContactOutcome& outcome = group.outcomes[contact];
  store3<OneLane>(outcome.direction, load3<OneLane>(friction));
  if (group.directions == 2) {
    if (!has_second) {
      store3<OneLane>(second,
                      across<OneLane>(load3<OneLane>(friction), load3<OneLane>(in + kInNormal)));
    }
    store3<OneLane>(friction, load3<OneLane>(second));
    set_up_friction<OneLane>(group.settings, in, group.bodies, ids, friction);
    copy_row<kFrictionFields>(friction, group.friction_at(index, 1));
  }
  store3<OneLane>(outcome.second, load3<OneLane>(second));
  outcome.has_second = has_second ? 1 : 0;
  if (group.rolling_frictions != nullptr &&
      group.rolling_frictions[contact] != kNoRollingFriction) {
    Real* rows = group.rolling_friction_rows + std::size_t{group.rolling_frictions[contact]} *
                                                   kRollingFrictionRows * kFrictionFields;
    for (std::uint32_t t = 0; t < kRollingFrictionRows; ++t)
      rows[t * kFrictionFields + kRowImpulse] = 0;
  }
  return row[kRowPushRhs] != 0;
}

/// Hands out the impulses of the contact at a place. @return whether all it hands out are numbers:
/// which NaN it is differs between processors
JFPX_ROW bool finish_place(const RowGroupArrays& group, std::uint32_t index) {
  ContactOutcome& outcome = group.outcomes[group.contacts[index]];
  outcome.impulse = group.contact_at(index)[kRowImpulse];
  for (std::uint32_t k = 0; k < group.directions; ++k) {
    outcome.lateral[k] = group.friction_at(index, k)[kRowImpulse];
  }
  if (group.directions == 1) outcome.lateral[1] = 0;
  bool numbers = outcome.impulse == outcome.impulse;
  for (const Real v : outcome.direction) numbers &= v == v;
  for (const Real v : outcome.second) numbers &= v == v;
  for (const Real v : outcome.lateral) numbers &= v == v;
  return numbers;
}

/// Hands out the velocities of a body. @return whether they are all finite
JFPX_ROW bool finish_body(const RowGroupArrays& group, std::uint32_t body) {
  bool finite = true;
  Real* out = group.velocities + std::size_t{body} * kOutcomeVelocities;
  for (int pushed = 0; pushed < 2; ++pushed) {
    const Cell* cells = pushed == 0 ? group.main.cells : group.push.cells;
    for (int k = 0; k < 6; ++k, ++out) {
      *out = cells[std::size_t{body} * kBodyCells + static_cast<std::size_t>(k / kCellNumbers)]
                 .numbers[k % kCellNumbers];
      finite &= jfpx::absolute(*out) <= kMaxReal;
    }
  }
  return finite;
}

/// Takes some places of a program through all passes. `Cells` reads and writes cells at once;
/// `Found` is told the largest squared residual of an iteration, and of residuals that are no
/// numbers.
template <class Cells, bool kFactors, bool kPush>
class RowWalker {
 public:
  /// Places first, first + stride, ...
  JFPX_ROW RowWalker(const RowGroupArrays& group, const RowProgram& program, std::uint32_t first,
                     std::uint32_t stride)
      : group_(group),
        program_(program),
        order_(kPush ? group.push : group.main),
        first_(first),
        stride_(stride),
        index_(first),
        passes_(first < order_.count ? program.passes() : 0),
        step_(program.warm_starts > 0 ? RowStep::warm_start : program.steps[0]) {
    if (!done()) {
      load_place();
      await_turn();
    }
  }

  JFPX_ROW bool done() const { return pass_ >= passes_; }

  /// Solves the next row if it is its turn. Not to be called when done().
  /// @return 0 if so, else how many rows at least come before it
  template <class Found>
  JFPX_ROW std::uint32_t step(Found* found) {
    std::uint32_t missing = 0;
    if (bodies_[0].moved && !has_a_) missing = look(place_.a, turn_a_, 0, &has_a_);
    if (bodies_[1].moved && !has_b_) {
      const std::uint32_t missing_b = look(place_.b, turn_b_, 1, &has_b_);
      if (missing_b > missing) missing = missing_b;
    }
    if (missing > 0) return missing;
    LateResidual late;
    late.sum.largest = largest_;
    solve(&late);
    if (bodies_[0].moved) hand_on(place_.a, turn_a_, 0);
    if (bodies_[1].moved) hand_on(place_.b, turn_b_, 1);
    // From here on nobody waits for this row.
    keep_impulse();
    late.finish();
    largest_ = late.sum.largest;
    if (late.sum.broken) found->broken();
    advance(found);
    if (!done()) await_turn();
    return 0;
  }

 private:
  static constexpr int kImpulse = kPush ? kRowPush : kRowImpulse;

  JFPX_ROW void load_place() {
    place_ = order_.places[index_];
    moves_a_ = moves_b_ = 0;
    const std::int32_t ids[2] = {place_.a, place_.b};
    for (int i = 0; i < 2; ++i) {
      const std::int32_t id = ids[i];
      bodies_[i] = {i == 1, id != kFixedBody, id >= 0};
      const auto slot = static_cast<std::size_t>(id < 0 ? ~id : id);
      for (int k = 0; k < kVelocityFields; ++k) velocities_[kVelocityFields * i + k] = 0;
      velocities_[kVelocityFields * i + 3] = group_.bodies[slot * kBodyFields + 3];
      if (id >= 0) (i == 0 ? moves_a_ : moves_b_) = order_.moves[slot];
    }
  }
  /// Has the row at hand when its turn comes.
  JFPX_ROW void await_turn() {
    turn_a_ = pass_ * moves_a_ + place_.rank_a;
    turn_b_ = pass_ * moves_b_ + place_.rank_b;
    has_a_ = has_b_ = false;
    const Real* const contact = group_.contact_at(place_.row);
    if (kPush || step_ <= RowStep::both) {
      copy_row<kContactFields>(contact, row_);
    } else {
      pressure_ = contact[kRowImpulse];
      if (step_ == RowStep::frictions) {
        copy_row<kFrictionFields>(group_.friction_at(place_.row, 0), row_);
      }
    }
  }
  JFPX_ROW void keep_impulse() const {
    if (kPush || step_ == RowStep::contacts || step_ == RowStep::both) {
      group_.contact_at(place_.row)[kImpulse] =
          kPush || step_ == RowStep::contacts ? row_[kImpulse] : pressure_;
    }
  }

  JFPX_ROW std::uint32_t look(std::int32_t body, std::uint32_t turn, int slot, bool* has) {
    const Cell* cells = order_.cells + std::size_t{static_cast<std::uint32_t>(body)} * kBodyCells;
    Cell read[kBodyCells];
    for (int c = 0; c < kBodyCells; ++c) read[c] = Cells::load(cells + c);
    std::uint32_t missing = 0;
    // NOLINTNEXTLINE(modernize-loop-convert): as above, so that devices keep `read` in registers
    for (int c = 0; c < kBodyCells; ++c) {
      if (turn - read[c].turn > missing) missing = turn - read[c].turn;
    }
    if (missing > 0) return missing;
    Real* v = velocities_ + kVelocityFields * slot;
    for (int k = 0; k < 6; ++k) {
      v[k < 3 ? k : k + 1] = read[k / kCellNumbers].numbers[k % kCellNumbers];
    }
    *has = true;
    return 0;
  }
  JFPX_ROW void hand_on(std::int32_t body, std::uint32_t turn, int slot) {
    Cell* cells = order_.cells + std::size_t{static_cast<std::uint32_t>(body)} * kBodyCells;
    const Real* v = velocities_ + kVelocityFields * slot;
    for (int c = 0; c < kBodyCells; ++c) {
      Cell cell;
      for (int j = 0; j < kCellNumbers; ++j) {
        const int k = c * kCellNumbers + j;
        cell.numbers[j] = v[k < 3 ? k : k + 1];
      }
      cell.turn = turn + 1;
      Cells::store(cells + c, cell);
    }
  }

  JFPX_ROW void solve(LateResidual* late) {
    Real factors[2 * kFactorFields];
    if constexpr (kFactors) load_factors(factors);
    if (kPush || step_ == RowStep::contacts || step_ == RowStep::both) {
      solve_contact<WalkLane, kFactors, kPush>(bodies_, velocities_, factors, row_, late);
    }
    if constexpr (!kPush) {
      if (step_ == RowStep::frictions) {
        solve_friction_rows(factors, late);
      } else if (step_ == RowStep::both) {
        pressure_ = row_[kRowImpulse];
        copy_row<kFrictionFields>(group_.friction_at(place_.row, 0), row_);
        solve_friction_rows(factors, late);
      } else if (step_ == RowStep::rolling_frictions) {
        solve_rolling_friction_rows(factors, late);
      } else if (step_ == RowStep::warm_start) {
        rows::warm_start<WalkLane, kFactors>(bodies_, velocities_, factors, row_);
      }
    }
  }
  /// The first of them is in row_.
  JFPX_ROW void solve_friction_rows(const Real* factors, LateResidual* late) {
    Real contact[kRowImpulse + 1];
    contact[kRowImpulse] = pressure_;
    if (!(0 < pressure_)) return;
    for (std::uint32_t k = 0; k < program_.directions; ++k) {
      Real* const at = group_.friction_at(place_.row, k);
      if (k > 0) copy_row<kFrictionFields>(at, row_);
      solve_friction<WalkLane, kFactors>(bodies_, velocities_, factors, contact, row_, late);
      at[kRowImpulse] = row_[kRowImpulse];
    }
  }
  JFPX_ROW void solve_rolling_friction_rows(const Real* factors, LateResidual* late) {
    const std::uint32_t which = group_.rolling_frictions[group_.contacts[place_.row]];
    if (which == kNoRollingFriction) return;
    Real contact[kRowImpulse + 1];
    contact[kRowImpulse] = pressure_;
    Real* row =
        group_.rolling_friction_rows + std::size_t{which} * kRollingFrictionRows * kFrictionFields;
    for (std::uint32_t t = 0; t < kRollingFrictionRows; ++t, row += kFrictionFields) {
      solve_rolling_friction<WalkLane, kFactors>(bodies_, velocities_, factors, contact, row, late);
    }
  }
  JFPX_ROW void load_factors(Real* factors) const {
    const std::int32_t ids[2] = {place_.a, place_.b};
    for (int i = 0; i < 2; ++i) {
      const auto slot = static_cast<std::size_t>(ids[i] < 0 ? ~ids[i] : ids[i]);
      for (int k = 0; k < kFactorFields; ++k) {
        factors[kFactorFields * i + k] =
            group_.factors[slot * kFactorFields + static_cast<std::size_t>(k)];
      }
    }
  }

  /// To the next place, and from the last one to the next pass.
  template <class Found>
  JFPX_ROW void advance(Found* found) {
    if (order_.count - index_ > stride_) {
      index_ += stride_;
      load_place();
      return;
    }
    ++pass_;
    if (step_ == RowStep::warm_start) {
      step_ = program_.steps[0];
    } else if (++step_number_ < program_.steps_an_iteration) {
      step_ = program_.steps[step_number_];
    } else {
      found->raise(iteration_++, largest_);
      largest_ = 0;
      step_number_ = 0;
      step_ = program_.steps[0];
    }
    if (index_ != first_) {
      index_ = first_;
      load_place();
    }
  }

  const RowGroupArrays& group_;
  const RowProgram& program_;
  const RowOrderArrays& order_;
  std::uint32_t first_, stride_, index_, passes_;
  std::uint32_t pass_ = 0, step_number_ = 0, iteration_ = 0;
  RowStep step_;
  Place place_;
  WalkBody bodies_[2];
  std::uint32_t moves_a_, moves_b_, turn_a_, turn_b_;
  bool has_a_, has_b_;
  Real velocities_[2 * kVelocityFields];
  Real row_[kContactFields];  ///< the row whose turn is awaited
  Real pressure_;             ///< impulse of its contact, in other steps than that of the contact
  Real largest_ = 0;
};

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
