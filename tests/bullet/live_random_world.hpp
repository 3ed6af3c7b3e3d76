/// A running random world, one of the two that are compared.
#pragma once

#include "tests/bullet/random_world.hpp"

#include <set>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Sets g_current during construction; the caller must set it for apply() and step().
class LiveWorld {
 public:
  LiveWorld(const RandomWorld& world, MakeDispatcher make_dispatcher, const WorldParts& parts = {});
  ~LiveWorld();
  LiveWorld(const LiveWorld&) = delete;
  LiveWorld& operator=(const LiveWorld&) = delete;

  BulletWorld& live() { return live_; }
  void apply(const RandomEvent& event);
  void set_near_callback(bool on);
  void step();  ///< one stepSimulation(); kinematic bodies are moved before

 private:
  std::unique_ptr<btCollisionConfiguration> make_configuration() const;
  std::unique_ptr<btBroadphaseInterface> make_broadphase();
  btCollisionShape* make_shape(const RandomBody& body);
  btCollisionShape* make_terrain(const RandomBody& body);
  void deform(const RandomEvent& event);  ///< of a terrain
  void add_body(std::size_t i);
  static void apply_traits(btRigidBody* made, const RandomBody& body);
  static void place(btRigidBody* body, const btVector3& position);
  /// Adds the body to the world, at its initial position if its state is not finite.
  void enter(std::size_t i);
  void add_joint(const RandomJoint& joint);
  void remove_joint(btTypedConstraint* joint);
  void leave(btRigidBody* body);  ///< takes it out of the world, with its joints
  void reshape(std::size_t i);    ///< changes between its own shape and a box

  /// Arrays that the shape of a terrain refers to.
  struct Terrain {
    std::vector<btScalar> points;  ///< coordinates of a mesh, heights of a height field
    std::vector<int> indices;
    btTriangleIndexVertexArray arrays;
  };

  const RandomWorld& random_;
  Terrain terrain_;  // outlives the shapes
  btSortedOverlappingPairCache sorted_pairs_;
  BulletWorld live_;
  std::vector<btRigidBody*> bodies_;  ///< null where a body is not used
  std::vector<btCollisionShape*> other_shapes_;
  std::vector<std::pair<btScalar, btCollisionShape*>> shared_spheres_;
  std::vector<std::unique_ptr<btTypedConstraint>> joints_;
  std::set<std::pair<std::size_t, std::size_t>> ignored_;
};

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
