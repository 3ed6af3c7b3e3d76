/// Update of one pair of a convex and a concave shape on any thread.
///
/// In Bullet 3.24, btConvexConcaveCollisionAlgorithm creates an algorithm for each triangle in the
/// box of the convex shape and runs it on the manifold of the pair. Neither the algorithm of a
/// triangle nor the memory that it takes from the pool of the dispatcher outlives the triangle.
/// Here, one algorithm on the stack processes all triangles of a pair, and spheres need none.
#include "src/bullet/dispatch/concave_commit.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/concave_triangles.hpp"
#include "src/bullet/dispatch/separation_test.hpp"
#include "src/bullet/dispatch/sphere_triangle.hpp"
#include "src/bullet/exact_class.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <array>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Upper bound of the coordinates for which no operation on a sphere and a triangle overflows. The
/// bits of a NaN depend on the compiler.
constexpr btScalar kMaxTriangleCoordinate = sizeof(btScalar) == 8 ? btScalar(1e60) : btScalar(1e8);

bool is_bounded(const btVector3& v) {
  return btFabs(v.x()) < kMaxTriangleCoordinate && btFabs(v.y()) < kMaxTriangleCoordinate &&
         btFabs(v.z()) < kMaxTriangleCoordinate;
}

/// The point of a sphere that is furthest along a direction (btSphereShape).
class SphereSupport {
 public:
  explicit SphereSupport(btScalar radius) : radius_(radius) {}
  btVector3 operator()(btVector3 direction) const {
    if (direction.length2() < SIMD_EPSILON * SIMD_EPSILON) direction = btVector3(-1, -1, -1);
    direction.normalize();
    return btVector3(0, 0, 0) + radius_ * direction;
  }

 private:
  btScalar radius_;
};

/// A pair and the state of its update.
class ConcavePair {
 public:
  ConcavePair(const ConvexDispatch& dispatch, std::size_t i)
      : dispatch_(dispatch),
        manifold_(*dispatch.batch.manifold(i)),
        concave_first_(dispatch.batch.kind(i) == PairKind::concave_convex),
        a_(wrapper_of(*dispatch.batch.body_a(i))),
        b_(wrapper_of(*dispatch.batch.body_b(i))),
        concave_(concave_first_ ? a_ : b_),
        convex_(concave_first_ ? b_ : a_),
        result_(&a_, &b_) {
    result_.setPersistentManifold(&manifold_);
  }

  /// Updates the manifold. `is_convex`: the convex shape has one of the classes of kConvex.
  ConcaveFallback update(bool is_convex, CommitCounts* counts) {
    const btCollisionShape& any_shape = *convex_.getCollisionShape();
    const int type = any_shape.getShapeType();
    if (!has_known_triangles(*concave_.getCollisionShape())) return ConcaveFallback::concave_class;
    if (type == SPHERE_SHAPE_PROXYTYPE) return update_sphere(counts);
    if (!is_convex && !is_exactly<btConvexHullShape>(any_shape) &&
        !is_exactly<btMultiSphereShape>(any_shape)) {
      return ConcaveFallback::convex_class;
    }
    if (!dispatch_.runs_algorithms) return ConcaveFallback::verified;
    // btPolyhedralContactClipping counts its tests in global variables.
    if (dispatch_.info.m_enableSatConvex && shape().isPolyhedral()) {
      return ConcaveFallback::separating_axes;
    }
    const btConvexConvexAlgorithm::CreateFunc* function =
        dispatch_.triangle_algorithms.convex(type);
    if (function == nullptr) return ConcaveFallback::create_function;
    const btTransform to_triangles =
        concave_.getWorldTransform().inverse() * convex_.getWorldTransform();
    LocalBox box;
    shape().getAabb(to_triangles, box.min, box.max);
    if (!widen(&box)) return ConcaveFallback::not_finite;
    update_convex(*function, box);
    ++counts->concave_pairs;
    return ConcaveFallback::none;
  }

 private:
  /// The shape, once it is known to be convex.
  const btConvexShape& shape() const {
    return static_cast<const btConvexShape&>(*convex_.getCollisionShape());
  }
  btScalar threshold() const { return manifold_.getContactBreakingThreshold(); }

  /// Adds the margin of the triangles. Returns false if a coordinate is not finite.
  bool widen(LocalBox* box) const {
    const btScalar margin = concave_.getCollisionShape()->getMargin();
    const btVector3 extra(margin, margin, margin);
    box->max += extra;
    box->min -= extra;
    return is_bounded(box->max) && is_bounded(box->min);
  }
  void begin() { manifold_.setBodies(convex_.getCollisionObject(), concave_.getCollisionObject()); }
  void set_triangle(int part, int index) {
    if (concave_first_) {
      result_.setShapeIdentifiersA(part, index);
    } else {
      result_.setShapeIdentifiersB(part, index);
    }
  }

  ConcaveFallback update_sphere(CommitCounts* counts) {
    if (!is_exactly<btSphereShape>(*convex_.getCollisionShape()))
      return ConcaveFallback::convex_class;
    if (!dispatch_.triangle_algorithms.has_stock_sphere()) return ConcaveFallback::create_function;
    const btScalar radius = static_cast<const btSphereShape&>(shape()).getRadius();
    const btTransform &from = concave_.getWorldTransform(), &pose = convex_.getWorldTransform();
    const btVector3 center = from.inverse()(pose.getOrigin()), extent(radius, radius, radius);
    LocalBox box{center - extent, center + extent};
    if (!widen(&box)) return ConcaveFallback::not_finite;
    const SphereTriangleInput sphere{(pose.getOrigin() - from.getOrigin()) * from.getBasis(),
                                     radius, threshold()};

    // Contacts are added when all triangles have been read, because one may not be finite.
    std::array<Contact, 8> contacts;
    std::size_t count = 0;
    const bool finite = for_each_contact(sphere, box, [&](const Contact& contact) {
      if (count < contacts.size()) contacts[count] = contact;
      ++count;
    });
    if (!finite) return ConcaveFallback::not_finite;
    begin();
    if (count <= contacts.size()) {
      for (std::size_t k = 0; k < count; ++k) add(contacts[k]);
    } else {
      for_each_contact(sphere, box, [&](const Contact& contact) { add(contact); });
    }
    result_.refreshContactPoints();
    ++counts->sphere_concaves;
    return ConcaveFallback::none;
  }

  struct Contact {
    SphereTriangleContact point;
    int part, index;
  };
  /// Calls visit() for the contacts of a sphere, in Bullet's order. Returns false if a triangle is
  /// not finite.
  template <class Visit>
  bool for_each_contact(const SphereTriangleInput& sphere, const LocalBox& box,
                        const Visit& visit) const {
    const SeparationTest test(concave_.getWorldTransform(), convex_.getWorldTransform(),
                              threshold());
    const SphereSupport support(sphere.radius);
    bool finite = true;
    for_each_triangle(*concave_.getCollisionShape(), box,
                      [&](const btVector3* triangle, int part, int index) {
                        finite = finite && is_bounded(triangle[0]) && is_bounded(triangle[1]) &&
                                 is_bounded(triangle[2]);
                        Contact contact{.point = {}, .part = part, .index = index};
                        // The order of the two tests does not matter; the second one rarely fails.
                        if (!find_contact(sphere, triangle, &contact.point)) return;
                        if (dispatch_.ignores_separated && test.is_separated(triangle, support)) {
                          return;
                        }
                        visit(contact);
                      });
    return finite;
  }
  void add(const Contact& contact) {
    const btTransform& pose = concave_.getWorldTransform();
    set_triangle(contact.part, contact.index);
    result_.addContactPoint(pose.getBasis() * contact.point.normal_on_triangle,
                            pose * contact.point.point_on_triangle, contact.point.distance);
  }

  void update_convex(const btConvexConvexAlgorithm::CreateFunc& function, const LocalBox& box) {
    const btScalar margin = concave_.getCollisionShape()->getMargin();
    const btTransform& from = concave_.getWorldTransform();
    const SeparationTest test(from, convex_.getWorldTransform(), threshold());
    const auto support = [&](const btVector3& direction) {
      return shape().localGetSupportingVertex(direction);
    };
    const btCollisionAlgorithmConstructionInfo info(&dispatch_.dispatcher, 1);
    btConvexConvexAlgorithm algorithm(&manifold_, info, &convex_, &concave_, function.m_pdSolver,
                                      function.m_numPerturbationIterations,
                                      function.m_minimumPointsPerturbationThreshold);
    begin();
    for_each_triangle(
        *concave_.getCollisionShape(), box, [&](const btVector3* triangle, int part, int index) {
          if (dispatch_.ignores_separated && test.is_separated(triangle, support)) return;
          btTriangleShape triangle_shape(triangle[0], triangle[1], triangle[2]);
          triangle_shape.setMargin(margin);
          const btCollisionObjectWrapper wrapper(&concave_, &triangle_shape,
                                                 concave_.getCollisionObject(), from, part, index);
          set_triangle(part, index);
          algorithm.processCollision(&convex_, &wrapper, dispatch_.info, &result_);
        });
    result_.refreshContactPoints();
  }

  const ConvexDispatch& dispatch_;
  btPersistentManifold& manifold_;
  bool concave_first_;
  btCollisionObjectWrapper a_, b_;
  const btCollisionObjectWrapper &concave_, &convex_;
  btManifoldResult result_;
};

}  // namespace

bool commit_concave(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  const SphereBatch& batch = dispatch.batch;
  const unsigned convex_traits =
      batch.kind(i) == PairKind::concave_convex ? batch.trait_b(i) : batch.trait_a(i);
  const ConcaveFallback fallback =
      ConcavePair(dispatch, i).update((convex_traits & kConvex) != 0, counts);
  ++counts->concave_fallbacks[static_cast<std::size_t>(fallback)];
  return fallback == ConcaveFallback::none;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
