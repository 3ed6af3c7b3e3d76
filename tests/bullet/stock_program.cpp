/// A Bullet program that has never heard of jfpx: drops spheres, prints a hash of where they end.
/// Each argument is the number of spheres of one more world; every world has a thread of its own.
#include <btBulletDynamicsCommon.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <vector>

namespace {

std::uint64_t hash_of(const btRigidBody& body, std::uint64_t hash) {
  unsigned char bytes[3 * sizeof(btScalar)];
  std::memcpy(bytes, body.getWorldTransform().getOrigin().m_floats, sizeof bytes);
  for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3u;  // FNV-1a
  return hash;
}

std::uint64_t drop(int spheres) {
  btDefaultCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity(btVector3(0, -10, 0));
  btStaticPlaneShape ground_shape(btVector3(0, 1, 0), 0);
  btSphereShape sphere_shape(btScalar(0.5));
  std::vector<btRigidBody*> bodies;
  bodies.push_back(new btRigidBody(0, nullptr, &ground_shape));
  for (int i = 0; i < spheres; ++i) {
    bodies.push_back(new btRigidBody(1, nullptr, &sphere_shape, btVector3(1, 1, 1)));
    btTransform pose = btTransform::getIdentity();
    pose.setOrigin(btVector3(btScalar(i % 5) * btScalar(0.9) + btScalar(i) * btScalar(0.001),
                             btScalar(0.4) + btScalar(i / 25) * btScalar(0.9),
                             btScalar(i / 5 % 5) * btScalar(0.9)));
    bodies.back()->setWorldTransform(pose);
  }
  for (btRigidBody* body : bodies) world.addRigidBody(body);
  for (int step = 0; step < 60; ++step) world.stepSimulation(btScalar(1) / 60, 0);
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (btRigidBody* body : bodies) {
    hash = hash_of(*body, hash);
    world.removeRigidBody(body);
    delete body;
  }
  return hash;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::uint64_t> hashes(static_cast<std::size_t>(argc));
  std::vector<std::thread> threads;
  for (int i = 1; i < argc; ++i) {
    threads.emplace_back(
        [&hashes, argv, i] { hashes[static_cast<std::size_t>(i)] = drop(std::atoi(argv[i])); });
  }
  for (std::thread& thread : threads) thread.join();
  for (int i = 1; i < argc; ++i) {
    std::printf("%016llx\n", static_cast<unsigned long long>(hashes[static_cast<std::size_t>(i)]));
  }
  return argc == 1 ? 7 : 0;
}
