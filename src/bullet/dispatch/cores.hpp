/// Cores of Bullet's convex shapes, which are the shapes without their margins, in poses.
///
/// support(direction) returns the point of the core that is furthest along a direction, with the
/// operations of btConvexShape::localGetSupportVertexWithoutMarginNonVirtual of Bullet 3.24.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

#include <bit>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The center of a sphere.
class CenterCore {
 public:
  explicit CenterCore(const btTransform& pose) : center_(pose(btVector3(0, 0, 0))) {}
  btVector3 support(const btVector3&) const { return center_; }

 private:
  btVector3 center_;
};

/// Four numbers in vectors of 128 bits.
struct FourScalars {
  using Vector = btScalar __attribute__((vector_size(16)));
  static constexpr int kPerVector = 16 / sizeof(btScalar);
  static constexpr int kVectors = 4 / kPerVector;

  FourScalars() = default;
  FourScalars(btScalar x, btScalar y, btScalar z) {
    const btScalar values[4] = {x, y, z, 0};
    for (int i = 0; i < 4; ++i) parts[i / kPerVector][i % kPerVector] = values[i];
  }
  btScalar operator[](int i) const { return parts[i / kPerVector][i % kPerVector]; }
  FourScalars operator*(btScalar factor) const {
    FourScalars result;
    for (int i = 0; i < kVectors; ++i) result.parts[i] = parts[i] * factor;
    return result;
  }
  FourScalars operator+(const FourScalars& other) const {
    FourScalars result;
    for (int i = 0; i < kVectors; ++i) result.parts[i] = parts[i] + other.parts[i];
    return result;
  }

  Vector parts[kVectors];
};

/// v * basis for many vectors, with the operations of btMatrix3x3.
class TransposedProduct {
 public:
  explicit TransposedProduct(const btMatrix3x3& basis)
      : rows_{row(basis[0]), row(basis[1]), row(basis[2])} {}
  FourScalars operator()(const btVector3& v) const {
    return rows_[0] * v.x() + rows_[1] * v.y() + rows_[2] * v.z();
  }

 private:
  static FourScalars row(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
  FourScalars rows_[3];
};

class BoxCore {
 public:
  /// @param half half extents, margin excluded
  BoxCore(const btTransform& pose, const btVector3& half) : to_local_(pose.getBasis()) {
    for (unsigned i = 0; i < 8; ++i) {
      corners_[i] =
          pose(btVector3((i & 1) != 0 ? half.x() : -half.x(), (i & 2) != 0 ? half.y() : -half.y(),
                         (i & 4) != 0 ? half.z() : -half.z()));
    }
  }
  btVector3 support(const btVector3& direction) const {
    const FourScalars local = to_local_(direction);
    return corners_[(local[0] >= 0 ? 1 : 0) + (local[1] >= 0 ? 2 : 0) + (local[2] >= 0 ? 4 : 0)];
  }

 private:
  TransposedProduct to_local_;
  btVector3 corners_[8];
};

/// The axis of a capsule.
class CapsuleCore {
 public:
  CapsuleCore(const btTransform& pose, int up_axis, btScalar half_height)
      : to_local_(pose.getBasis()) {
    for (int end = 0; end < 2; ++end) {
      ends_[end] = btVector3(0, 0, 0);
      ends_[end][up_axis] = end == 0 ? half_height : -half_height;
      placed_[end] = pose(ends_[end]);
    }
    neither_ = pose(btVector3(0, 0, 0));
  }
  btVector3 support(const btVector3& direction) const {
    const FourScalars local = to_local_(direction);
    btVector3 vec(local[0], local[1], local[2]);
    const btScalar length2 = vec.length2();
    if (length2 < SIMD_EPSILON * SIMD_EPSILON) {
      vec.setValue(1, 0, 0);
    } else {
      vec *= btScalar(1) / btSqrt(length2);
    }
    const btScalar top = vec.dot(ends_[0]), bottom = vec.dot(ends_[1]);
    if (bottom > (top > -BT_LARGE_FLOAT ? top : -BT_LARGE_FLOAT)) return placed_[1];
    return top > -BT_LARGE_FLOAT ? placed_[0] : neither_;
  }

 private:
  TransposedProduct to_local_;
  btVector3 ends_[2], placed_[2], neither_;
};

class CylinderCore {
 public:
  /// @param half half extents, margin excluded
  CylinderCore(const btTransform& pose, int up_axis, const btVector3& half)
      : to_local_(pose.getBasis()),
        pose_(pose),
        up_(up_axis),
        x_(up_axis == 0 ? 1 : 0),
        z_(up_axis == 2 ? 1 : 2),
        radius_(half[x_]),
        half_height_(half[up_axis]) {}
  btVector3 support(const btVector3& direction) const {
    const FourScalars local = to_local_(direction);
    const btVector3 v(local[0], local[1], local[2]);
    const btScalar s = btSqrt(v[x_] * v[x_] + v[z_] * v[z_]);
    btVector3 point;
    if (s != btScalar(0)) {
      const btScalar d = radius_ / s;
      point[x_] = v[x_] * d;
      point[z_] = v[z_] * d;
    } else {
      point[x_] = radius_;
      point[z_] = 0;
    }
    point[up_] = v[up_] < btScalar(0) ? -half_height_ : half_height_;
    return pose_(point);
  }

 private:
  TransposedProduct to_local_;
  btTransform pose_;
  int up_, x_, z_;
  btScalar radius_, half_height_;
};

/// The points of a hull, by coordinate.
class HullPoints {
 public:
  /// Returns false if there are too many or no points.
  bool load(const btVector3* points, int count) {
    if (count < 1 || count > kMost) return false;
    vectors_ = (count + 2 * kLanes - 1) / (2 * kLanes) * 2;
    for (int i = 0; i < vectors_ * kLanes; ++i) {
      const btVector3& point = points[i < count ? i : 0];
      x_[i / kLanes][i % kLanes] = point.x();
      y_[i / kLanes][i % kLanes] = point.y();
      z_[i / kLanes][i % kLanes] = point.z();
    }
    return true;
  }
  /// The index of btVector3::maxDot(): of the first point with the largest dot product.
  int furthest(const btVector3& direction) {
    const Vector least = Vector{} - SIMD_INFINITY;
    Vector even = least, odd = least;  // two chains of dependent operations
    const auto dots_of = [&](int i) {
      dots_[i] = x_[i] * direction.x() + y_[i] * direction.y() + z_[i] * direction.z();
      return dots_[i];
    };
    for (int i = 0; i < vectors_; i += 2) {
      even = larger(dots_of(i), even);
      odd = larger(dots_of(i + 1), odd);
    }
    even = larger(odd, even);
    btScalar largest = -SIMD_INFINITY;
    for (int lane = 0; lane < kLanes; ++lane) {
      if (even[lane] > largest) largest = even[lane];
    }
    if (!(largest > -SIMD_INFINITY)) return 0;
    return first_equal(largest);
  }

 private:
  using Vector = FourScalars::Vector;
  static constexpr int kLanes = FourScalars::kPerVector;
  static constexpr int kMost = 128;

  /// `b` if a lane is not a number.
  static Vector larger(const Vector& a, const Vector& b) { return a > b ? a : b; }
  /// The index of the first dot product with a value that one of them has. Without branches, whose
  /// direction cannot be predicted.
  int first_equal(btScalar value) const {
    constexpr int kPerWord = 64 / kLanes;
    for (int begin = 0;; begin += kPerWord) {
      std::uint64_t equal = 0;
      for (int i = begin; i < vectors_ && i < begin + kPerWord; ++i) {
        equal |= std::uint64_t{lanes_equal(dots_[i], value)} << ((i - begin) * kLanes);
      }
      if (equal != 0) return begin * kLanes + std::countr_zero(equal);
    }
  }
  /// A bit for each lane.
  static unsigned lanes_equal(const Vector& v, btScalar value) {
    const Vector values = Vector{} + value;
#if defined(__SSE2__)
    if constexpr (sizeof(btScalar) == 4) {
      return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(v == values)));
    } else {
      return static_cast<unsigned>(_mm_movemask_pd(reinterpret_cast<__m128d>(v == values)));
    }
#else
    const auto equal = v == values;
    unsigned bits = 0;
    for (int lane = 0; lane < kLanes; ++lane) bits |= equal[lane] != 0 ? 1u << lane : 0u;
    return bits;
#endif
  }

  Vector x_[kMost / kLanes], y_[kMost / kLanes], z_[kMost / kLanes];
  Vector dots_[kMost / kLanes];  // not on the stack, which may be small
  int vectors_ = 0;              ///< even
};

class HullCore {
 public:
  /// @param points,scaling of the shape  @param by_coordinate the same points
  HullCore(const btTransform& pose, const btVector3* points, const btVector3& scaling,
           HullPoints* by_coordinate)
      : to_local_(pose.getBasis()),
        pose_(pose),
        points_(points),
        scaling_(scaling),
        by_coordinate_(by_coordinate) {}
  btVector3 support(const btVector3& direction) const {
    const FourScalars local = to_local_(direction);
    const int i = by_coordinate_->furthest(btVector3(local[0], local[1], local[2]) * scaling_);
    return pose_(points_[i] * scaling_);
  }

 private:
  TransposedProduct to_local_;
  btTransform pose_;
  const btVector3* points_;
  btVector3 scaling_;
  HullPoints* by_coordinate_;
};

class TriangleCore {
 public:
  TriangleCore(const btTransform& pose, const TransposedProduct& to_local,
               const btVector3* vertices)
      : to_local_(to_local),
        x_(FourScalars(vertices[0].x(), vertices[1].x(), vertices[2].x())),
        y_(FourScalars(vertices[0].y(), vertices[1].y(), vertices[2].y())),
        z_(FourScalars(vertices[0].z(), vertices[1].z(), vertices[2].z())),
        placed_{pose(vertices[0]), pose(vertices[1]), pose(vertices[2])} {}
  btVector3 support(const btVector3& direction) const {
    const FourScalars local = to_local_(direction);
    const FourScalars dots = x_ * local[0] + y_ * local[1] + z_ * local[2];
    return placed_[btVector3(dots[0], dots[1], dots[2]).maxAxis()];
  }
  const btVector3& vertex(int i) const { return placed_[i]; }

 private:
  const TransposedProduct& to_local_;
  FourScalars x_, y_, z_;
  btVector3 placed_[3];
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
