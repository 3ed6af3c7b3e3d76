/// Update of one leaf of Bullet's dynamic tree, split into a computation that may run on any thread
/// and the change of the tree.
#pragma once

#include <jfpx/config.hpp>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletCollision/CollisionDispatch/btCollisionWorld.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The leaf of an object in an update of all AABBs.
struct LeafUpdate {
  btDbvtVolume before;     ///< volume of the leaf when the update begins
  btDbvtVolume after;      ///< its volume after its turn; equal to `before` if not moved
  btVector3 lower, upper;  ///< new AABB of the object, if it is active
  btDbvtProxy* proxy;
  bool active;  ///< has a turn
  bool moves;   ///< leaves the tree and is inserted again
  bool fixed;   ///< is in the tree of fixed objects before its turn
};

/// Reasons why Bullet's code must update an object serially.
enum class LeafObstacle : unsigned char {
  none,
  shape,     ///< a user-defined shape, whose getAabb() may not be thread-safe
  overflow,  ///< Bullet excludes the object from the simulation and may call the debug drawer
  nan        ///< the volumes of inner nodes need not contain such a leaf
};

/// Computes the effect of btCollisionWorld::updateAabbs() on the leaf of the object at its turn,
/// which does not depend on other leaves. Changes nothing. Thread-safe.
LeafObstacle compute_update(btCollisionWorld& world, const btDbvtBroadphase& tree,
                            btCollisionObject& object, LeafUpdate* leaf);

/// Changes tree, counters and proxy like btDbvtBroadphase::setAabb(), without the search for
/// overlaps.
void apply_update(btDbvtBroadphase& tree, const LeafUpdate& leaf);

/// Removes the leaf of a proxy like btDbvtBroadphase::destroyProxy().
void remove_leaf(btDbvtBroadphase& tree, btDbvtProxy* proxy);

/// Whether a search of the tree visits leaf `a` before leaf `b` of the same tree: Bullet descends
/// into the second child of a node first.
bool is_visited_before(const btDbvtNode* a, const btDbvtNode* b);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
