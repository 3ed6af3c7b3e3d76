/// Vector kernels of the soft step for rows of joints with frames. Without AVX2, rows are solved
/// one by one.
///
/// Sweeps read bundles, as those of manifolds do: see manifold_sweep.hpp. A bundle also keeps what
/// depends on the orientations of the bodies only: they change once a substep, and joints have
/// several sweeps a substep.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Vectors of the rows of a bundle. A Vec3 has three vectors, a Quat four, w first, and a Mat3
/// nine.
namespace frame_vector {
// Members of soft_step::FrameRow.
inline constexpr std::size_t kCentres = 0;
inline constexpr std::size_t kAnchorA = 3;
inline constexpr std::size_t kAnchorB = 6;
inline constexpr std::size_t kLinear = 9;                              ///< impulses
inline constexpr std::size_t kImpulse = 12, kSpunA = 15, kSpunB = 18;  ///< sums
inline constexpr std::size_t kTurnedA = 21;
inline constexpr std::size_t kTurnedB = 24;
// At the current orientations of the bodies, without the rotations by rows of this substep.
inline constexpr std::size_t kOrientationA = 27, kOrientationB = 31;
inline constexpr std::size_t kArmA = 35, kArmB = 38;          ///< [m], world axes, to the anchors
inline constexpr std::size_t kInertiaA = 41, kInertiaB = 50;  ///< turned_inertia()
// Not of plain joints: members of FrameRow, and FrameParameters.
inline constexpr std::size_t kAxesA = 59, kAxesB = 63;
inline constexpr std::size_t kAngular = 67, kMotor = 70;            ///< impulses
inline constexpr std::size_t kLower = 73, kUpper = 74, kCone = 75;  ///< impulses
inline constexpr std::size_t kLowerSine = 76, kUpperSine = 77;
inline constexpr std::size_t kLowerCosine = 78, kUpperCosine = 79;
inline constexpr std::size_t kConeSine = 80, kConeCosine = 81;
inline constexpr std::size_t kMotorSpeed = 82, kMotorLimit = 83, kFrictionTorque = 84;
// Of springs of the rotation. The errors are those of this substep.
inline constexpr std::size_t kStiffness = 85, kDamping = 86;
inline constexpr std::size_t kTargetTwist = 87;
inline constexpr std::size_t kAngularError = 91;
inline constexpr std::size_t kCount = 94;
}  // namespace frame_vector

/// Numbers of a bundle. The bodies of an unused lane are those of a used one. Sets of lanes have a
/// bit for each lane.
struct FrameNumbers {
  std::uint32_t a[kBundle], b[kBundle];  ///< bodies; b of a joint with the world is a
  std::uint32_t used;                    ///< lanes with a row
  std::uint32_t left;                    ///< with a row that the kernels do not solve
  std::uint32_t is_of_world;             ///< b is the world
  std::uint32_t is_flipped;              ///< FrameRow::is_flipped
  std::uint32_t has_axes;                ///< not FrameParameters::is_plain
  std::uint32_t locked[3];               ///< angular degrees of freedom that are constant
  std::uint32_t sprung[3];               ///< those with a spring
  std::uint32_t has_motor, has_friction, has_limits, has_cone;  ///< of the rotation
};

/// Rows of joints whose bodies a are different. Bodies b are different from them and each other, or
/// are fixed.
struct FrameSweep {
  FrameNumbers* numbers;
  Real* rows;                     ///< frame_vector::kCount vectors of each bundle
  Real* bodies;                   ///< SolverBody
  const Real* orientation;        ///< Quat, by body, now
  const Real* start_orientation;  ///< Quat, by body, at the start of the step
  const Real* inverse_inertia;    ///< Mat3, by body, world axes, at the start of the step
  Real h, inverse_h;
  Real correction;       ///< soft_step::kJointCorrection
  Real most_correction;  ///< soft_step::most_correction()
  Real most_turn;        ///< soft_step::kMostTurn
  Real epsilon;          ///< kEpsilon
  bool starts;           ///< whether the sweep is the first one of a substep
};

/// Processes the rows [first, last) like the functions of frame_row.hpp, except those that a bundle
/// leaves. Calls for rows of the same bundle must not be concurrent.
/// @param left receives the skipped rows, at most last - first
/// @returns the number of skipped rows
using FrameSweepFunction = std::size_t (*)(const FrameSweep& sweep, std::size_t first,
                                           std::size_t last, std::uint32_t* left);

/// Starts a step: computes the vectors of the bundles [first, last) that depend on orientations.
using StartFrames = void (*)(const FrameSweep& sweep, std::size_t first, std::size_t last);

struct FrameSweepKernels {
  StartFrames start;
  FrameSweepFunction warm_start;
  FrameSweepFunction solve[2];  ///< index 1: with bias
};

/// Index 1: with fixed bodies b.
extern const FrameSweepKernels kAvx2FrameSweep[2];

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
