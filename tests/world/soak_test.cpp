/// Long runs of worlds that never come to rest, with bodies and forces that are added and removed:
/// the memory use stays constant.
#include "tests/support/soak.hpp"

#include <jfpx/thesis/particle.hpp>

#include "tests/world/bouncing_bodies.hpp"

#include <deque>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

JFPX_SOLVER_SUITE(Soak);

TEST_P(Soak, AWorldWithChangingBodiesKeepsItsMemoryFlat) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  constexpr Real kRoom = 3;
  Scene scene = empty_scene();
  scene.bodies = walls(kRoom);
  World world(scene);
  std::deque<BodyId> bodies;
  for (int i = 0; i < 12; ++i) bodies.push_back(world.add(bouncing_body(&random, kRoom - 2)));
  std::uint64_t contacts = 0, failed = 0;
  expect_flat_memory(soak_steps(), [&](std::uint64_t n) {
    if (n % 50 == 0) {
      world.remove(bodies.front());
      bodies.pop_front();
      bodies.push_back(world.add(bouncing_body(&random, kRoom - 2)));
    }
    if (n % 70 == 0) world.add_force(Drag{.linear = Real(0.1), .body = bodies.back()});
    if (n % 70 == 35) world.remove_force(world.forces().front());
    const StepReport report = world.step();
    contacts += report.contacts;
    failed += report.non_finite ? 1 : 0;
  });
  EXPECT_GT(contacts, soak_steps() / 10);
  EXPECT_EQ(failed, 0u);
}

TEST(Soak, ParticlesThatAreAddedAndRemovedKeepTheirMemoryFlat) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  Random random(seed);
  ParticleWorld world({.grounds = {HalfSpace{}}});
  std::deque<ParticleId> particles;
  const auto add = [&] {
    ParticleDef def;
    def.radius = Real(0.2);
    def.restitution = 1;
    def.position = random.uniform_in_box({-1, 1, -1}, {1, 4, 1});
    particles.push_back(world.add(def));
  };
  for (int i = 0; i < 20; ++i) add();
  std::uint64_t contacts = 0;
  expect_flat_memory(soak_steps(), [&](std::uint64_t n) {
    if (n % 20 == 0) {
      world.remove(particles.front());
      particles.pop_front();
      add();
    }
    contacts += world.step().contacts;
  });
  EXPECT_GT(contacts, soak_steps() / 10);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
