/// jfpx's sphere-sphere algorithm in a stock dispatcher, for programs with their own dispatcher.
#include <jfpx/bullet/algorithm.hpp>

#include <btBulletDynamicsCommon.h>

#include <cstdio>

int main() {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  jfpx::bullet::SphereSphereAlgorithm::CreateFunc create;  // must outlive the dispatcher
  dispatcher.registerCollisionCreateFunc(SPHERE_SHAPE_PROXYTYPE, SPHERE_SHAPE_PROXYTYPE, &create);

  btDbvtBroadphase broadphase;
  btCollisionWorld world(&dispatcher, &broadphase, &configuration);
  btSphereShape sphere(1);
  btCollisionObject a, b;
  a.setCollisionShape(&sphere);
  b.setCollisionShape(&sphere);
  b.getWorldTransform().setOrigin(btVector3(btScalar(1.5), 0, 0));
  world.addCollisionObject(&a);
  world.addCollisionObject(&b);
  world.performDiscreteCollisionDetection();

  const btPersistentManifold& manifold = *dispatcher.getManifoldByIndexInternal(0);
  std::printf("%d contact at a distance of %g\n", manifold.getNumContacts(),
              static_cast<double>(manifold.getContactPoint(0).getDistance()));
  world.removeCollisionObject(&b);
  world.removeCollisionObject(&a);
}
