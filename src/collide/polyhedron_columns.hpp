/// The vertices, faces and edges of a polyhedron in columns, for kernels with vectors.
#pragma once

#include "src/collide/cpu/hull_kernels.hpp"
#include "src/collide/polyhedron.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Elements of a column: whole vectors.
constexpr std::uint32_t padded_to_lanes(std::uint32_t count) {
  return (count + cpu::kHullLanes - 1) / cpu::kHullLanes * cpu::kHullLanes;
}

/// The columns of the vertices, of the faces and of the edges, one after the other, and the edges
/// as in cpu::HullInput.
struct PolyhedronColumns {
  std::vector<Real> columns;
  std::vector<std::uint32_t> edges;

  template <class P>
  explicit PolyhedronColumns(const P& polyhedron) {
    const auto point = [&](int i) {
      const Vec3 v = polyhedron.vertex(i);
      return std::array{v.x, v.y, v.z};
    };
    const auto plane = [&](int i) {
      const Vec3 n = polyhedron.face_normal(i);
      return std::array{n.x, n.y, n.z, polyhedron.face_offset(i)};
    };
    const auto cosine2 = [&](int i) {
      const PolyhedronEdge edge = polyhedron.edge(i);
      const Vec3 u = polyhedron.face_normal(edge.face);
      const Vec3 v = polyhedron.face_normal(edge.other_face);
      return std::array{(1 + dot(u, v)) * Real(0.5)};
    };
    const auto bytes = [&](int i) {
      const PolyhedronEdge edge = polyhedron.edge(i);
      return std::array{static_cast<std::uint32_t>(edge.a | edge.b << 8 | edge.face << 16) |
                        static_cast<std::uint32_t>(edge.other_face) << 24};
    };
    append(polyhedron.vertex_count(), point, &columns);
    append(polyhedron.face_count(), plane, &columns);
    append(polyhedron.edge_count(), cosine2, &columns);
    append(polyhedron.edge_count(), bytes, &edges);
  }

 private:
  /// @param values function of an element: array of its columns
  template <class Values, class Value>
  static void append(int count, const Values& values, std::vector<Value>* columns) {
    const auto size = static_cast<int>(padded_to_lanes(static_cast<std::uint32_t>(count)));
    for (std::size_t k = 0; k < values(0).size(); ++k) {
      for (int i = 0; i < size; ++i) columns->push_back(values(i < count ? i : 0)[k]);
    }
  }
};

/// A polyhedron as input of a kernel. @tparam P HullPolyhedron in host memory, or BoxPolyhedron
template <class P>
class KernelInput;

template <>
class KernelInput<HullPolyhedron> {
 public:
  explicit KernelInput(const HullPolyhedron& polyhedron) : hull_(*polyhedron.hull) {}
  cpu::HullInput input() const {
    const std::uint32_t vertex_size = padded_to_lanes(hull_.vertex_count);
    const std::uint32_t face_size = padded_to_lanes(hull_.face_count);
    const Real* const faces = hull_.columns + 3 * vertex_size;
    const Vec3& c = hull_.centre;
    return {.vertices = hull_.columns,
            .faces = faces,
            .cosines2 = faces + 4 * face_size,
            .edges = hull_.packed_edges,
            .vertex_count = hull_.vertex_count,
            .face_count = hull_.face_count,
            .edge_count = hull_.edge_count,
            .vertex_size = vertex_size,
            .face_size = face_size,
            .centre = {c.x, c.y, c.z},
            .inner_radius = hull_.least_half_width};
  }

 private:
  const HullView& hull_;
};

template <>
class KernelInput<BoxPolyhedron> {
 public:
  explicit KernelInput(const BoxPolyhedron& box) : inner_radius_(box.inner_radius()) {
    const Real* const unit = unit_box().columns.data();
    for (std::uint32_t i = 0; i < kVertexReals; ++i) {
      columns_[i] = unit[i] * box.half[static_cast<int>(i / kVertices)];
    }
    for (std::uint32_t i = kVertexReals; i < kReals; ++i) columns_[i] = unit[i];
    for (std::uint32_t i = 0; i < kFaces; ++i) {
      columns_[kVertexReals + 3 * kFaces + i] = box.face_offset(i < 6 ? static_cast<int>(i) : 0);
    }
  }
  cpu::HullInput input() const {
    return {.vertices = columns_,
            .faces = columns_ + kVertexReals,
            .cosines2 = unit_box().columns.data() + kReals,
            .edges = unit_box().edges.data(),
            .vertex_count = 8,
            .face_count = 6,
            .edge_count = 12,
            .vertex_size = kVertices,
            .face_size = kFaces,
            .centre = {0, 0, 0},
            .inner_radius = inner_radius_};
  }

 private:
  static constexpr std::uint32_t kVertices = padded_to_lanes(8), kFaces = padded_to_lanes(6),
                                 kVertexReals = 3 * kVertices, kReals = kVertexReals + 4 * kFaces;
  static const PolyhedronColumns& unit_box() {
    static const PolyhedronColumns columns(BoxPolyhedron{{1, 1, 1}});
    return columns;
  }

  Real columns_[kReals];
  Real inner_radius_;
};

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
