/// Vector kernels of the soft step for rows of manifolds. Without AVX2, rows are solved one by one.
#pragma once

#include "src/contact_solver/soft_step/cpu/sweep_layout.hpp"

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
inline constexpr std::size_t kStride = sizeof(Real) == 4 ? 60 : 56;
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

/// Rows of contacts whose bodies a are different. Bodies b are different from them and each other,
/// or are fixed.
struct ManifoldSweep {
  Real* rows;    ///< ManifoldRow
  Real* points;  ///< PointRow
  Real* bodies;  ///< SolverBody
  SweepConstants constants;
  SweepSoftness softness;
};

/// Processes the rows [first, last) like the functions of manifold_row.hpp, except rows with
/// rolling or spinning friction.
/// @param left receives the skipped rows, at most last - first
/// @returns the number of skipped rows
using ManifoldSweepFunction = std::size_t (*)(const ManifoldSweep& sweep, std::size_t first,
                                              std::size_t last, std::uint32_t* left);

struct ManifoldSweepKernels {
  ManifoldSweepFunction warm_start;
  ManifoldSweepFunction solve[2];  ///< index 1: with bias
};

/// Index 1: with fixed bodies b.
extern const ManifoldSweepKernels kAvx2ManifoldSweep[2];

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
