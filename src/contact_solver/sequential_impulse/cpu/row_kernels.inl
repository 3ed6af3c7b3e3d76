/// Kernels of the row solver as templates over a type Simd, which the including source defines.
#include "src/contact_solver/sequential_impulse/contact_rows.hpp"
#include "src/contact_solver/sequential_impulse/cpu/row_kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

constexpr std::uint32_t kLanes = Simd::kLanes;
static_assert(kLanes <= rows::kMaxLanes);
using BlockResidual = rows::Residual<Simd>;

const std::int32_t* ids_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.ids + std::size_t{2} * kLanes * block;
}
Real* contact_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.contacts + std::size_t{rows::kContactFields} * kLanes * block;
}
Real* friction_of(const RowArrays& arrays, std::uint32_t block) {
  return arrays.frictions + std::size_t{rows::kFrictionFields} * kLanes * arrays.directions * block;
}
void reduce(const BlockResidual& sum, RowResidual* residual) {
  Real lanes[kLanes];
  Simd::store(lanes, sum.largest);
  for (const Real lane : lanes) {
    if (lane > residual->largest) residual->largest = lane;
  }
  if (Simd::any(sum.broken)) residual->broken = true;
}

unsigned set_up_contacts(const rows::RowSettings& settings, const Real* inputs, const Real* bodies,
                         const std::int32_t* ids, Real* contacts, Real* frictions, Real* second) {
  return Simd::bits(
      rows::set_up_contact<Simd>(settings, inputs, bodies, ids, contacts, frictions, second));
}
void set_up_frictions(const rows::RowSettings& settings, const Real* inputs, const Real* bodies,
                      const std::int32_t* ids, Real* frictions) {
  rows::set_up_friction<Simd>(settings, inputs, bodies, ids, frictions);
}

template <bool kFactors>
void solve_frictions(const RowArrays& arrays, std::uint32_t block, BlockResidual* sum) {
  Real* row = friction_of(arrays, block);
  for (std::uint32_t k = 0; k < arrays.directions; ++k) {
    rows::solve_friction<Simd, kFactors>(ids_of(arrays, block), arrays.velocities, arrays.factors,
                                         contact_of(arrays, block), row, sum);
    row += rows::kFrictionFields * kLanes;
  }
}

template <bool kFactors>
void sweep_warm_starts(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                       RowResidual*) {
  for (std::uint32_t i = first; i < last; ++i) {
    rows::warm_start<Simd, kFactors>(ids_of(arrays, i), arrays.velocities, arrays.factors,
                                     contact_of(arrays, i));
  }
}
template <bool kFactors>
void sweep_contacts(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                    RowResidual* residual) {
  BlockResidual sum;
  for (std::uint32_t i = first; i < last; ++i) {
    rows::solve_contact<Simd, kFactors, false>(ids_of(arrays, i), arrays.velocities, arrays.factors,
                                               contact_of(arrays, i), &sum);
  }
  reduce(sum, residual);
}
template <bool kFactors>
void sweep_frictions(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                     RowResidual* residual) {
  BlockResidual sum;
  for (std::uint32_t i = first; i < last; ++i) {
    solve_frictions<kFactors>(arrays, i, &sum);
  }
  reduce(sum, residual);
}
template <bool kFactors>
void sweep_both(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                RowResidual* residual) {
  BlockResidual sum;
  for (std::uint32_t i = first; i < last; ++i) {
    rows::solve_contact<Simd, kFactors, false>(ids_of(arrays, i), arrays.velocities, arrays.factors,
                                               contact_of(arrays, i), &sum);
    solve_frictions<kFactors>(arrays, i, &sum);
  }
  reduce(sum, residual);
}
template <bool kFactors>
void sweep_split_impulses(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                          RowResidual* residual) {
  BlockResidual sum;
  for (std::uint32_t k = first; k < last; ++k) {
    const std::uint32_t i = arrays.split_impulse_blocks[k];
    rows::solve_contact<Simd, kFactors, true>(ids_of(arrays, i), arrays.push_velocities,
                                              arrays.factors, contact_of(arrays, i), &sum);
  }
  reduce(sum, residual);
}

template <bool kFactors>
void sweep_rolling_frictions(const RowArrays& arrays, std::uint32_t first, std::uint32_t last,
                             RowResidual* residual) {
  BlockResidual sum;
  for (std::uint32_t k = first; k < last; ++k) {
    const std::uint32_t i = arrays.rolling_friction_blocks[k];
    Real* row = arrays.rolling_frictions +
                std::size_t{rows::kFrictionFields} * kLanes * kRollingFrictionRows * k;
    for (std::uint32_t t = 0; t < kRollingFrictionRows; ++t) {
      rows::solve_rolling_friction<Simd, kFactors>(
          ids_of(arrays, i), arrays.velocities, arrays.factors, contact_of(arrays, i), row, &sum);
      row += rows::kFrictionFields * kLanes;
    }
  }
  reduce(sum, residual);
}

constexpr RowKernels kKernels = {
    kLanes,
    set_up_contacts,
    set_up_frictions,
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
