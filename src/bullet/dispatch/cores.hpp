/// Cores of Bullet's convex shapes, which are the shapes without their margins, in poses.
///
/// support(direction) returns the point of the core that is furthest along a direction, with the
/// operations of btConvexShape::localGetSupportVertexWithoutMarginNonVirtual of Bullet 3.24.
#pragma once

#include <jfpx/config.hpp>

#include <LinearMath/btTransform.h>

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
