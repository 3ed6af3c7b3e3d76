/// Update of one convex pair on any thread.
///
/// In Bullet 3.24, processCollision() of the algorithms of PairTable has no global state and no
/// profile zone, calls no dispatcher once the manifold exists, and ignores the debug drawer.
/// Two polyhedra with polyhedral features are the exception, because btPolyhedralContactClipping
/// counts its tests in global variables. kConvex excludes hulls with such features, and an
/// algorithm of two boxes is not a btConvexConvexAlgorithm.
#include "src/bullet/dispatch/convex_commit.hpp"

#include "src/bullet/dispatch/body_wrapper.hpp"
#include "src/bullet/dispatch/compound_commit.hpp"
#include "src/bullet/dispatch/concave_commit.hpp"
#include "src/bullet/dispatch/contact_point.hpp"
#include "src/bullet/dispatch/plane_gap.hpp"
#include "src/bullet/exact_class.hpp"
#include "src/bullet/prefetch.hpp"

#include <BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btManifoldResult.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>

#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

bool is_convex(const btCollisionShape& shape, unsigned traits) {
  if ((traits & kSphere) == 0) return (traits & kConvex) != 0;
  return type_info_of(shape) == &typeid(btSphereShape);
}

/// The traits of the shapes of the two bodies of a pair.
struct ShapeTraits {
  unsigned a, b;
};

/// Updates two convex shapes, or a sphere and a plane, without Bullet's algorithm. Returns false,
/// without a change, for other shapes and for contacts that need Bullet's algorithm.
bool update_without_algorithm(const SphereBatch& batch, std::size_t i, const ShapeTraits& traits,
                              CommitCounts* counts) {
  btPersistentManifold* manifold = batch.manifold(i);
  const btCollisionObject &a = *batch.body_a(i), &b = *batch.body_b(i);
  const unsigned either = traits.a | traits.b;
  if (batch.kind(i) == PairKind::convex) {
    if (!update_convex(manifold, a, b)) return false;
    ++((either & kSphere) != 0 && (either & kBox) != 0 ? counts->sphere_boxes
                                                       : counts->convex_pairs);
    return true;
  }
  if ((either & kSphere) == 0 || (either & kPlane) == 0) return false;
  if (!update_sphere_plane(manifold, a, b, (traits.a & kSphere) != 0)) return false;
  ++counts->sphere_planes;
  return true;
}

/// Whether pair i is a box far from a plane, without contact points.
bool is_clear_box(const SphereBatch& batch, std::size_t i, const ShapeTraits& traits) {
  const bool box_first = batch.kind(i) == PairKind::convex_plane;
  if (!box_first && batch.kind(i) != PairKind::plane_convex) return false;
  const btPersistentManifold& manifold = *batch.manifold(i);
  if (((traits.a | traits.b) & kBox) == 0 || manifold.getNumContacts() != 0) return false;
  const btCollisionObject &a = *batch.body_a(i), &b = *batch.body_b(i);
  const btCollisionObject &box = box_first ? a : b, &plane = box_first ? b : a;
  const auto& shape = static_cast<const btBoxShape&>(*box.getCollisionShape());
  return is_clear_of_plane(box, shape.getHalfExtentsWithMargin().length(), plane,
                           manifold.getContactBreakingThreshold());
}

void run_algorithm(const ConvexDispatch& dispatch, std::size_t i) {
  const btCollisionObjectWrapper a = wrapper_of(*dispatch.batch.body_a(i));
  const btCollisionObjectWrapper b = wrapper_of(*dispatch.batch.body_b(i));
  btManifoldResult result(&a, &b);
  dispatch.pairs[i].m_algorithm->processCollision(&a, &b, dispatch.info, &result);
}

bool is_compound_pair(const ConvexDispatch& dispatch, std::size_t i) {
  return dispatch.batch.kind(i) == PairKind::other &&
         is_compound_algorithm(dispatch.pairs[i].m_algorithm);
}

bool has_known_shapes(const ConvexDispatch& dispatch, std::size_t i, const ShapeTraits& traits) {
  const SphereBatch& batch = dispatch.batch;
  return is_compound_pair(dispatch, i) ||
         has_expected_shapes(batch.kind(i), *batch.body_a(i)->getCollisionShape(), traits.a,
                             *batch.body_b(i)->getCollisionShape(), traits.b);
}

/// Updates a pair that needs a collision and for which has_known_shapes() is true. Returns false,
/// without a change, if Bullet must process it.
bool update(const ConvexDispatch& dispatch, std::size_t i, const ShapeTraits& traits,
            CommitCounts* counts) {
  const SphereBatch& batch = dispatch.batch;
  if (batch.kind(i) == PairKind::other) return commit_compound(dispatch, i, counts);
  if (is_concave(batch.kind(i))) {
    const unsigned convex = batch.kind(i) == PairKind::concave_convex ? traits.b : traits.a;
    return commit_concave(dispatch, i, (convex & kConvex) != 0, counts);
  }
  if (update_without_algorithm(batch, i, traits, counts)) return true;
  if (!dispatch.runs_algorithms) return false;
  if (!is_clear_box(batch, i, traits)) run_algorithm(dispatch, i);
  ++counts->convex_pairs;
  return true;
}

}  // namespace

void prefetch_convex(const ConvexDispatch& dispatch, std::size_t i) {
  const SphereBatch& batch = dispatch.batch;
  if (batch.manifold(i) != nullptr) {
    prefetch_header(batch.manifold(i));
    prefetch_first_point(batch.manifold(i));
    prefetch_for_contact(*batch.body_a(i));
    prefetch_for_contact(*batch.body_b(i));
  } else if (const btCollisionAlgorithm* algorithm = dispatch.pairs[i].m_algorithm) {
    prefetch_children(*algorithm);
    prefetch_state(*batch.body_a(i));
    prefetch_state(*batch.body_b(i));
  }
}

void prefetch_algorithm(const ConvexDispatch& dispatch, std::size_t i) {
  if (dispatch.batch.manifold(i) != nullptr) return;
  if (const btCollisionAlgorithm* algorithm = dispatch.pairs[i].m_algorithm) {
    prefetch_bytes(algorithm, sizeof(btCompoundCompoundCollisionAlgorithm));
  }
}

bool has_sphere(const SphereBatch& batch, std::size_t i) {
  const btCollisionShape& a = *batch.body_a(i)->getCollisionShape();
  const btCollisionShape& b = *batch.body_b(i)->getCollisionShape();
  const auto are = [](const btCollisionShape& sphere, const btCollisionShape& other,
                      bool is_plane) {
    return is_exactly<btSphereShape>(sphere) &&
           (is_plane ? is_exactly<btStaticPlaneShape>(other) : is_exactly<btBoxShape>(other));
  };
  switch (batch.kind(i)) {
    case PairKind::convex:
      return are(a, b, false) || are(b, a, false);
    case PairKind::convex_plane:
      return are(a, b, true);
    case PairKind::plane_convex:
      return are(b, a, true);
    case PairKind::convex_concave:
      return is_exactly<btSphereShape>(a) && b.isConcave();
    case PairKind::concave_convex:
      return is_exactly<btSphereShape>(b) && a.isConcave();
    default:
      return false;
  }
}

bool has_expected_shapes(PairKind kind, const btCollisionShape& shape_a, unsigned a,
                         const btCollisionShape& shape_b, unsigned b) {
  switch (kind) {
    case PairKind::other:
    case PairKind::spheres:
      return false;
    case PairKind::boxes:
      return (a & b & kBox) != 0;
    case PairKind::convex:
      return (a & b & kBox) == 0 && is_convex(shape_a, a) && is_convex(shape_b, b);
    case PairKind::convex_plane:
      return (b & kPlane) != 0 && is_convex(shape_a, a);
    case PairKind::plane_convex:
      return (a & kPlane) != 0 && is_convex(shape_b, b);
    case PairKind::convex_concave:
    case PairKind::concave_convex:
      return true;  // commit_concave() reads the classes
  }
  return false;
}

void commit_in_order(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  const SphereBatch& batch = dispatch.batch;
  const btCollisionObject &a = *batch.body_a(i), &b = *batch.body_b(i);
  const bool sphere_first = a.getCollisionShape()->getShapeType() == SPHERE_SHAPE_PROXYTYPE;
  switch (batch.kind(i)) {
    case PairKind::convex:
      if (update_convex(batch.manifold(i), a, b)) {
        ++counts->sphere_boxes;
        return;
      }
      break;
    case PairKind::convex_plane:
    case PairKind::plane_convex:
      if (update_sphere_plane(batch.manifold(i), a, b, sphere_first)) {
        ++counts->sphere_planes;
        return;
      }
      break;
    default:
      if (commit_concave_in_order(dispatch, i, counts)) return;
  }
  run_algorithm(dispatch, i);
}

CommitCounts& CommitCounts::operator+=(const CommitCounts& other) {
  sphere_pairs += other.sphere_pairs;
  touching += other.touching;
  written += other.written;
  sphere_boxes += other.sphere_boxes;
  sphere_planes += other.sphere_planes;
  convex_pairs += other.convex_pairs;
  sphere_concaves += other.sphere_concaves;
  concave_pairs += other.concave_pairs;
  compound_pairs += other.compound_pairs;
  for (std::size_t i = 0; i < concave_fallbacks.size(); ++i) {
    concave_fallbacks[i] += other.concave_fallbacks[i];
  }
  return *this;
}

bool commit_convex(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  const SphereBatch& batch = dispatch.batch;
  const unsigned traits = batch.either_trait(i);
  if (!has_known_shapes(dispatch, i, {batch.trait_a(i), batch.trait_b(i)})) return false;
  if ((traits & kActive) == 0) return true;
  // Qualified call, because no class overrides the function here.
  if ((traits & kHasIgnoreList) != 0 && !dispatch.dispatcher.btCollisionDispatcher::needsCollision(
                                            batch.body_a(i), batch.body_b(i))) {
    return true;
  }
  return update(dispatch, i, {batch.trait_a(i), batch.trait_b(i)}, counts);
}

bool commit_unobserved(const ConvexDispatch& dispatch, std::size_t i, CommitCounts* counts) {
  const ShapeTraits traits{traits_of(*dispatch.batch.body_a(i)->getCollisionShape()),
                           traits_of(*dispatch.batch.body_b(i)->getCollisionShape())};
  return has_known_shapes(dispatch, i, traits) && update(dispatch, i, traits, counts);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
