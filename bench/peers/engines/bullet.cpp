/// A world of stock Bullet with a C interface, for bullet_engine.py.
#include <btBulletDynamicsCommon.h>

#include <memory>
#include <vector>

namespace {

struct PeerWorld {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
  std::vector<std::unique_ptr<btTriangleMesh>> meshes;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
  std::vector<std::unique_ptr<btTypedConstraint>> joints;
};

btVector3 vector_at(const float* v) { return {v[0], v[1], v[2]}; }

std::unique_ptr<btCollisionShape> make_shape(PeerWorld& peer, int kind, const float* size,
                                             int points, const int* triangles, int triangle_count) {
  switch (kind) {
    case 0:
      return std::make_unique<btSphereShape>(size[0]);
    case 1:
      return std::make_unique<btBoxShape>(vector_at(size));
    case 2:
      return std::make_unique<btCapsuleShape>(size[0], size[1]);
    case 3: {
      auto hull = std::make_unique<btConvexHullShape>();
      for (int i = 0; i < points; ++i) hull->addPoint(vector_at(size + 3 * i), false);
      hull->recalcLocalAabb();
      return hull;
    }
    default: {
      peer.meshes.push_back(std::make_unique<btTriangleMesh>());
      for (int i = 0; i < triangle_count; ++i) {
        const int* t = triangles + 3 * i;
        peer.meshes.back()->addTriangle(vector_at(size + 3 * t[0]), vector_at(size + 3 * t[1]),
                                        vector_at(size + 3 * t[2]));
      }
      return std::make_unique<btBvhTriangleMeshShape>(peer.meshes.back().get(), true);
    }
  }
}

}  // namespace

extern "C" {

PeerWorld* peer_create() {
  auto* peer = new PeerWorld;
  peer->world.setGravity(btVector3(0, btScalar(-9.81), 0));
  return peer;
}

void peer_add(PeerWorld* peer, int kind, const float* size, int points, const int* triangles,
              int triangle_count, const float* pose, float mass, float friction) {
  peer->shapes.push_back(make_shape(*peer, kind, size, points, triangles, triangle_count));
  btCollisionShape* shape = peer->shapes.back().get();
  btVector3 inertia(0, 0, 0);
  if (mass > 0) shape->calculateLocalInertia(mass, inertia);
  btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape, inertia);
  const btQuaternion turn(pose[4], pose[5], pose[6], pose[3]);
  info.m_startWorldTransform = btTransform(turn, vector_at(pose));
  info.m_friction = friction;
  peer->bodies.push_back(std::make_unique<btRigidBody>(info));
  peer->bodies.back()->setActivationState(DISABLE_DEACTIVATION);
  peer->world.addRigidBody(peer->bodies.back().get());
}

void peer_join(PeerWorld* peer, int a, int b, const float* anchors) {
  peer->joints.push_back(std::make_unique<btPoint2PointConstraint>(
      *peer->bodies[std::size_t(a)], *peer->bodies[std::size_t(b)], vector_at(anchors),
      vector_at(anchors + 3)));
  peer->world.addConstraint(peer->joints.back().get(), true);
}

void peer_step(PeerWorld* peer) { peer->world.stepSimulation(btScalar(1) / 60, 0); }

void peer_states(PeerWorld* peer, float* out) {
  for (const auto& body : peer->bodies) {
    if (body->isStaticObject()) continue;
    const btVector3 &at = body->getWorldTransform().getOrigin(), &v = body->getLinearVelocity();
    const btVector3& spin = body->getAngularVelocity();
    const btQuaternion turn = body->getWorldTransform().getRotation();
    for (float value : {at.x(), at.y(), at.z(), turn.w(), turn.x(), turn.y(), turn.z(), v.x(),
                        v.y(), v.z(), spin.x(), spin.y(), spin.z()}) {
      *out++ = value;
    }
  }
}

}  // extern "C"
