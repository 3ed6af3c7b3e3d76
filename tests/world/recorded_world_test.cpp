/// Tests of recordings with calls: every call that changes a world is repeated with the same bits.
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>

#include "tests/support/temporary_folder.hpp"
#include "tests/world/random_bodies.hpp"

#include <gmock/gmock.h>

#include <concepts>
#include <fstream>
#include <iterator>
#include <limits>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using ::testing::HasSubstr;

JFPX_SOLVER_SUITE(RecordedWorlds);

Scene scene_of(Solver solver, Random* random) {
  Scene scene;
  scene.solver = solver;
  for (int i = 0; i < 25; ++i) scene.bodies.push_back(random_body(random, 2));
  return scene;
}

/// Steps a world of the recorded scene, with the recorded calls.
void expect_repeats(const std::string& path, const World& original) {
  RecordingReader reader(path);
  World world(reader.header().scene);
  for (std::uint64_t step = 1; step <= reader.steps(); ++step) {
    repeat_calls(reader, step, world);
    world.step();
    const auto difference = first_difference(reader.states(step), world.states());
    ASSERT_FALSE(difference) << "step " << step << ", body " << difference->body << ", "
                             << difference->field;
  }
  EXPECT_TRUE(std::ranges::equal(world.bodies(), original.bodies()));
  EXPECT_EQ(world.state_hash(), original.state_hash());
  for (const BodyId id : world.bodies()) {
    EXPECT_EQ(world.user_data(id), original.user_data(id));
    EXPECT_EQ(world.filter(id), original.filter(id));
    EXPECT_EQ(world.motion_locks(id), original.motion_locks(id));
  }
}

RecordableForce random_force(Random* random, std::span<const BodyId> bodies) {
  const auto any = [&] { return bodies[random->below(bodies.size())]; };
  const auto point = [&] { return random->uniform_in_box({-1, -1, -1}, {1, 1, 1}); };
  const auto number = [&] { return random->uniform(0.1_r, 2); };
  switch (random->below(8)) {
    case 0:
      return Gravity{point(), random->below(2) == 0 ? std::nullopt : std::optional(any())};
    case 1:
      return Drag{number(), number(), point(), any()};
    case 2:
      return Spring{{any(), point()}, {std::nullopt, point()}, number(), number(), number()};
    case 3:
      return Bungee{{std::nullopt, point()}, {any(), point()}, number(), number(), number()};
    case 4:
      return Aero{any(), diagonal(point()), point(), point()};
    case 5:
      return AeroControl{any(),   diagonal(point()), diagonal(point()),     diagonal(point()),
                         point(), point(),           random->uniform(-1, 1)};
    case 6:
      return Buoyancy{HalfSpace{{0, 1, 0}, number()}, 500 * number(), number(), any()};
    default:
      return Explosion{point(), number(), 10 * number(), 100, number(), number()};
  }
}

/// A change with random arguments.
void change(RecordedWorld& world, Random* random) {
  const std::span<const BodyId> bodies = world.world().bodies();
  const BodyId id = bodies[random->below(bodies.size())];
  const BodyId other = bodies[random->below(bodies.size())];
  const Vec3 vector = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  const Real number = random->uniform(0.1_r, 0.9_r);
  const bool movable = world.world().mass(id) > 0;
  const std::span<const ForceId> forces = world.world().forces();
  switch (random->below(24)) {
    case 0:
      world.add(random_body(random, 3));
      break;
    case 1:
      if (bodies.size() > 10) world.remove(id);
      break;
    case 2:
      world.set_state(id, {vector, random_rotation(random), vector, vector});
      break;
    case 3:
      world.wake(id);
      break;
    case 4:
      world.set_friction(id, number);
      break;
    case 5:
      world.set_restitution(id, number);
      break;
    case 6:
      world.set_acceleration(id, vector);
      break;
    case 7:
      world.set_damping(id, number, number);
      break;
    case 8:
      if (movable) world.set_mass(id, number);
      break;
    case 9:
      world.set_inertia(id, random->below(2) == 0
                                ? std::nullopt
                                : std::optional(diagonal({number, number, number})));
      break;
    case 10:
      world.set_user_data(id, random->next());
      break;
    case 11:
      world.set_filter(id, {.category = 1u << random->below(3), .mask = 7u});
      break;
    case 12:
      if (id != other) world.set_pair_ignored(id, other, random->below(2) == 0);
      break;
    case 13:
      world.apply_force(id, vector);
      break;
    case 14:
      world.apply_force_at_point(id, vector, vector);
      break;
    case 15:
      world.apply_torque(id, vector);
      break;
    case 18:
      world.apply_impulse(id, vector);
      break;
    case 19:
      world.apply_impulse_at_point(id, vector, vector);
      break;
    case 20:
      world.apply_angular_impulse(id, vector);
      break;
    case 21:
      if (world.world().settings().solver == Solver::soft_step) {
        world.set_motion_locks(id, random_locks(random));
      }
      break;
    case 22: {
      BodyDef def = world.world().definition(id);
      def.shape = random_body(random, 3).shape;
      if (!(def.mass > 0) || has_volume(def.shape)) world.replace(id, def);
      break;
    }
    case 16:
      world.add_force(random_force(random, bodies));
      break;
    case 17:
      if (!forces.empty()) world.remove_force(forces[random->below(forces.size())]);
      break;
    default:
      world.set_force(world.add_force(Gravity{vector}), Gravity{-vector});
  }
}

TEST_P(RecordedWorlds, RepeatRandomCallsBitForBit) {
  const TemporaryFolder folder;
  for (int run = 0; run < 5; ++run) {
    const std::uint64_t seed = fresh_seed();
    SCOPED_TRACE(trace(seed));
    Random random(seed);
    const std::string path = folder.file("run.rec");
    RecordedWorld world(path, scene_of(GetParam(), &random));
    for (int step = 0; step < 60; ++step) {
      for (std::uint64_t n = random.below(5); n > 0; --n) change(world, &random);
      world.step();
    }
    world.finish();
    EXPECT_TRUE(RecordingReader(path).has_calls());
    expect_repeats(path, world.world());
    if (HasFailure()) return;
  }
}

TEST_P(RecordedWorlds, HaveTheBitsOfAWorldWithoutARecording) {
  const TemporaryFolder folder;
  Random random(5);
  const Scene scene = scene_of(GetParam(), &random);
  World plain(scene);
  RecordedWorld recorded(folder.file("run.rec"), scene);
  const Drag drag{.linear = 1};
  plain.add_force(drag);
  recorded.add_force(drag);
  for (int step = 0; step < 30; ++step) {
    plain.step();
    recorded.step();
    ASSERT_EQ(plain.state_hash(), recorded.world().state_hash());
  }
}

TEST(RecordedWorld, WithoutCallsIsARecordingOfTheScene) {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  Random random(6);
  RecordedWorld world(path, scene_of(Solver::soft_step, &random));
  for (int step = 0; step < 10; ++step) world.step();
  world.finish();
  RecordingReader reader(path);
  EXPECT_FALSE(reader.has_calls());
  EXPECT_EQ(reader.states(10), world.world().states());
  expect_repeats(path, world.world());
}

TEST(RecordedWorld, DoesNotRecordCallsThatFail) {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  Random random(7);
  RecordedWorld world(path, scene_of(Solver::soft_step, &random));
  const Real nan = std::numeric_limits<Real>::quiet_NaN();
  EXPECT_THROW(world.remove({99, 0}), InvalidArgument);
  BodyDef bad;
  bad.mass = -1;
  EXPECT_THROW(world.add(bad), InvalidScene);
  EXPECT_THROW(world.add_force(Drag{.linear = -1}), InvalidArgument);
  const ForceId gravity = world.add_force(Gravity{});
  EXPECT_THROW(world.set_force(gravity, Drag{}), InvalidArgument);
  EXPECT_THROW(world.set_force(gravity, Gravity{{nan, 0, 0}}), InvalidArgument);
  world.step();
  world.finish();
  expect_repeats(path, world.world());
}

// A user's own force and a contact generator are refused by the compiler.
template <class F>
concept Recordable = requires(RecordedWorld& world, F force) {
  world.add_force(force);
};
template <class World>
concept HasGenerators = requires(World& world) {
  world.add_contact_generator([](ContactContext&) {});
};
inline constexpr auto kOwnForce = [](ForceContext&) {};
static_assert(Recordable<Spring> && !Recordable<decltype(kOwnForce)>);
static_assert(HasGenerators<jfpx::World> && !HasGenerators<RecordedWorld>);

TEST(RecordedWorld, EveryFlippedByteAndTruncationIsFound) {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.rec"), bad = folder.file("bad.rec");
  Scene scene;
  scene.bodies.resize(2);
  RecordedWorld world(path, scene);
  world.remove(world.world().bodies()[0]);
  world.step();
  world.step();
  world.finish();
  std::ifstream file(path, std::ios::binary);
  const std::string good(std::istreambuf_iterator<char>(file), {});
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bytes = good;
    bytes[i] = static_cast<char>(bytes[i] ^ 0x10);
    std::ofstream(bad, std::ios::binary) << bytes;
    EXPECT_THROW(RecordingReader{bad}, FileError) << "byte " << i;
  }
  for (std::size_t size = 0; size < good.size(); size += 7) {
    std::ofstream(bad, std::ios::binary) << good.substr(0, size);
    EXPECT_THROW(RecordingReader{bad}, FileError) << "size " << size;
  }
}

TEST(RecordedWorld, CallsThatTheWorldRefusesAreNamedByTheirStep) {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  Scene scene;
  scene.bodies.resize(2);
  RecordedWorld world(path, scene);
  world.step();
  world.remove(world.world().bodies()[0]);
  world.step();
  world.finish();
  RecordingReader reader(path);
  World another(scene);
  repeat_calls(reader, 1, another);
  repeat_calls(reader, 2, another);
  try {
    repeat_calls(reader, 2, another);
    ADD_FAILURE() << "a body was removed twice";
  } catch (const FileError& error) {
    EXPECT_THAT(error.what(), HasSubstr("before step 2"));
    EXPECT_THAT(error.what(), HasSubstr("body id"));
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
