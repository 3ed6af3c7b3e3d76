/// The separating-axis test of two polyhedra, hulls or boxes, in vectors.
#pragma once

// The restrictions of src/sphere_collider/cpu/kernels.hpp apply to this header and its kernels.
#include <jfpx/config.hpp>

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {

/// Elements of a vector of AVX2.
#if defined(JFPX_DOUBLE_PRECISION)
inline constexpr std::uint32_t kHullLanes = 4;
#else
inline constexpr std::uint32_t kHullLanes = 8;
#endif

/// A polyhedron in its own axes. Columns are padded with their first element to whole vectors.
struct HullInput {
  const Real* vertices;        ///< [m], columns x, y, z of `vertex_size` elements
  const Real* faces;           ///< of `face_size`: x, y, z of the normals, and the offsets [m]
  const Real* cosines2;        ///< by edge: (1 + cosine of the angle of its normals) / 2
  const std::uint32_t* edges;  ///< the bytes of HullEdge
  std::uint32_t vertex_count, face_count, edge_count;
  std::uint32_t vertex_size, face_size;
  Real centre[3];     ///< [m], of the ball inside the hull
  Real inner_radius;  ///< [m], of the ball
};

/// The values of detail::PolyhedronPair and of detail::find_axes().
struct HullPairInput {
  HullInput a, b;
  Real rotation[3][3];  ///< rows
  Real offset[3];       ///< [m]
  Real error, limit;    ///< [m]
};

/// The values of detail::PolyhedronAxis.
struct HullAxis {
  std::uint8_t kind;
  std::int32_t first, second;
  Real distance, error;  ///< [m]
  Real normal[3];
};
struct HullAxes {
  HullAxis of_a, widest, edges;  ///< as in detail::TestedAxes
};

/// detail::test_axes(), with the same bits.
struct HullKernels {
  bool (*test_axes)(const HullPairInput& pair, HullAxes* axes);
};
extern const HullKernels kAvx2HullKernels;

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
