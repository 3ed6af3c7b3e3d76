/// The arrays of a hull, computed from its vertices and faces.
#pragma once

#include <jfpx/hull.hpp>

#include "src/collide/hull/polyhedron.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// @param vertices   [m], those of the faces, at most Hull::kMaxVertices, in any order
/// @param polyhedron the same vertices on their grid, and the faces: closed, with at least three
///                   faces at each vertex
HullData make_hull_data(std::span<const Vec3> vertices, const HullGrid& grid,
                        const Polyhedron& polyhedron);

/// Least offset of a plane with every vertex on it or behind it, in exact arithmetic.
Real least_offset(const Vec3& normal, std::span<const Vec3> vertices);

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
