/// Update of one pair of a convex and a concave shape on any thread.
///
/// In Bullet 3.24, btConvexConcaveCollisionAlgorithm creates an algorithm for each triangle in the
/// box of the convex shape and runs it on the manifold of the pair. Neither the algorithm of a
/// triangle nor the memory that it takes from the pool of the dispatcher outlives the triangle.
/// Here, one algorithm on the stack processes all triangles of a pair, and spheres need none.
#include "src/bullet/dispatch/concave_commit.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/concave_triangles.hpp"
#include "src/bullet/dispatch/core_distance.hpp"
#include "src/bullet/dispatch/separation_test.hpp"
#include "src/bullet/dispatch/sphere_triangle.hpp"
#include "src/bullet/dispatch/visit_core.hpp"
#include "src/bullet/exact_class.hpp"

#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btMultiSphereShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btTriangleShape.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

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

/// btGjkPairDetector for a convex shape and the triangles of a concave shape.
class TriangleDetector {
 public:
  TriangleDetector(const btConvexShape& shape, const btTransform& pose,
                   const btTransform& triangle_pose, btScalar triangle_margin, btScalar threshold)
      : offset_((pose.getOrigin() + triangle_pose.getOrigin()) * btScalar(0.5)),
        triangle_pose_(moved(triangle_pose)),
        to_triangle_(triangle_pose.getBasis()),
        pose_(moved(pose)),
        input_{.margin_a = shape.getMargin(),
               .margin_b = triangle_margin,
               .maximum_distance_squared = 0,
               .offset = offset_} {
    if (shape.getShapeType() == BOX_SHAPE_PROXYTYPE) {
      half_ = static_cast<const btBoxShape&>(shape).getImplicitShapeDimensions();
    }
    const btScalar reach = input_.margin_a + input_.margin_b + threshold;
    input_.maximum_distance_squared = reach * reach;
  }

  /// The pose of the shape's core.
  const btTransform& pose() const { return pose_; }

  /// Returns false, without a change, if Bullet's algorithm must process the triangle.
  template <class Core>
  bool add_contact(const Core& core, const btVector3* vertices, btManifoldResult* result) const {
    const TriangleCore triangle(triangle_pose_, to_triangle_, vertices);
    DetectorInput input = input_;
    if constexpr (std::is_same_v<Core, BoxCore>) input.are_clear = is_clear(triangle);
    DetectorContact contact;
    switch (find_closest_points(core, triangle, input, &contact)) {
      case DetectorResult::unknown:
        return false;
      case DetectorResult::apart:
        return true;
      case DetectorResult::contact:
        break;
    }
    result->addContactPoint(contact.normal_on_b, contact.point_on_b, contact.distance);
    return true;
  }

 private:
  /// Relative to the midpoint of the two bodies, for better precision.
  btTransform moved(btTransform pose) const {
    pose.getOrigin() -= offset_;
    return pose;
  }

  /// Whether a plane parallel to the triangle is well between the triangle and the core of a box.
  bool is_clear(const TriangleCore& triangle) const {
    const btVector3 &v0 = triangle.vertex(0), &v1 = triangle.vertex(1), &v2 = triangle.vertex(2);
    const btVector3 normal = (v1 - v0).cross(v2 - v0);
    const btVector3 g0 = v0 - pose_.getOrigin(), g1 = v1 - pose_.getOrigin(),
                    g2 = v2 - pose_.getOrigin();
    const btScalar d0 = normal.dot(g0), d1 = normal.dot(g1), d2 = normal.dot(g2);
    const btScalar nearest =
        btMax(btMin(btMin(d0, d1), d2), btMin(btMin(-d0, -d1), -d2));  // 0 < if on one side
    const btScalar gap = nearest - half_.dot((normal * pose_.getBasis()).absolute());
    const btScalar farthest2 = btMax(btMax(g0.length2(), g1.length2()), g2.length2());
    // (x + y)^2 <= 2 (x^2 + y^2)
    return gap > 0 &&
           are_clear(gap * gap / normal.length2(), btScalar(2) * (farthest2 + half_.length2()));
  }

  btVector3 offset_;
  btTransform triangle_pose_;
  TransposedProduct to_triangle_;
  btTransform pose_;
  btVector3 half_;  ///< half extents of a box, margin excluded
  DetectorInput input_;
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
    begin();
    if (function->m_numPerturbationIterations != 0 || !update_by_core(*function, box)) {
      update_by_algorithm(*function, box);
    }
    result_.refreshContactPoints();
    ++counts->concave_pairs;
    return ConcaveFallback::none;
  }

  /// Updates the manifold of a sphere, and calls the callbacks as Bullet does.
  ConcaveFallback update_sphere_in_order(CommitCounts* counts) {
    if (!has_known_triangles(*concave_.getCollisionShape())) return ConcaveFallback::concave_class;
    if (!is_exactly<btSphereShape>(*convex_.getCollisionShape())) {
      return ConcaveFallback::convex_class;
    }
    if (!dispatch_.triangle_algorithms.has_stock_sphere()) return ConcaveFallback::create_function;
    const SphereTriangleInput sphere = sphere_input();
    const btVector3 center = concave_.getWorldTransform().inverse()(
                        convex_.getWorldTransform().getOrigin()),
                    extent(sphere.radius, sphere.radius, sphere.radius);
    LocalBox box{center - extent, center + extent};
    if (!widen(&box)) return ConcaveFallback::not_finite;
    std::array<ObservedContact, 8> contacts;
    std::size_t count = 0;
    const bool finite =
        for_each_contact(sphere, box, [&](const Contact& contact, const btVector3* triangle) {
          if (count < contacts.size()) contacts[count].set(contact, triangle);
          ++count;
        });
    if (!finite) return ConcaveFallback::not_finite;
    begin();
    if (count > contacts.size()) {
      add_in_order(box, 0, triangle_margin());
    } else if (count > 0) {
      add_in_order(box, {contacts.data(), count});
    }
    result_.refreshContactPoints();
    ++counts->sphere_concaves;
    return ConcaveFallback::none;
  }

 private:
  /// The shape, once it is known to be convex.
  const btConvexShape& shape() const {
    return static_cast<const btConvexShape&>(*convex_.getCollisionShape());
  }
  btScalar triangle_margin() const { return concave_.getCollisionShape()->getMargin(); }
  btScalar threshold() const { return manifold_.getContactBreakingThreshold(); }

  /// Adds the margin of the triangles. Returns false if a coordinate is not finite.
  bool widen(LocalBox* box) const {
    const btScalar margin = triangle_margin();
    const btVector3 extra(margin, margin, margin);
    box->max += extra;
    box->min -= extra;
    return is_bounded(box->max) && is_bounded(box->min);
  }
  SphereTriangleInput sphere_input() const {
    const btTransform &from = concave_.getWorldTransform(), &pose = convex_.getWorldTransform();
    return {(pose.getOrigin() - from.getOrigin()) * from.getBasis(),
            static_cast<const btSphereShape&>(shape()).getRadius(), threshold()};
  }
  void begin() { manifold_.setBodies(convex_.getCollisionObject(), concave_.getCollisionObject()); }
  void set_triangle(int part, int index) {
    if (concave_first_) {
      result_.setShapeIdentifiersA(part, index);
    } else {
      result_.setShapeIdentifiersB(part, index);
    }
  }

  // The updates are not inlined: a program with small stacks needs that of one of them only.
  [[gnu::noinline]] ConcaveFallback update_sphere(CommitCounts* counts) {
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
    const bool finite =
        for_each_contact(sphere, box, [&](const Contact& contact, const btVector3*) {
          if (count < contacts.size()) contacts[count] = contact;
          ++count;
        });
    if (!finite) return ConcaveFallback::not_finite;
    begin();
    if (count <= contacts.size()) {
      for (std::size_t k = 0; k < count; ++k) add(contacts[k]);
    } else {
      for_each_contact(sphere, box,
                       [&](const Contact& contact, const btVector3*) { add(contact); });
    }
    result_.refreshContactPoints();
    ++counts->sphere_concaves;
    return ConcaveFallback::none;
  }

  struct Contact {
    SphereTriangleContact point;
    int part, index;
    std::size_t turn;  ///< number of the triangle in the traversal
  };
  /// A contact and its triangle, which the callback may read.
  struct ObservedContact {
    void set(const Contact& of, const btVector3* vertices) {
      contact = of;
      std::copy_n(vertices, 3, triangle);
    }
    Contact contact;
    btVector3 triangle[3];
  };
  /// What the contacts of a sphere depend on. A callback may change it between two triangles.
  struct SphereState {
    explicit SphereState(const ConcavePair& pair)
        : sphere(pair.sphere_input()),
          triangle_pose(pair.concave_.getWorldTransform()),
          sphere_pose(pair.convex_.getWorldTransform()),
          test(triangle_pose, sphere_pose, sphere.threshold),
          support(sphere.radius) {}
    SphereState(const SphereState&) = delete;
    SphereState& operator=(const SphereState&) = delete;

    bool is_current(const ConcavePair& pair) const {
      // Bits: the signs of zeros differ in results.
      const auto is_equal = [](const btTransform& a, const btTransform& b) {
        return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof a) ==
               0;
      };
      return is_equal(triangle_pose, pair.concave_.getWorldTransform()) &&
             is_equal(sphere_pose, pair.convex_.getWorldTransform()) &&
             sphere.radius == static_cast<const btSphereShape&>(pair.shape()).getRadius() &&
             sphere.threshold == pair.threshold();
    }

    const SphereTriangleInput sphere;
    const btTransform triangle_pose, sphere_pose;
    const SeparationTest test;
    const SphereSupport support;
  };
  /// Adds the contacts. If a callback changes what they depend on, computes the later ones again.
  void add_in_order(const LocalBox& box, std::span<const ObservedContact> contacts) {
    const SphereState state(*this);
    const btScalar margin = triangle_margin();
    for (const ObservedContact& observed : contacts) {
      add_observed(observed.contact, observed.triangle, margin);
      if (state.is_current(*this)) continue;
      add_in_order(box, observed.contact.turn + 1, margin);
      return;
    }
  }
  /// Adds the contacts with the triangles from the given one on, each before the next triangle is
  /// read.
  void add_in_order(const LocalBox& box, std::size_t first, btScalar margin) {
    std::optional<SphereState> state(std::in_place, *this);
    std::size_t turn = 0;
    for_each_triangle(
        *concave_.getCollisionShape(), box, [&](const btVector3* triangle, int part, int index) {
          if (turn++ < first) return;
          if (!state->is_current(*this)) state.emplace(*this);
          Contact contact{.point = {}, .part = part, .index = index, .turn = turn};
          if (!find_contact(state->sphere, triangle, &contact.point)) return;
          if (dispatch_.ignores_separated && state->test.is_separated(triangle, state->support)) {
            return;
          }
          add_observed(contact, triangle, margin);
        });
  }
  /// Adds a contact with a wrapper of its triangle, which the callback receives.
  void add_observed(const Contact& contact, const btVector3* triangle, btScalar margin) {
    btTriangleShape triangle_shape(triangle[0], triangle[1], triangle[2]);
    triangle_shape.setMargin(margin);
    const btCollisionObjectWrapper wrapper(
        &concave_, &triangle_shape, concave_.getCollisionObject(), concave_.getWorldTransform(),
        contact.part, contact.index);
    concave_first_ ? result_.setBody0Wrap(&wrapper) : result_.setBody1Wrap(&wrapper);
    add(contact);
    concave_first_ ? result_.setBody0Wrap(&a_) : result_.setBody1Wrap(&b_);
  }
  /// Calls visit() for the contacts of a sphere, in Bullet's order. Returns false if a triangle is
  /// not finite.
  template <class Visit>
  bool for_each_contact(const SphereTriangleInput& sphere, const LocalBox& box,
                        const Visit& visit) const {
    const SeparationTest test(concave_.getWorldTransform(), convex_.getWorldTransform(),
                              threshold());
    const SphereSupport support(sphere.radius);
    bool finite = true;
    std::size_t turn = 0;
    for_each_triangle(*concave_.getCollisionShape(), box,
                      [&](const btVector3* triangle, int part, int index) {
                        finite = finite && is_bounded(triangle[0]) && is_bounded(triangle[1]) &&
                                 is_bounded(triangle[2]);
                        Contact contact{.point = {}, .part = part, .index = index, .turn = turn++};
                        // The order of the two tests does not matter; the second one rarely fails.
                        if (!find_contact(sphere, triangle, &contact.point)) return;
                        if (dispatch_.ignores_separated && test.is_separated(triangle, support)) {
                          return;
                        }
                        visit(contact, triangle);
                      });
    return finite;
  }
  void add(const Contact& contact) {
    const btTransform& pose = concave_.getWorldTransform();
    set_triangle(contact.part, contact.index);
    result_.addContactPoint(pose.getBasis() * contact.point.normal_on_triangle,
                            pose * contact.point.point_on_triangle, contact.point.distance);
  }

  /// Returns false, without a change, if there is no core for the shape.
  [[gnu::noinline]] bool update_by_core(const btConvexConvexAlgorithm::CreateFunc& function,
                                        const LocalBox& near) {
    static thread_local HullPoints room;  // not on the stack, which may be small
    const TriangleDetector detector(shape(), convex_.getWorldTransform(),
                                    concave_.getWorldTransform(), triangle_margin(), threshold());
    return visit_core(shape(), detector.pose(), &room, [&](const auto& core) {
      const auto visit = [&](const btVector3* triangle, int part, int index) {
        if (!detector.add_contact(core, triangle, &result_)) run(function, triangle, part, index);
      };
      if constexpr (std::is_same_v<std::decay_t<decltype(core)>, BoxCore>) {
        const auto& box = static_cast<const btBoxShape&>(shape());
        const btScalar margin = box.btBoxShape::getMargin();
        const btVector3 half = box.getImplicitShapeDimensions() + btVector3(margin, margin, margin);
        for_each_close_triangle(
            near,
            [&](const btVector3& direction) {
              return btVector3(btFsels(direction.x(), half.x(), -half.x()),
                               btFsels(direction.y(), half.y(), -half.y()),
                               btFsels(direction.z(), half.z(), -half.z()));
            },
            visit);
      } else {
        for_each_close_triangle(
            near,
            [&](const btVector3& direction) { return shape().localGetSupportingVertex(direction); },
            visit);
      }
    });
  }
  [[gnu::noinline]] void update_by_algorithm(const btConvexConvexAlgorithm::CreateFunc& function,
                                             const LocalBox& near) {
    for_each_close_triangle(
        near,
        [&](const btVector3& direction) { return shape().localGetSupportingVertex(direction); },
        [&](const btVector3* triangle, int part, int index) {
          run(function, triangle, part, index);
        });
  }

  /// Calls visit() for the triangles that Bullet does not ignore.
  template <class Support, class Visit>
  void for_each_close_triangle(const LocalBox& near, const Support& support, const Visit& visit) {
    const SeparationTest test(concave_.getWorldTransform(), convex_.getWorldTransform(),
                              threshold());
    for_each_triangle(*concave_.getCollisionShape(), near,
                      [&](const btVector3* triangle, int part, int index) {
                        if (dispatch_.ignores_separated && test.is_separated(triangle, support)) {
                          return;
                        }
                        set_triangle(part, index);
                        visit(triangle, part, index);
                      });
  }

  /// Runs Bullet's algorithm for one triangle.
  void run(const btConvexConvexAlgorithm::CreateFunc& function, const btVector3* triangle, int part,
           int index) {
    btTriangleShape triangle_shape(triangle[0], triangle[1], triangle[2]);
    triangle_shape.setMargin(triangle_margin());
    const btCollisionObjectWrapper wrapper(&concave_, &triangle_shape,
                                           concave_.getCollisionObject(),
                                           concave_.getWorldTransform(), part, index);
    const btCollisionAlgorithmConstructionInfo info(&dispatch_.dispatcher, 1);
    btConvexConvexAlgorithm algorithm(&manifold_, info, &convex_, &wrapper, function.m_pdSolver,
                                      function.m_numPerturbationIterations,
                                      function.m_minimumPointsPerturbationThreshold);
    algorithm.processCollision(&convex_, &wrapper, dispatch_.info, &result_);
  }

  const ConvexDispatch& dispatch_;
  btPersistentManifold& manifold_;
  bool concave_first_;
  btCollisionObjectWrapper a_, b_;
  const btCollisionObjectWrapper &concave_, &convex_;
  btManifoldResult result_;
};

}  // namespace

bool commit_concave_in_order(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  const ConcaveFallback fallback = ConcavePair(dispatch, i).update_sphere_in_order(counts);
  ++counts->concave_fallbacks[static_cast<std::size_t>(fallback)];
  return fallback == ConcaveFallback::none;
}

bool commit_concave(const ConvexDispatch& dispatch, std::size_t i, bool is_convex,
                    CommitCounts* counts) {
  const ConcaveFallback fallback = ConcavePair(dispatch, i).update(is_convex, counts);
  ++counts->concave_fallbacks[static_cast<std::size_t>(fallback)];
  return fallback == ConcaveFallback::none;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
