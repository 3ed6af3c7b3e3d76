/// The dispatcher's input of a collider does not change if nothing moves. A device receives only
/// blocks of 4 KiB that differ from the previous call, and therefore nothing.
#include <jfpx/bullet/scene_world.hpp>

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kBlock = 4096;

template <class T>
std::size_t differing_blocks(std::span<const T> now, std::span<const T> before) {
  std::size_t blocks = 0;
  constexpr std::size_t kValues = kBlock / sizeof(T);
  for (std::size_t i = 0; i < now.size(); i += kValues) {
    const std::size_t past = std::min(now.size(), i + kValues);
    blocks += past > before.size() || std::memcmp(&now[i], &before[i], (past - i) * sizeof(T)) != 0;
  }
  return blocks;
}

/// Computes on the CPU, and counts the bytes that would be sent to a device.
class WatchedCollider final : public SphereCollider {
 public:
  explicit WatchedCollider(std::size_t* blocks) : blocks_(blocks) {}

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return cpu_->find_contacts(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    *blocks_ = differing_blocks(spheres, std::span<const SphereInstance>(spheres_)) +
               differing_blocks(pairs, std::span<const SpherePair>(pairs_));
    spheres_.assign(spheres.begin(), spheres.end());
    pairs_.assign(pairs.begin(), pairs.end());
    return cpu_->find_touching(spheres, pairs);
  }
  Backend backend() const noexcept override { return Backend::cpu; }
  SphereAlgorithm algorithm() const noexcept override { return cpu_->algorithm(); }

 private:
  std::size_t* blocks_;
  std::vector<SphereInstance> spheres_;
  std::vector<SpherePair> pairs_;
  std::unique_ptr<SphereCollider> cpu_ = make_sphere_collider({.backend = Backend::cpu});
};

constexpr int kSide = 40;

/// Layers of spheres, each near its neighbours, above a floor.
Scene layers() {
  Scene scene;
  BodyDef floor;
  floor.shape = Box{{kSide, 1, kSide}};
  floor.mass = 0;
  floor.position = {0, -1, 0};
  scene.bodies.push_back(floor);
  for (int i = 0; i < kSide * kSide; ++i) {
    BodyDef sphere;
    sphere.shape = Sphere{Real(0.5)};
    sphere.position = {Real(i % kSide) * Real(1.01), Real(0.5), Real(i / kSide) * Real(1.01)};
    scene.bodies.push_back(sphere);
  }
  return scene;
}

/// Steps until nothing has changed for some steps; false if that takes too long.
bool come_to_rest(SceneWorld* world) {
  std::uint64_t before = 0;
  for (int step = 0, same = 0; step < 1000; ++step) {
    world->step();
    const std::uint64_t now = world->state_hash();
    same = std::exchange(before, now) == now ? same + 1 : 0;
    if (same == 5) return true;
  }
  return false;
}

/// Moves a sphere directly, but within its AABB, so that no pair is added or removed.
void nudge(SceneWorld* world, std::size_t body) {
  btRigidBody* sphere = world->bodies()[body];
  sphere->getWorldTransform().getOrigin() += btVector3(0, btScalar(0.001), 0);
}

void dispatch(SceneWorld* world) {
  world->dispatcher().dispatchAllCollisionPairs(
      world->world().getPairCache(), world->world().getDispatchInfo(), &world->dispatcher());
}

TEST(DeviceTraffic, ListsOfARestingWorldDoNotChange) {
  std::size_t blocks = 0;
  SceneWorldOptions options;
  options.dispatch.minimum_batch = 0;
  options.make_collider = [&] { return std::make_unique<WatchedCollider>(&blocks); };
  SceneWorld world(layers(), options);
  world.step();
  const std::size_t all = blocks;
  const auto pairs =
      static_cast<std::size_t>(world.world().getPairCache()->getNumOverlappingPairs());
  EXPECT_EQ(all, (kSide * kSide * sizeof(SphereInstance) + sizeof(SphereInstance) - 1) / kBlock +
                     1 + (pairs * sizeof(SpherePair) - 1) / kBlock + 1);
  ASSERT_TRUE(come_to_rest(&world));
  world.bodies()[7]->activate();  // the lists of a world without active bodies are not passed on
  for (int i = 0; i < 3; ++i) {
    dispatch(&world);
    EXPECT_EQ(blocks, 0u);
  }
  nudge(&world, 7);
  dispatch(&world);
  EXPECT_EQ(blocks, 1u);
  dispatch(&world);
  EXPECT_EQ(blocks, 0u);
}

TEST(DeviceTraffic, NothingIsSentForARestingWorld) {
  const auto backends = available_backends();
  const bool usable = std::any_of(
      backends.begin(), backends.end(),
      [](const BackendStatus& status) { return status.backend == Backend::cuda && status.usable; });
  if (!usable) {
    if (std::getenv("JFPX_REQUIRE_CUDA") != nullptr) FAIL() << "no CUDA device";
    GTEST_SKIP() << "no CUDA device";
  }
  SceneWorldOptions options;
  options.dispatch.minimum_batch = 0;
  options.dispatch.collider.backend = Backend::cuda;
  SceneWorld world(layers(), options);
  const auto sent = [&] { return world.jfpx_dispatcher()->stats().to_device; };
  world.step();
  EXPECT_GT(sent(), std::uint64_t{kSide * kSide * sizeof(SphereInstance)});
  ASSERT_TRUE(come_to_rest(&world));
  std::uint64_t before = sent();
  for (int step = 0; step < 3; ++step) world.step();
  world.bodies()[7]->activate();
  for (int i = 0; i < 3; ++i) dispatch(&world);
  EXPECT_EQ(sent() - before, 0u);
  nudge(&world, 7);
  before = sent();
  dispatch(&world);
  EXPECT_EQ(sent() - before, kBlock);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
