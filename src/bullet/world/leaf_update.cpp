/// Follows btCollisionWorld::updateSingleAabb() and btDbvtBroadphase::setAabb() of Bullet 3.24.
#include "src/bullet/world/leaf_update.hpp"

#include "src/bullet/exact_class.hpp"

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <BulletCollision/CollisionShapes/btBvhTriangleMeshShape.h>
#include <BulletCollision/CollisionShapes/btCapsuleShape.h>
#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletCollision/CollisionShapes/btConeShape.h>
#include <BulletCollision/CollisionShapes/btConvexHullShape.h>
#include <BulletCollision/CollisionShapes/btCylinderShape.h>
#include <BulletCollision/CollisionShapes/btSphereShape.h>
#include <BulletCollision/CollisionShapes/btStaticPlaneShape.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Whether the shape is of a class of Bullet whose getAabb() only reads the shape.
bool has_plain_bounds(const btCollisionShape& shape) {
  switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
      return is_exactly<btSphereShape>(shape);
    case BOX_SHAPE_PROXYTYPE:
      return is_exactly<btBoxShape>(shape);
    case STATIC_PLANE_PROXYTYPE:
      return is_exactly<btStaticPlaneShape>(shape);
    case CAPSULE_SHAPE_PROXYTYPE:
      return is_exactly<btCapsuleShape>(shape) || is_exactly<btCapsuleShapeX>(shape) ||
             is_exactly<btCapsuleShapeZ>(shape);
    case CYLINDER_SHAPE_PROXYTYPE:
      return is_exactly<btCylinderShape>(shape) || is_exactly<btCylinderShapeX>(shape) ||
             is_exactly<btCylinderShapeZ>(shape);
    case CONE_SHAPE_PROXYTYPE:
      return is_exactly<btConeShape>(shape) || is_exactly<btConeShapeX>(shape) ||
             is_exactly<btConeShapeZ>(shape);
    case CONVEX_HULL_SHAPE_PROXYTYPE:
      return is_exactly<btConvexHullShape>(shape);
    case COMPOUND_SHAPE_PROXYTYPE:
      return is_exactly<btCompoundShape>(shape);
    case TRIANGLE_MESH_SHAPE_PROXYTYPE:
      return is_exactly<btBvhTriangleMeshShape>(shape);
    default:
      return false;
  }
}

void bounds_at(const btCollisionObject& object, const btTransform& pose, btVector3* lower,
               btVector3* upper) {
  object.getCollisionShape()->getAabb(pose, *lower, *upper);
  const btVector3 threshold(gContactBreakingThreshold, gContactBreakingThreshold,
                            gContactBreakingThreshold);
  *lower -= threshold;
  *upper += threshold;
}

bool has_nan(const btDbvtVolume& volume) {
  bool found = false;
  for (int i = 0; i < 3; ++i) {
    found |= volume.Mins()[i] != volume.Mins()[i] || volume.Maxs()[i] != volume.Maxs()[i];
  }
  return found;
}

/// The new volume of a leaf of the tree of moving objects. Sets `*moves`.
btDbvtVolume moved_volume(const btDbvtBroadphase& tree, const LeafUpdate& leaf, bool* moves) {
  btDbvtVolume volume = btDbvtVolume::FromMM(leaf.lower, leaf.upper);
  *moves = true;
  if (!Intersect(leaf.before, volume)) return volume;
  *moves = !leaf.before.Contain(volume);
  if (!*moves) return leaf.before;
  const btVector3 delta = leaf.lower - leaf.proxy->m_aabbMin;
  btVector3 velocity(((leaf.proxy->m_aabbMax - leaf.proxy->m_aabbMin) / 2) * tree.m_prediction);
  for (int i = 0; i < 3; ++i) {
    if (delta[i] < 0) velocity[i] = -velocity[i];
  }
  volume.Expand(btVector3(gDbvtMargin, gDbvtMargin, gDbvtMargin));
  volume.SignedExpand(velocity);
  return volume;
}

void remove_from_list(btDbvtProxy* proxy, btDbvtProxy*& list) {
  if (proxy->links[0] != nullptr) {
    proxy->links[0]->links[1] = proxy->links[1];
  } else {
    list = proxy->links[1];
  }
  if (proxy->links[1] != nullptr) proxy->links[1]->links[0] = proxy->links[0];
}
void prepend_to_list(btDbvtProxy* proxy, btDbvtProxy*& list) {
  proxy->links[0] = nullptr;
  proxy->links[1] = list;
  if (list != nullptr) list->links[0] = proxy;
  list = proxy;
}

int depth_of(const btDbvtNode* node) {
  int depth = 0;
  for (; node->parent != nullptr; node = node->parent) ++depth;
  return depth;
}

}  // namespace

LeafObstacle compute_update(btCollisionWorld& world, const btDbvtBroadphase& tree,
                            btCollisionObject& object, LeafUpdate* leaf) {
  auto* proxy = static_cast<btDbvtProxy*>(object.getBroadphaseHandle());
  leaf->proxy = proxy;
  leaf->before = leaf->after = proxy->leaf->volume;
  leaf->active = world.getForceUpdateAllAabbs() || object.isActive();
  leaf->moves = false;
  leaf->fixed = proxy->stage == btDbvtBroadphase::STAGECOUNT;
  if (has_nan(leaf->before)) return LeafObstacle::nan;
  if (!leaf->active) return LeafObstacle::none;

  if (!has_plain_bounds(*object.getCollisionShape())) return LeafObstacle::shape;
  bounds_at(object, object.getWorldTransform(), &leaf->lower, &leaf->upper);
  if (world.getDispatchInfo().m_useContinuous &&
      object.getInternalType() == btCollisionObject::CO_RIGID_BODY &&
      !object.isStaticOrKinematicObject()) {
    btVector3 lower, upper;
    bounds_at(object, object.getInterpolationWorldTransform(), &lower, &upper);
    leaf->lower.setMin(lower);
    leaf->upper.setMax(upper);
  }
  if (!object.isStaticObject() && !((leaf->upper - leaf->lower).length2() < btScalar(1e12))) {
    return LeafObstacle::overflow;
  }
  if (leaf->fixed) {
    leaf->after = btDbvtVolume::FromMM(leaf->lower, leaf->upper);
    leaf->moves = true;
  } else {
    leaf->after = moved_volume(tree, *leaf, &leaf->moves);
  }
  return has_nan(leaf->after) ? LeafObstacle::nan : LeafObstacle::none;
}

void apply_update(btDbvtBroadphase& tree, const LeafUpdate& leaf) {
  btDbvtProxy* proxy = leaf.proxy;
  if (leaf.fixed) {
    tree.m_sets[btDbvtBroadphase::FIXED_SET].remove(proxy->leaf);
    proxy->leaf = tree.m_sets[btDbvtBroadphase::DYNAMIC_SET].insert(leaf.after, proxy);
  } else {
    ++tree.m_updates_call;
    if (leaf.moves) {
      btDbvtVolume volume = leaf.after;
      tree.m_sets[btDbvtBroadphase::DYNAMIC_SET].update(proxy->leaf, volume);
      ++tree.m_updates_done;
    }
  }
  tree.m_needcleanup |= leaf.moves;
  remove_from_list(proxy, tree.m_stageRoots[proxy->stage]);
  proxy->m_aabbMin = leaf.lower;
  proxy->m_aabbMax = leaf.upper;
  proxy->stage = tree.m_stageCurrent;
  prepend_to_list(proxy, tree.m_stageRoots[tree.m_stageCurrent]);
}

void remove_leaf(btDbvtBroadphase& tree, btDbvtProxy* proxy) {
  const bool fixed = proxy->stage == btDbvtBroadphase::STAGECOUNT;
  tree.m_sets[fixed ? btDbvtBroadphase::FIXED_SET : btDbvtBroadphase::DYNAMIC_SET].remove(
      proxy->leaf);
  remove_from_list(proxy, tree.m_stageRoots[proxy->stage]);
}

bool is_visited_before(const btDbvtNode* a, const btDbvtNode* b) {
  int depth_a = depth_of(a), depth_b = depth_of(b);
  for (; depth_a > depth_b; --depth_a) a = a->parent;
  for (; depth_b > depth_a; --depth_b) b = b->parent;
  if (a == b) return false;
  while (a->parent != b->parent) {
    a = a->parent;
    b = b->parent;
  }
  return a->parent->childs[1] == a;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
