/// Vector kernels of the soft step for bodies. Without AVX2, bodies are taken one by one.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// The bodies of a step, as arrays by body.
struct BodySweep {
  Real* bodies;                 ///< SolverBody
  Real* orientations;           ///< Quat: w, x, y, z
  Real* free;                   ///< FreeMotion
  const Real* constants;        ///< SubstepBody, of bodies with a gyroscopic term
  const Real* inertia;          ///< Mat3, body axes, up to a factor
  const Real* inverse_inertia;  ///< Mat3, body axes, up to a factor
  Real substep;                 ///< [s], BodyView::substep: of gyroscopic terms
  Real h;                       ///< [s], length of a substep
  Real shortest2;  ///< square of the length below which a Quat is normalized to the identity
  /// Largest squared rates of convergence for two and for three iterations of the gyroscopic term.
  Real two_iterations, three_iterations;
  bool is_first;  ///< whether this is the first substep
};

/// Reals per FreeMotion.
inline constexpr std::size_t kFreeStride = 6;
/// Reals per SubstepBody: two quadruples, flags and padding to a multiple of 16 bytes.
inline constexpr std::size_t kConstantsStride = 8 + 16 / sizeof(Real);

/// Moves bodies without joints like soft_step::StepBodies::move().
/// @param items numbers of different bodies
using MoveBodies = void (*)(const BodySweep& sweep, const std::uint32_t* items, std::size_t count);
/// Starts a substep of bodies with a gyroscopic term like soft_step::StepBodies::accelerate(). The
/// term of a fast rotation needs Newton's method: these bodies are left as they are.
/// @param items numbers of different bodies, all with SubstepBody::kIsFree and without a force, or
///   all without
/// @param left  receives the numbers of the bodies that are left. @returns how many there are
using AccelerateBodies = std::size_t (*)(const BodySweep& sweep, const std::uint32_t* items,
                                         std::size_t count, std::uint32_t* left);

struct BodySweepKernels {
  MoveBodies move;
  AccelerateBodies accelerate[2];  ///< [1]: of bodies with SubstepBody::kIsFree
};
extern const BodySweepKernels kAvx2BodySweep;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
