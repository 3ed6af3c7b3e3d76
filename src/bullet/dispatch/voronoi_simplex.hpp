/// Closest point of a simplex to the origin, equal to that of btVoronoiSimplexSolver.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btVector3.h>

#include <array>
#include <cfloat>
#include <cstddef>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace gjk {

/// Up to four differences of points of two cores. Reproduces btVoronoiSimplexSolver of Bullet 3.24,
/// operation by operation, with its default threshold (C. Ericson, "Real-Time Collision Detection",
/// 2005, section 5.1).
class VoronoiSimplex {
 public:
  bool is_empty() const { return size_ == 0; }
  bool is_full() const { return size_ == 4; }
  /// Whether a difference is equal to one of the simplex or to the one that was added last.
  bool contains(const btVector3& w) const {
    for (std::size_t i = 0; i < size_; ++i) {
      if (vertices_[i].w.distance2(w) <= kEqualDistance2) return true;
    }
    return w == last_;
  }
  void add(const btVector3& w, const btVector3& on_a, const btVector3& on_b) {
    last_ = w;
    vertices_[size_++] = {w, on_a, on_b};
  }
  /// Finds the closest point and removes the vertices that it does not depend on. Returns false if
  /// the simplex is degenerate.
  bool find_closest(btVector3* closest) {
    Weights weights;
    switch (size_) {
      case 1:
        on_a_ = vertices_[0].on_a;
        on_b_ = vertices_[0].on_b;
        *closest = on_a_ - on_b_;
        return true;
      case 2:
        find_on_segment(&weights);
        break;
      case 3:
        find_on_triangle(0, 1, 2, &weights);
        combine<3>(weights);
        break;
      default:
        switch (find_on_tetrahedron(&weights)) {
          case Place::degenerate:
            *closest = on_a_ - on_b_;  // the previous one
            return false;
          case Place::inside:
            *closest = btVector3(0, 0, 0);
            return true;
          case Place::outside:
            break;
        }
        combine<4>(weights);
        break;
    }
    *closest = on_a_ - on_b_;
    reduce(weights);
    return weights.of[0] >= 0 && weights.of[1] >= 0 && weights.of[2] >= 0 && weights.of[3] >= 0;
  }
  const btVector3& closest_on_a() const { return on_a_; }
  const btVector3& closest_on_b() const { return on_b_; }

 private:
  static constexpr btScalar kEqualDistance2 =
      sizeof(btScalar) == 8 ? btScalar(1e-12f) : btScalar(0.0001f);

  struct Vertex {
    btVector3 w, on_a, on_b;
  };
  /// Barycentric coordinates of the closest point, and the vertices that it depends on.
  struct Weights {
    std::array<btScalar, 4> of{};
    std::array<bool, 4> used{};
  };
  enum class Place : std::uint8_t { outside, inside, degenerate };

  void find_on_segment(Weights* weights) {
    const Vertex &from = vertices_[0], &to = vertices_[1];
    const btVector3 v = to.w - from.w;
    btScalar t = v.dot(btVector3(0, 0, 0) - from.w);
    if (t > 0) {
      const btScalar length2 = v.dot(v);
      weights->used = {t < length2, true};
      t = t < length2 ? t / length2 : btScalar(1);
    } else {
      weights->used = {true};
      t = 0;
    }
    weights->of = {1 - t, t};
    on_a_ = from.on_a + t * (to.on_a - from.on_a);
    on_b_ = from.on_b + t * (to.on_b - from.on_b);
  }

  /// Of the triangle of three vertices. Returns its closest point.
  btVector3 find_on_triangle(std::size_t i, std::size_t j, std::size_t k, Weights* weights) const {
    const btVector3 &a = vertices_[i].w, &b = vertices_[j].w, &c = vertices_[k].w;
    const btVector3 origin(0, 0, 0), ab = b - a, ac = c - a, ap = origin - a;
    const auto at = [&](btScalar x, btScalar y, btScalar z, bool by_x, bool by_y, bool by_z) {
      *weights = {};
      weights->of[i] = x;
      weights->of[j] = y;
      weights->of[k] = z;
      weights->used[i] = by_x;
      weights->used[j] = by_y;
      weights->used[k] = by_z;
    };
    const btScalar d1 = ab.dot(ap), d2 = ac.dot(ap);
    if (d1 <= 0 && d2 <= 0) {
      at(1, 0, 0, true, false, false);
      return a;
    }
    const btVector3 bp = origin - b;
    const btScalar d3 = ab.dot(bp), d4 = ac.dot(bp);
    if (d3 >= 0 && d4 <= d3) {
      at(0, 1, 0, false, true, false);
      return b;
    }
    const btScalar vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) {
      const btScalar v = d1 / (d1 - d3);
      at(1 - v, v, 0, true, true, false);
      return a + v * ab;
    }
    const btVector3 cp = origin - c;
    const btScalar d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d6 >= 0 && d5 <= d6) {
      at(0, 0, 1, false, false, true);
      return c;
    }
    const btScalar vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) {
      const btScalar w = d2 / (d2 - d6);
      at(1 - w, 0, w, true, false, true);
      return a + w * ac;
    }
    const btScalar va = d3 * d6 - d5 * d4;
    if (va <= 0 && (d4 - d3) >= 0 && (d5 - d6) >= 0) {
      const btScalar w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
      at(0, 1 - w, w, false, true, true);
      return b + w * (c - b);
    }
    const btScalar factor = btScalar(1) / (va + vb + vc);
    const btScalar v = vb * factor, w = vc * factor;
    at(1 - v - w, v, w, true, true, true);
    return a + ab * v + ac * w;
  }

  /// Whether the origin and vertex l are on different sides of the plane of the other three.
  Place side(std::size_t i, std::size_t j, std::size_t k, std::size_t l) const {
    constexpr btScalar kFlat = sizeof(btScalar) == 8 ? btScalar(1e-8) : btScalar(1e-4);
    const btVector3& a = vertices_[i].w;
    const btVector3 normal = (vertices_[j].w - a).cross(vertices_[k].w - a);
    const btScalar of_origin = (btVector3(0, 0, 0) - a).dot(normal);
    const btScalar of_vertex = (vertices_[l].w - a).dot(normal);
    if (of_vertex * of_vertex < kFlat * kFlat) return Place::degenerate;
    return of_origin * of_vertex < 0 ? Place::outside : Place::inside;
  }
  Place find_on_tetrahedron(Weights* weights) const {
    // Each face, with its vertices in Bullet's order, and the vertex opposite to it.
    constexpr std::size_t kFaces[4][4] = {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {1, 3, 2, 0}};
    Place sides[4];
    bool outside = false;
    for (int f = 0; f < 4; ++f) {
      sides[f] = side(kFaces[f][0], kFaces[f][1], kFaces[f][2], kFaces[f][3]);
      if (sides[f] == Place::degenerate) return Place::degenerate;
      outside = outside || sides[f] == Place::outside;
    }
    if (!outside) return Place::inside;
    weights->used = {true, true, true, true};
    btScalar least = FLT_MAX;
    for (int f = 0; f < 4; ++f) {
      if (sides[f] != Place::outside) continue;
      Weights of_face;
      const btVector3 point = find_on_triangle(kFaces[f][0], kFaces[f][1], kFaces[f][2], &of_face);
      const btScalar distance2 = point.dot(point);
      if (!(distance2 < least)) continue;
      least = distance2;
      *weights = of_face;
    }
    return Place::outside;
  }

  template <std::size_t kCount>
  void combine(const Weights& weights) {
    on_a_ = vertices_[0].on_a * weights.of[0];
    on_b_ = vertices_[0].on_b * weights.of[0];
    for (std::size_t i = 1; i < kCount; ++i) {
      on_a_ = on_a_ + vertices_[i].on_a * weights.of[i];
      on_b_ = on_b_ + vertices_[i].on_b * weights.of[i];
    }
  }
  /// Removes unused vertices in Bullet's order; the last one takes the place of a removed one.
  void reduce(const Weights& weights) {
    for (std::size_t i = size_; i-- > 0;) {
      if (!weights.used[i]) vertices_[i] = vertices_[--size_];
    }
  }

  Vertex vertices_[4];
  std::size_t size_ = 0;
  btVector3 last_{btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT), btScalar(BT_LARGE_FLOAT)};
  btVector3 on_a_{0, 0, 0}, on_b_{0, 0, 0};
};

}  // namespace gjk
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
