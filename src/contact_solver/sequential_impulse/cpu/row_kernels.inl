/// Kernels of the row solver as templates over a type Simd, which the including source defines.
#include "src/contact_solver/sequential_impulse/contact_rows.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_kernels.hpp"

#include <float.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

constexpr std::uint32_t kLanes = Simd::kLanes;
static_assert(kLanes <= rows::kMaxLanes);

/// The largest residual of a sweep, or one that is large enough.
struct BlockResidual {
  rows::Residual<Simd> sum;
  Real enough;
  bool is_exact, is_enough;

  explicit BlockResidual(const RowResidual& residual)
      : enough(residual.enough),
        is_exact(residual.is_exact),
        is_enough(!is_exact && residual.largest > enough) {}
  void add(Simd::Vec impulse, Simd::Vec inverse, Simd::Mask active) {
    if (is_enough) return;
    sum.add(impulse, inverse, active);
    is_enough = !is_exact && Simd::any(Simd::less(Simd::set(enough), sum.largest));
  }
  void store(RowResidual* residual) const {
    Real lanes[kLanes];
    Simd::store(lanes, sum.largest);
    for (const Real lane : lanes) {
      if (lane > residual->largest) residual->largest = lane;
    }
    if (Simd::any(sum.broken)) residual->broken = true;
  }
};

const std::int32_t* ids_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.ids + std::size_t{2} * kLanes * block;
}
Real* contact_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.contacts + std::size_t{rows::kContactFields} * kLanes * block;
}
Real* friction_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.frictions + std::size_t{rows::kFrictionFields} * kLanes * arrays.directions * block;
}
/// Whether all lanes are at least the smallest normal number, so that 1 divided by one is finite.
bool is_normal(const Real* field) {
  constexpr Real kSmallest = sizeof(Real) == 4 ? Real(FLT_MIN) : Real(DBL_MIN);
  const auto magnitude = Simd::absolute(Simd::load(field));
  return !Simd::any(Simd::negate_mask(Simd::less_equal(Simd::set(kSmallest), magnitude)));
}

ContactSetup set_up_contacts(const rows::RowSettings& settings, const Real* inputs,
                             const Real* bodies, const std::int32_t* ids, Real* contacts,
                             Real* frictions, Real* second) {
  const auto has_second =
      rows::set_up_contact<Simd>(settings, inputs, bodies, ids, contacts, frictions, second);
  const auto split = Simd::load(contacts + rows::kRowSplitRhs * kLanes);
  return {Simd::bits(has_second), Simd::bits(Simd::differs(split, Simd::set(0))),
          is_normal(contacts + rows::kRowInverse * kLanes)};
}
bool set_up_frictions(const rows::RowSettings& settings, const Real* inputs, const Real* bodies,
                      const std::int32_t* ids, Real* frictions) {
  rows::set_up_friction<Simd>(settings, inputs, bodies, ids, frictions);
  return is_normal(frictions + rows::kRowInverse * kLanes);
}
void set_up_rolling_axes(const Real* normal, Real* rows) {
  rows::set_up_rolling_axes<Simd>(normal, rows);
}
bool set_up_rolling_frictions(const Real* bodies, const std::int32_t* ids, Real* rows) {
  rows::set_up_rolling_frictions<Simd>(bodies, ids, rows);
  bool is_regular = true;
  for (std::uint32_t t = 0; t < rows::kRollingRows; ++t) {
    is_regular &= is_normal(rows + (t * rows::kRollingFields + rows::kRollingInverse) * kLanes);
  }
  return is_regular;
}

/// Whether rows move any of the bodies.
bool moves_any(const std::int32_t* ids) {
  std::int32_t all = -1;  // the sign is set if that of each id is
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) all &= ids[lane];
  return all >= 0;
}
/// Calls f(MovedBodies) with the bodies of a block that rows move. The bodies on one side of
/// most blocks are fixed, where a terrain or a floor is.
template <class F>
[[gnu::always_inline]] inline void visit_moved(const std::int32_t* ids, const F& f) {
  if (!moves_any(ids)) {
    f(rows::MovedBodies<false, true>());
  } else if (!moves_any(ids + kLanes)) {
    f(rows::MovedBodies<true, false>());
  } else {
    f(rows::BothMoved());
  }
}

template <bool kFactors, class Moved>
void solve_frictions(const RowArrays& arrays, std::uint32_t block, BlockResidual* sum) {
  Real* row = friction_of(arrays, block);
  for (std::uint32_t k = 0; k < arrays.directions; ++k) {
    rows::solve_friction<Simd, kFactors, Moved>(ids_of(arrays, block), arrays.velocities,
                                                arrays.factors, contact_of(arrays, block), row,
                                                sum);
    row += rows::kFrictionFields * kLanes;
  }
}

template <bool kFactors>
void sweep_warm_starts(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                       RowResidual*) {
  for (std::uint32_t i = first; i < last; ++i) {
    visit_moved(ids_of(arrays, i), [&](auto moved) {
      rows::warm_start<Simd, kFactors, decltype(moved)>(ids_of(arrays, i), arrays.velocities,
                                                        arrays.factors, contact_of(arrays, i));
    });
  }
}
template <bool kFactors>
void sweep_contacts(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                    RowResidual* residual) {
  BlockResidual sum(*residual);
  for (std::uint32_t i = first; i < last; ++i) {
    visit_moved(ids_of(arrays, i), [&](auto moved) {
      rows::solve_contact<Simd, kFactors, false, decltype(moved)>(
          ids_of(arrays, i), arrays.velocities, arrays.factors, contact_of(arrays, i), &sum);
    });
  }
  sum.store(residual);
}
template <bool kFactors>
void sweep_frictions(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                     RowResidual* residual) {
  BlockResidual sum(*residual);
  for (std::uint32_t i = first; i < last; ++i) {
    visit_moved(ids_of(arrays, i),
                [&](auto moved) { solve_frictions<kFactors, decltype(moved)>(arrays, i, &sum); });
  }
  sum.store(residual);
}
template <bool kFactors>
void sweep_both(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                RowResidual* residual) {
  BlockResidual sum(*residual);
  for (std::uint32_t i = first; i < last; ++i) {
    visit_moved(ids_of(arrays, i), [&](auto moved) {
      rows::solve_contact<Simd, kFactors, false, decltype(moved)>(
          ids_of(arrays, i), arrays.velocities, arrays.factors, contact_of(arrays, i), &sum);
      solve_frictions<kFactors, decltype(moved)>(arrays, i, &sum);
    });
  }
  sum.store(residual);
}
template <bool kFactors>
void sweep_split_impulses(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                          RowResidual* residual) {
  BlockResidual sum(*residual);
  for (std::uint32_t k = first; k < last; ++k) {
    const std::uint32_t i = arrays.split_impulse_blocks[k];
    visit_moved(ids_of(arrays, i), [&](auto moved) {
      rows::solve_contact<Simd, kFactors, true, decltype(moved)>(
          ids_of(arrays, i), arrays.push_velocities, arrays.factors, contact_of(arrays, i), &sum);
    });
  }
  sum.store(residual);
}

template <bool kFactors>
void sweep_rolling_frictions(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                             RowResidual* residual) {
  BlockResidual sum(*residual);
  for (std::uint32_t k = first; k < last; ++k) {
    const std::uint32_t i = arrays.rolling_friction_blocks[k];
    Real* const of_block = arrays.rolling_frictions +
                           std::size_t{rows::kRollingRows * rows::kRollingFields} * kLanes * i;
    visit_moved(ids_of(arrays, i), [&](auto moved) {
      rows::solve_rolling_frictions<Simd, kFactors, decltype(moved)>(
          ids_of(arrays, i), arrays.velocities, arrays.factors, contact_of(arrays, i), of_block,
          &sum);
    });
  }
  sum.store(residual);
}

constexpr RowKernels kKernels = {
    kLanes,
    set_up_contacts,
    set_up_frictions,
    set_up_rolling_axes,
    set_up_rolling_frictions,
    {sweep_warm_starts<false>, sweep_warm_starts<true>},
    {sweep_contacts<false>, sweep_contacts<true>},
    {sweep_frictions<false>, sweep_frictions<true>},
    {sweep_both<false>, sweep_both<true>},
    {sweep_split_impulses<false>, sweep_split_impulses<true>},
    {sweep_rolling_frictions<false>, sweep_rolling_frictions<true>},
};

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
