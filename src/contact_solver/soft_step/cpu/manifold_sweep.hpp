/// Vector kernels of the soft step for rows of manifolds. Without AVX2, rows are solved one by one.
///
/// Sweeps read bundles (Nordby, bepuphysics2, 2018): the rows of the lanes of a vector side by
/// side, so that no sweep transposes them. A bundle holds consecutive rows from a multiple of
/// kBundle on.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Offsets in a ManifoldRow [Reals]. A lever has 12 Reals.
namespace manifold_row_offset {
/// Four numbers of 32 bits: bodies a and b, first point, number of points.
inline constexpr std::size_t kNumbers = 0;
inline constexpr std::size_t kNormal = 16 / sizeof(Real);  ///< normal, friction
inline constexpr std::size_t kTangent = kNormal + 4;       ///< tangent, twist arm
inline constexpr std::size_t kBitangent = kNormal + 8;     ///< bitangent, twist mass
inline constexpr std::size_t kLeverX = kNormal + 12;
inline constexpr std::size_t kLeverY = kNormal + 24;
inline constexpr std::size_t kTwist = kNormal + 36;             ///< twist a and b, xx, xy
inline constexpr std::size_t kFrictionImpulses = kNormal + 44;  ///< x, y, twist, then yy
inline constexpr std::size_t kRolling = kNormal + 48;  ///< slip mass, rolling and spinning friction
inline constexpr std::size_t kIsJointed = kNormal + 54;  ///< a number of 32 bits
inline constexpr std::size_t kStride = 60;
}  // namespace manifold_row_offset

/// Largest number of points of a row.
inline constexpr unsigned kMostPoints = 8;

/// Quadruples of Reals in a PointRow.
namespace point_row_quad {
inline constexpr std::size_t kTurnA = 0;   ///< turn a, distance
inline constexpr std::size_t kTurnB = 4;   ///< turn b, normal mass
inline constexpr std::size_t kSpinA = 8;   ///< spin a, normal impulse
inline constexpr std::size_t kSpinB = 12;  ///< spin b, rebound
}  // namespace point_row_quad

/// Vectors of the rows of a bundle. A lever has 12 vectors: see soft_step::Lever.
namespace bundle_vector {
inline constexpr std::size_t kNormal = 0;
inline constexpr std::size_t kFriction = 3;
inline constexpr std::size_t kTangent = 4;
inline constexpr std::size_t kTwistArm = 7;
inline constexpr std::size_t kBitangent = 8;
inline constexpr std::size_t kTwistMass = 11;
inline constexpr std::size_t kLeverX = 12;
inline constexpr std::size_t kLeverY = 24;
inline constexpr std::size_t kTwistA = 36;
inline constexpr std::size_t kTwistB = 39;
inline constexpr std::size_t kMasses = 42;  ///< xx, xy, yy
inline constexpr std::size_t kSlipMass = 45;
inline constexpr std::size_t kImpulses = 46;  ///< friction x, friction y, twist
inline constexpr std::size_t kPointCount = 49;
/// [m^2], mean square of the distances of the points from the centre of friction, or 0
inline constexpr std::size_t kSpread = 50;
inline constexpr std::size_t kCount = 51;
}  // namespace bundle_vector

/// Vectors of a point of each row of a bundle.
namespace bundle_point {
inline constexpr std::size_t kTurnA = 0;
inline constexpr std::size_t kTurnB = 3;
inline constexpr std::size_t kSpinA = 6;
inline constexpr std::size_t kSpinB = 9;
inline constexpr std::size_t kDistance = 12;
inline constexpr std::size_t kMass = 13;
inline constexpr std::size_t kImpulse = 14;
inline constexpr std::size_t kRebound = 15;
inline constexpr std::size_t kCount = 16;
}  // namespace bundle_point

/// Vectors of a point of each row: how it shares the friction of the row.
namespace bundle_share {
inline constexpr std::size_t kArm = 0;  ///< from the centre of friction
inline constexpr std::size_t kShare = 3;
inline constexpr std::size_t kCount = 4;
}  // namespace bundle_share

/// Numbers of a bundle. The bodies of an unused lane are those of a used one.
struct BundleNumbers {
  std::uint32_t a[kBundle], b[kBundle];  ///< bodies
  std::uint32_t used;                    ///< one bit per lane with a row
  std::uint32_t rolls;                   ///< rows with rolling or spinning friction
  std::uint32_t is_jointed;              ///< rows with a body that has joints
};

/// The bundles of all rows.
struct ManifoldBundles {
  BundleNumbers* numbers;
  Real* rows;                        ///< bundle_vector::kCount vectors of each bundle
  Real* points;                      ///< bundle_point::kCount vectors of each point
  Real* shares;                      ///< bundle_share::kCount vectors of each point
  const std::uint32_t* first_point;  ///< by bundle, and the end
};

/// Rows of contacts whose bodies a are different. Bodies b are different from them and each other,
/// or are fixed.
struct ManifoldSweep {
  ManifoldBundles bundles;
  Real* bodies;  ///< SolverBody
  SweepConstants constants;
  SweepSoftness softness, jointed_softness;
};

/// Processes the rows [first, last) like the functions of manifold_row.hpp, except rows with
/// rolling or spinning friction. Calls for rows of the same bundle must not be concurrent.
/// @param left receives the skipped rows, at most last - first
/// @returns the number of skipped rows
using ManifoldSweepFunction = std::size_t (*)(const ManifoldSweep& sweep, std::size_t first,
                                              std::size_t last, std::uint32_t* left);

/// Rows that RowSetup::start_row() has started, and their bundles. A number without a row has no
/// points. The first row of a bundle exists.
struct ManifoldSetup {
  Real* rows;    ///< ManifoldRow
  Real* points;  ///< PointRow
  ManifoldBundles bundles;
  const Real* bodies;           ///< SolverBody, at the start of the step
  const Real* inverse_inertia;  ///< Mat3, by body, world axes
  Real inverse_friction_gap;    ///< of RowSetup
  Real least_weight;            ///< soft_step::kLeastWeight
  Real least_determinant;       ///< soft_step::kLeastDeterminant
  Real epsilon;                 ///< kEpsilon
  Real released;                ///< KeptImpulse::kReleased
};
/// Processes the bundles [first, last). A row has at least one point.
using BundleFunction = void (*)(const ManifoldSetup& setup, std::size_t first, std::size_t last);

/// Where the impulses of the rows of a bundle are kept.
struct KeptLanes {
  Real* impulses;                ///< KeptImpulse
  std::uint32_t first[kBundle];  ///< by row: number of its first impulse
  Real side[kBundle];            ///< by row: -1 if it exchanges the bodies of its contact, else 1
};
/// Keeps the impulses like RowSetup::store(), except those of rows with rolling or spinning
/// friction.
using KeepFunction = void (*)(const ManifoldSetup& setup, std::size_t bundle,
                              const KeptLanes& kept);

struct ManifoldSweepKernels {
  /// Completes the rows like RowSetup::fill(), and writes the bundles.
  BundleFunction complete;
  ManifoldSweepFunction warm_start;
  ManifoldSweepFunction solve[2];  ///< index 1: with bias
};

/// Index 1: with fixed bodies b.
extern const ManifoldSweepKernels kAvx2ManifoldSweep[2];
/// Writes the impulses of bundles to their rows, except those of rows with rolling or spinning
/// friction, whose impulses are in the rows.
extern const BundleFunction kAvx2UnpackManifolds;
extern const KeepFunction kAvx2KeepManifold;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
