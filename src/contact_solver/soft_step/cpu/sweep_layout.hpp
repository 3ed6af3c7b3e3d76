/// Layout of the data that the kernels of the sweeps share.
#pragma once

// The includes are restricted; see src/sphere_collider/cpu/kernels.hpp for the reason. Rows and
// bodies are therefore arrays of Reals; soft_step_solver.cpp checks their layout.
#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Reals per SphereRow, per SolverBody and per PointRow.
inline constexpr std::size_t kSweepStride = 16;
/// Reals per Mat3.
inline constexpr std::size_t kMatrixStride = 9;
/// Rows of a bundle: the lanes of a vector.
inline constexpr std::size_t kBundle = 32 / sizeof(Real);

/// Quadruples of Reals in a SolverBody.
namespace solver_body_quad {
inline constexpr std::size_t kVelocity = 0;         ///< velocity, inverse mass
inline constexpr std::size_t kAngularVelocity = 4;  ///< angular velocity, inverse inertia
inline constexpr std::size_t kShift = 8;            ///< shift, unused
inline constexpr std::size_t kRotation = 12;        ///< rotation, unused
}  // namespace solver_body_quad

/// Copies of members of soft_step::StepConstants.
struct SweepConstants {
  Real h, inverse_h, push_out_speed, max_bias_velocity;
};

/// Copy of soft_step::Softness.
struct SweepSoftness {
  Real bias_rate, mass_scale, impulse_scale;
};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
