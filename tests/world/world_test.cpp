/// Tests of World: addition and removal of bodies, reports, failures, contacts, determinism.
#include <jfpx/error.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <new>
#include <optional>
#include <span>

namespace jfpx {
namespace {

using test::operator""_r;

Scene two_balls() {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({1.5_r, 0, 0})};
  return scene;
}

TEST(World, AnEmptyWorldSteps) {
  World world{Scene{}};
  const StepReport report = world.step();
  EXPECT_EQ(report.step, 1u);
  EXPECT_EQ(report.contacts, 0u);
  EXPECT_TRUE(world.bodies().empty());
  EXPECT_EQ(world.state_hash(), state_hash({}));
}

TEST(World, RefusesThreadsInTheOptionsOfItsCollider) {
  try {
    const World world(Scene{}, {.collider = {.threads = 4}});
    ADD_FAILURE() << "no exception";
  } catch (const InvalidArgument& error) {
    EXPECT_STREQ(error.what(),
                 "collider.threads of a world is 4; it must be 1: WorldSettings::threads are those "
                 "of the whole step");
  }
}

TEST(World, RefusesDevicesThatCannotShareIt) {
  const auto refuse = [](const Scene& scene, const WorldSettings& settings, const char* message) {
    try {
      const World world(scene, settings);
      ADD_FAILURE() << "no exception; expected: " << message;
    } catch (const InvalidArgument& error) {
      EXPECT_STREQ(error.what(), message);
    }
  };
  refuse(Scene{}, {.collider = {.backend = Backend::cpu}, .devices = {0, 1}},
         "devices is {0, 1}, and the backend is cpu; it must be cuda or automatic");
  Scene of_thesis;
  of_thesis.solver = Solver::worst_first;
  refuse(of_thesis, {.devices = {0}},
         "devices is {0}, and the solver is worst_first; it must be soft_step");
  refuse(Scene{}, {.devices = std::vector<int>(9)},
         "devices has 9 numbers; at most 8 devices share a world");
}

TEST(World, StartsInTheStateOfTheScene) {
  Scene scene = two_balls();
  scene.bodies[0].velocity = {1, 2, 3};
  scene.bodies[1].angular_velocity = {4, 5, 6};
  World world(scene);
  Scene settings = scene;
  settings.bodies.clear();
  EXPECT_EQ(world.settings(), settings);
  const auto states = world.states();
  ASSERT_EQ(states.size(), 2u);
  EXPECT_EQ(states[0], (BodyState{{0, 0, 0}, {}, {1, 2, 3}, {}}));
  EXPECT_EQ(states[1], (BodyState{{1.5_r, 0, 0}, {}, {}, {4, 5, 6}}));
  EXPECT_EQ(world.state(world.bodies()[1]), states[1]);
}

TEST(World, StatesAreWrittenToMemoryThatIsKept) {
  Scene scene;
  for (int i = 0; i < 10000; ++i) {
    scene.bodies.push_back(test::ball({Real(2.5) * static_cast<Real>(i), 0, 0}));
  }
  World world(scene, {.threads = 3});
  std::vector<BodyState> states;
  world.states(&states);
  const BodyState* const memory = states.data();
  world.step();
  world.states(&states);
  EXPECT_EQ(states, world.states());
  world.remove(world.bodies()[3]);
  world.states(&states);
  EXPECT_EQ(states, world.states());
  EXPECT_EQ(states.data(), memory);
}

TEST(World, ReportsWhatAStepDid) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene = two_balls();
    scene.solver = solver;
    scene.bodies.push_back(test::half_space({0, 1, 0}, -0.5_r));
    World world(scene);
    world.step();
    const StepReport report = world.step();
    EXPECT_EQ(report.step, 2u);
    EXPECT_EQ(report.awake, 2u);
    EXPECT_EQ(report.backend, Backend::cpu);
    EXPECT_EQ(report.contacts, world.contacts().size());
    EXPECT_LE(report.integrate_ms + report.detect_ms + report.resolve_ms,
              report.total_ms * 1.001 + 1e-6);
    EXPECT_FALSE(report.iterations_exhausted);
    EXPECT_FALSE(report.non_finite);
  }
}

TEST(World, ContactsAreSpherePairsFirstEachByBody) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.bodies = {test::half_space({0, 1, 0}, 0), test::ball({0, 0.9_r, 0}),
                    test::ball({1.5_r, 0.9_r, 0}), test::half_space({0, 0, 1}, -0.9_r),
                    test::ball({0, 0.9_r, 0}, 1, 0)};
    World world(scene);
    const StepReport report = world.step();
    EXPECT_EQ(report.sphere_contacts, 3u);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (const Contact& c : world.contacts()) pairs.push_back({c.a.index, c.b.index});
    // The immovable ball 4 touches the half-spaces too, which is no contact.
    EXPECT_EQ(pairs, (std::vector<std::pair<std::uint32_t, std::uint32_t>>{
                         {1, 2}, {1, 4}, {2, 4}, {1, 0}, {1, 3}, {2, 0}, {2, 3}}));
    EXPECT_EQ(world.contacts()[3].normal, (Vec3{0, 1, 0}));
    EXPECT_EQ(world.contacts()[3].distance, 0.9_r - 1);
  }
}

TEST(World, ContactsNameANewBodyByItsOwnId) {
  World world(two_balls());
  const BodyId old = world.bodies()[0], other = world.bodies()[1];
  world.step();
  ASSERT_EQ(world.contacts().size(), 1u);
  EXPECT_EQ(world.contacts()[0].a, old);
  EXPECT_EQ(world.contacts()[0].b, other);
  world.remove(old);
  const BodyId fresh = world.add(test::ball({0, 0, 0}));
  ASSERT_EQ(fresh.index, old.index);
  world.step();
  ASSERT_EQ(world.contacts().size(), 1u);
  EXPECT_EQ(world.contacts()[0].a, fresh);
  EXPECT_EQ(world.contacts()[0].b, other);
}

TEST(World, BodiesAreAddedAndRemovedAtAnyTime) {
  World world(two_balls());
  world.step();
  const BodyId first = world.bodies()[0], second = world.bodies()[1];
  world.remove(first);
  EXPECT_TRUE(world.contacts().empty());
  world.step();
  const BodyId third = world.add(test::ball({9, 9, 9}));
  EXPECT_EQ(std::vector<BodyId>(world.bodies().begin(), world.bodies().end()),
            (std::vector<BodyId>{third, second}));
  EXPECT_EQ(world.step().contacts, 0u);
  EXPECT_EQ(world.states()[0].position, (Vec3{9, 9, 9}));
  world.remove(second);
  world.remove(third);
  EXPECT_TRUE(world.states().empty());
  world.step();
}

TEST(World, TheRemovalOfManyBodiesWakesTheNeighborsOfEachAndNoOthers) {
  constexpr std::uint32_t kStacks = 8, kRemoved = 5;
  Scene scene;
  scene.bodies = {test::ground()};
  for (std::uint32_t i = 0; i < 2 * kStacks; ++i) {
    BodyDef crate;
    crate.shape = Box{};
    crate.position = {4 * static_cast<Real>(i / 2), i % 2 == 0 ? 0.5_r : 1.5_r, 0};
    scene.bodies.push_back(crate);
  }
  World world(scene);
  StepReport report;
  for (int n = 0; n < 200; ++n) report = world.step();
  ASSERT_EQ(report.awake, 0u);
  const std::span<const BodyId> now = world.bodies();
  const std::vector<BodyId> ids(now.begin(), now.end());
  for (std::uint32_t stack = 0; stack < kRemoved; ++stack) world.remove(ids[1 + 2 * stack]);
  for (std::uint32_t stack = 0; stack < kStacks; ++stack) {
    EXPECT_EQ(world.awake(ids[2 + 2 * stack]), stack < kRemoved) << stack;
  }
  // The new body has the index, and not the contacts, of a removed one.
  world.add(scene.bodies[1]);
  World other(scene);
  other.restore(world.snapshot());
  for (int n = 0; n < 50; ++n) {
    ASSERT_EQ(world.step().awake, other.step().awake);
    ASSERT_EQ(world.state_hash(), other.state_hash()) << n;
  }
}

TEST(World, AnUnknownIdIsAnError) {
  World world(two_balls());
  const BodyId gone = world.bodies()[0];
  world.remove(gone);
  EXPECT_THROW(world.remove(gone), InvalidArgument);
  EXPECT_THROW(world.state(gone), InvalidArgument);
  EXPECT_THROW(world.awake(BodyId{}), InvalidArgument);
  EXPECT_THROW(world.set_state({7, 0}, {}), InvalidArgument);
}

TEST(World, AnIdOfAnotherWorldRefersToTheSameIndexOrNone) {
  Scene more = two_balls();
  more.bodies.push_back(test::ball({9, 0, 0}));
  World here(two_balls());
  const World other(more);
  EXPECT_EQ(here.state(other.bodies()[1]), here.states()[1]);
  EXPECT_THROW(here.state(other.bodies()[2]), InvalidArgument);
  here.remove(here.bodies()[1]);
  here.add(test::ball({5, 0, 0}));  // the same index, but another generation
  EXPECT_THROW(here.state(other.bodies()[1]), InvalidArgument);
}

TEST(World, AHugeStepIsUndoneWhereItLeadsOutOfTheWorld) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.dt = std::numeric_limits<Real>::max();
    scene.bodies = {test::ball({0, 0, 0}), test::half_space({0, 1, 0}, -1)};
    World resting(scene);
    EXPECT_FALSE(resting.step().non_finite);
    EXPECT_EQ(resting.states()[0].position, Vec3{});
    scene.bodies[0].velocity = {1, 0, 0};
    World flying(scene);
    const auto before = flying.states();
    const StepReport report = flying.step();
    EXPECT_TRUE(report.non_finite);
    EXPECT_EQ(report.non_finite_body, flying.bodies()[0]);
    EXPECT_EQ(flying.states(), before);
  }
}

TEST(World, ASpinWithoutADirectionIsUndone) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.bodies = {test::ball({0, 0, 0})};
    scene.bodies[0].angular_velocity = {0, std::sqrt(std::numeric_limits<Real>::max()) * 1000, 0};
    World world(scene);
    const auto before = world.states();
    EXPECT_TRUE(world.step().non_finite);
    EXPECT_EQ(world.states(), before);
    EXPECT_NO_THROW(world.set_state(world.bodies()[0], before[0]));
  }
}

TEST(World, SetStateRefusesInvalidStates) {
  World world(two_balls());
  const BodyId id = world.bodies()[0];
  const auto before = world.states();
  BodyState bad;
  bad.velocity.y = std::numeric_limits<Real>::infinity();
  EXPECT_THROW(world.set_state(id, bad), InvalidArgument);
  bad = {};
  bad.orientation = {0, 0, 0, 0};
  EXPECT_THROW(world.set_state(id, bad), InvalidArgument);
  EXPECT_EQ(world.states(), before);
}

TEST(World, AnObstacleCanBeMoved) {
  Scene scene;
  BodyDef box = test::ground();
  box.shape = Box{{1, 1, 1}};
  box.position = {50, 0, 0};
  scene.bodies = {test::ball({0, 0, 0}), box};
  World world(scene);
  EXPECT_EQ(world.step().contacts, 0u);
  world.set_state(world.bodies()[1], {{1.9_r, 0, 0}, {}, {9, 9, 9}, {}});
  EXPECT_EQ(world.state(world.bodies()[1]).velocity, Vec3{});
  EXPECT_EQ(world.step().contacts, 1u);
}

TEST(World, FindsTheBodyOfAnIndexAndItsShape) {
  Scene scene;
  scene.bodies = {test::ball({0, 0, 0}), test::ball({5, 0, 0}, 2), test::ball({9, 0, 0})};
  World world(scene);
  const BodyId first = world.bodies()[0], second = world.bodies()[1], third = world.bodies()[2];
  world.remove(first);
  EXPECT_FALSE(world.contains(first));
  EXPECT_TRUE(world.contains(third));
  EXPECT_FALSE(world.contains({}));
  EXPECT_EQ(world.body_at(third.index), third) << "an index is not a position in bodies()";
  EXPECT_THROW(world.body_at(first.index), InvalidArgument);
  EXPECT_THROW(world.body_at(3), InvalidArgument);
  EXPECT_EQ(world.shape(second), Shape(Sphere{2}));
  EXPECT_THROW(world.shape(first), InvalidArgument);
  const BodyId fourth = world.add(test::ball({20, 0, 0}));
  EXPECT_EQ(fourth.index, first.index);
  EXPECT_EQ(world.body_at(first.index), fourth);
  EXPECT_FALSE(world.contains(first));
}

TEST(World, AMovableHalfSpaceIsRefusedByName) {
  Scene scene = two_balls();
  BodyDef def;
  def.shape = HalfSpace{};
  scene.bodies.push_back(def);
  try {
    World world(scene);
    ADD_FAILURE() << "no error";
  } catch (const InvalidScene& error) {
    EXPECT_STREQ(error.what(),
                 "body 2: mass is 1; it must be 0 for a half-space, which fills half of the world");
  }
  World world(two_balls());
  EXPECT_THROW(world.add(def), InvalidScene);
  EXPECT_EQ(world.bodies().size(), 2u);
}

TEST(World, ARunawayBodyIsNamedAndTheStateKept) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene = two_balls();
    scene.solver = solver;
    BodyDef runaway = test::ball({0, 50, 0});
    runaway.velocity = {0, std::numeric_limits<Real>::max() / 2, 0};
    scene.bodies.push_back(runaway);
    World world(scene);
    const auto before = world.states();
    const BodyId id = world.bodies()[2];
    for (int n = 0; n < 3; ++n) {
      const StepReport report = world.step();
      ASSERT_TRUE(report.non_finite);
      ASSERT_EQ(report.non_finite_body, id);
      ASSERT_EQ(report.step, 0u);
      ASSERT_EQ(world.states(), before);
      ASSERT_TRUE(world.contacts().empty());
    }
    world.remove(id);
    EXPECT_FALSE(world.step().non_finite);
    EXPECT_NE(world.states()[0], before[0]);
  }
}

TEST(World, LeavingTheCoordinateRangeIsReported) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene;
    scene.solver = solver;
    scene.dt = 1;
    scene.bodies = {test::ball({0.999e9_r, 0, 0})};
    scene.bodies[0].velocity = {1e7_r, 0, 0};
    World world(scene);
    EXPECT_TRUE(world.step().non_finite);
    EXPECT_EQ(world.states()[0].position.x, 0.999e9_r);
  }
}

/// A collider that finds nothing, and fails on demand.
class FailingCollider final : public SphereCollider {
 public:
  explicit FailingCollider(const int* fails) : fails_(fails) {}
  ContactSpan find_contacts(std::span<const SphereInstance>) override {
    if (*fails_ == 1) throw DeviceError("the device is gone");
    if (*fails_ == 2) throw std::bad_alloc();
    return {};
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance>,
                                             std::span<const SpherePair>) override {
    return {};
  }
  Backend backend() const noexcept override { return Backend::cpu; }
  SphereAlgorithm algorithm() const noexcept override { return SphereAlgorithm::all_pairs; }

 private:
  const int* fails_;
};

TEST(World, AStepThatThrowsLeavesTheStateUnchanged) {
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    Scene scene = two_balls();
    scene.solver = solver;
    for (BodyDef& def : scene.bodies) def.acceleration = {0, -9.81_r, 0};
    int fails = 0;
    World world(scene, std::make_unique<FailingCollider>(&fails));
    World twin(scene, std::make_unique<FailingCollider>(&fails));
    world.step();
    twin.step();
    const auto before = world.states();
    fails = 1;
    EXPECT_THROW(world.step(), DeviceError);
    EXPECT_EQ(world.states(), before);
    fails = 2;
    EXPECT_THROW(world.step(), OutOfMemory);
    EXPECT_EQ(world.states(), before);
    fails = 0;
    EXPECT_EQ(world.step().step, 2u);
    twin.step();
    EXPECT_EQ(world.state_hash(), twin.state_hash());
  }
}

TEST(World, NeedsACollider) { EXPECT_THROW(World(two_balls(), nullptr), InvalidArgument); }

TEST(World, CanBeMoved) {
  World a(two_balls());
  a.step();
  const std::uint64_t hash = a.state_hash();
  World b(std::move(a));
  EXPECT_EQ(b.state_hash(), hash);
  a = std::move(b);
  EXPECT_EQ(a.state_hash(), hash);
}

/// Expects the same hash after some steps with each algorithm and number of threads.
void expect_one_hash(Scene scene, int steps, std::span<const SphereAlgorithm> algorithms) {
  for (const Solver solver : test::kSolvers) {
    scene.solver = solver;
    std::optional<std::uint64_t> expected;
    for (const SphereAlgorithm algorithm : algorithms) {
      for (const unsigned threads : {1u, 2u, 3u, 8u}) {
        World world(scene, {.collider = {.algorithm = algorithm}, .threads = threads});
        for (int n = 0; n < steps; ++n) world.step();
        if (!expected) expected = world.state_hash();
        ASSERT_EQ(world.state_hash(), *expected)
            << scene.name << ", " << to_string(solver) << ", threads " << threads;
      }
    }
  }
}

TEST(Determinism, ThreadsAlgorithmsAndRepeatsGiveTheSameBits) {
  using enum SphereAlgorithm;
  for (const std::string_view name : {"pile", "gas", "polydisperse"}) {
    expect_one_hash(scenes::make(name, {.spheres = 200, .seed = 3}), 40,
                    std::array{automatic, all_pairs, grid});
    // Enough spheres for several threads to sort and search cells.
    expect_one_hash(scenes::make(name, {.spheres = 20'000, .seed = 3}), 2,
                    std::array{automatic, grid});
  }
}

TEST(StateHash, DependsOnEveryBitOfEveryField) {
  const BodyState state{{1, 2, 3}, {1, 0, 0, 0}, {4, 5, 6}, {7, 8, 9}};
  std::vector<BodyState> states(3, state);
  const std::uint64_t hash = state_hash(states);
  Real* values = &states[1].position.x;
  for (int i = 0; i < 13; ++i) {
    const Real old = values[i];
    values[i] = std::nextafter(old, Real(100));
    EXPECT_NE(state_hash(states), hash) << i;
    values[i] = old;
  }
  EXPECT_EQ(state_hash(states), hash);
  states.pop_back();
  EXPECT_NE(state_hash(states), hash);
}

TEST(StateHash, DistinguishesMinusZeroFromZeroAndTheOrderOfBodies) {
  BodyState plus, minus;
  minus.velocity.x = -Real(0);
  const BodyState one[] = {plus, minus}, other[] = {minus, plus}, same[] = {plus, plus};
  EXPECT_NE(state_hash(one), state_hash(same));
  EXPECT_NE(state_hash(one), state_hash(other));
}

}  // namespace
}  // namespace jfpx
