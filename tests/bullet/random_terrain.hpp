/// Random concave shapes of every kind that Bullet has, and random convex shapes to put on them.
#pragma once

#include "tests/bullet/twin_worlds.hpp"

#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>
#include <BulletCollision/CollisionShapes/btOptimizedBvh.h>
#include <BulletCollision/CollisionShapes/btScaledBvhTriangleMeshShape.h>

#include <memory>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Worlds whose own dispatcher updates every pair in batches, on a number of threads.
inline TwinOptions batch_options(unsigned threads, bool verify = false) {
  TwinOptions options;
  options.ours = [=](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(
        c, DispatcherOptions{.collider = {.backend = Backend::cpu, .threads = threads},
                             .minimum_batch = 0,
                             .verify = verify});
  };
  return options;
}

/// @param extent [m], largest magnitude of a coordinate
inline btTransform random_turned_pose(Random& random, Real extent) {
  const Vec3 p = random.uniform_in_box({-extent, -extent, -extent}, {extent, extent, extent});
  const Vec3 v = random.uniform_in_box({-1, -1, -1}, {1, 1, 1});
  const btQuaternion q(v.x, v.y, v.z, random.uniform(Real(-1), Real(1)));
  return btTransform(q.length2() > Real(0.01) ? q.normalized() : btQuaternion::getIdentity(),
                     btVector3(p.x, p.y, p.z));
}

/// Hills of `kPoints` x `kPoints` points with distance 1 around the origin, as a mesh or a height
/// field. Equal seeds give equal terrains, each with its own arrays.
class RandomTerrain {
 public:
  static constexpr int kPoints = 13;

  explicit RandomTerrain(std::uint64_t seed) {
    Random random(seed);
    up_axis_ = static_cast<int>(random.below(3));
    for (int row = 0; row < kPoints; ++row) {
      for (int column = 0; column < kPoints; ++column) {
        // Small whole numbers for heights of one byte; now and then a step, or a flat cell.
        heights_.push_back(static_cast<btScalar>(random.below(4)) / 2);
      }
    }
    random.below(2) == 0 ? make_mesh(random) : make_heights(random);
  }
  RandomTerrain(const RandomTerrain&) = delete;
  RandomTerrain& operator=(const RandomTerrain&) = delete;

  btConcaveShape* shape() { return shape_.get(); }
  bool is_mesh() const { return mesh_ != nullptr; }

  /// Changes the height of a random point. Heights of whole numbers keep theirs.
  void set_height(Random& random, btScalar height) {
    const std::size_t i = random.below(heights_.size());
    if (!is_mesh()) {
      heights_[i] = height;
    } else if (single_.empty()) {
      vertices_[3 * i + 1] = height;
    } else {
      single_[3 * i + 1] = static_cast<float>(height);
    }
  }
  /// Moves some points of a mesh and adapts its tree, or changes some heights.
  void deform(Random& random) {
    for (int k = 0; k < 5; ++k) set_height(random, random.uniform(0, Real(1.5)));
    if (!is_mesh()) return;
    const btVector3 low(-100, -100, -100), high(100, 100, 100);
    random.below(2) == 0 ? mesh_->refitTree(low, high) : mesh_->partialRefitTree(low, high);
  }

 private:
  template <class Index>
  void add_part(std::vector<Index>* indices, PHY_ScalarType type, int begin, int end) {
    const auto first = indices->size();
    for (int row = begin; row < end; ++row) {
      for (int column = 0; column + 1 < kPoints; ++column) {
        const int a = row * kPoints + column;
        for (const int i : {a, a + kPoints, a + 1, a + 1, a + kPoints, a + kPoints + 1}) {
          indices->push_back(static_cast<Index>(i));
        }
      }
    }
    btIndexedMesh part;
    part.m_numTriangles = static_cast<int>(indices->size() - first) / 3;
    part.m_triangleIndexBase = reinterpret_cast<const unsigned char*>(indices->data() + first);
    part.m_triangleIndexStride = 3 * sizeof(Index);
    part.m_numVertices = kPoints * kPoints;
    part.m_vertexBase = reinterpret_cast<const unsigned char*>(vertices_.data());
    part.m_vertexStride = 3 * sizeof(btScalar);
    if (!single_.empty()) {
      part.m_vertexType = PHY_FLOAT;
      part.m_vertexBase = reinterpret_cast<const unsigned char*>(single_.data());
      part.m_vertexStride = 3 * sizeof(float);
    }
    arrays_.addIndexedMesh(part, type);
  }

  void make_mesh(Random& random) {
    for (int row = 0; row < kPoints; ++row) {
      for (int column = 0; column < kPoints; ++column) {
        const auto i = static_cast<std::size_t>(row * kPoints + column);
        // Equal points make triangles without an area.
        const int x = random.below(20) == 0 ? column + 1 : column;
        vertices_.insert(vertices_.end(), {static_cast<btScalar>(x - kPoints / 2), heights_[i],
                                           static_cast<btScalar>(row - kPoints / 2)});
      }
    }
    if (random.below(3) == 0) single_.assign(vertices_.begin(), vertices_.end());
    constexpr std::size_t kIndices = 6 * kPoints * kPoints;
    bytes_.reserve(kIndices);
    shorts_.reserve(kIndices);
    ints_.reserve(kIndices);
    switch (random.below(4)) {
      case 0:
        add_part(&bytes_, PHY_UCHAR, 0, kPoints - 1);
        break;
      case 1:
        add_part(&shorts_, PHY_SHORT, 0, kPoints - 1);
        break;
      case 2:
        add_part(&ints_, PHY_INTEGER, 0, kPoints - 1);
        break;
      default:
        add_part(&ints_, PHY_INTEGER, 0, 4);
        add_part(&shorts_, PHY_SHORT, 4, kPoints - 1);
        break;
    }
    if (random.below(3) == 0) arrays_.setScaling(btVector3(btScalar(1.25), 1, btScalar(0.75)));
    const bool quantized = random.below(4) != 0;
    auto mesh = std::make_unique<btBvhTriangleMeshShape>(
        &arrays_, quantized, btVector3(-100, -100, -100), btVector3(100, 100, 100));
    mesh_ = mesh.get();
    mesh_->setMargin(random.below(2) == 0 ? btScalar(0) : random.uniform(0, Real(0.1)));
    constexpr btQuantizedBvh::btTraversalMode kModes[] = {
        btQuantizedBvh::TRAVERSAL_STACKLESS, btQuantizedBvh::TRAVERSAL_STACKLESS,
        btQuantizedBvh::TRAVERSAL_STACKLESS_CACHE_FRIENDLY, btQuantizedBvh::TRAVERSAL_RECURSIVE};
    mesh_->getOptimizedBvh()->setTraversalMode(kModes[random.below(4)]);
    shape_ = std::move(mesh);
    if (random.below(3) != 0) return;
    const auto factor = [&] {
      return random.uniform(Real(0.5), Real(1.5)) * (random.below(4) == 0 ? Real(-1) : Real(1));
    };
    child_ = std::move(shape_);
    const btScalar x = factor(), y = factor(), z = factor();
    shape_ = std::make_unique<btScaledBvhTriangleMeshShape>(mesh_, btVector3(x, y, z));
    if (random.below(2) == 0) shape_->setMargin(btScalar(0.04));
  }

  void make_heights(Random& random) {
    const void* data = heights_.data();
    PHY_ScalarType type = sizeof(btScalar) == 8 ? PHY_DOUBLE : PHY_FLOAT;
    switch (random.below(4)) {
      case 0:
        bytes_.assign(heights_.begin(), heights_.end());
        data = bytes_.data();
        type = PHY_UCHAR;
        break;
      case 1:
        shorts_.assign(heights_.begin(), heights_.end());
        data = shorts_.data();
        type = PHY_SHORT;
        break;
      default:
        break;
    }
    // The constructor with a type takes PHY_FLOAT for the type of btScalar.
    auto terrain = std::make_unique<btHeightfieldTerrainShape>(
        kPoints, kPoints, data, btScalar(0.75), 0, 2, up_axis_, type, random.below(2) == 0);
    terrain->setUseDiamondSubdivision(random.below(3) == 0);
    terrain->setUseZigzagSubdivision(random.below(3) == 0);
    terrain->setFlipTriangleWinding(random.below(3) == 0);
    if (random.below(2) == 0) {
      const btScalar x = random.uniform(Real(0.5), Real(1.5));
      terrain->setLocalScaling(btVector3(x, btScalar(0.75), 1));
    }
    if (random.below(2) == 0) terrain->setMargin(random.uniform(0, Real(0.1)));
    shape_ = std::move(terrain);
  }

  int up_axis_ = 1;
  std::vector<btScalar> heights_, vertices_;
  std::vector<float> single_;  // vertices of another precision
  std::vector<unsigned char> bytes_;
  std::vector<unsigned short> shorts_;
  std::vector<int> ints_;
  btTriangleIndexVertexArray arrays_;
  std::unique_ptr<btConcaveShape> child_, shape_;
  btBvhTriangleMeshShape* mesh_ = nullptr;
};

/// A subclass, whose code may do anything.
class OwnSphere final : public btSphereShape {
 public:
  using btSphereShape::btSphereShape;
};

inline btConvexHullShape* make_random_hull(Random& random, btScalar size) {
  auto* hull = new btConvexHullShape();
  const auto points = 4 + random.below(9);
  for (std::uint64_t i = 0; i < points; ++i) {
    const Vec3 p = random.uniform_in_box({-size, -size, -size}, {size, size, size});
    hull->addPoint(btVector3(p.x, p.y, p.z), false);
  }
  hull->recalcLocalAabb();
  return hull;
}

constexpr std::uint64_t kConvexKinds = 12;

inline btCollisionShape* make_random_convex(std::uint64_t kind, Random& random) {
  const btScalar size = random.uniform(Real(0.15), Real(0.7));
  const btScalar other = random.uniform(Real(0.1), Real(0.5));
  switch (kind) {
    case 0:
      return new btBoxShape(btVector3(size, other, size));
    case 1:
      return new btCapsuleShape(other, size);
    case 2:
      return new btCylinderShapeX(btVector3(size, other, other));
    case 3:
      return new btConeShapeZ(other, size);
    case 4:
      return make_random_hull(random, size);
    case 5: {
      const btVector3 centers[] = {{-other, 0, 0}, {other, 0, 0}};
      const btScalar radii[] = {size, other};
      return new btMultiSphereShape(centers, radii, 2);
    }
    case 6: {
      auto* hull = make_random_hull(random, size);
      hull->initializePolyhedralFeatures();
      return hull;
    }
    case 7:
      return new OwnSphere(size);
    default:
      return new btSphereShape(size);
  }
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
