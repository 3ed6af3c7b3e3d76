/// Vector kernels of the soft step for rows of two spheres. Without AVX2, rows are solved one by
/// one.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Quadruples of Reals in a SphereRow.
namespace sphere_row_quad {
inline constexpr std::size_t kImpulses = 0;  ///< friction impulse, normal impulse
inline constexpr std::size_t kNormal = 4;    ///< normal, distance
inline constexpr std::size_t kFriction = 8;  ///< friction, arm a, arm b, normal mass
inline constexpr std::size_t kTangentMass = 12;
inline constexpr std::size_t kBodies = 14;  ///< the numbers of both bodies, 32 bits each
}  // namespace sphere_row_quad

/// Rows of pairs of movable spheres without common bodies.
struct SphereSweep {
  Real* rows;    ///< SphereRow
  Real* bodies;  ///< SolverBody
  SweepConstants constants;
  Real restitution_threshold;  ///< StepConstants::restitution_threshold
  SweepSoftness balls, deep_balls;
  Real deep_penetration;  ///< soft_step::kDeepPenetration
};

/// Processes the rows [first, last) like the functions of sphere_row.hpp, but skips some rows.
/// @param left receives the skipped rows, at most last - first
/// @returns the number of skipped rows
using SphereSweepFunction = std::size_t (*)(const SphereSweep& sweep, std::size_t first,
                                            std::size_t last, std::uint32_t* left);

struct SphereSweepKernels {
  SphereSweepFunction warm_start;
  /// Index 1: with bias. Skip rows whose bodies may rebound.
  SphereSweepFunction solve[2];
};

extern const SphereSweepKernels kAvx2SphereSweep;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
