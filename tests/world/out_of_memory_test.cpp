/// Tests with every allocation failing once, in steps, additions, reading and writing: the failure
/// is an error, the state is unchanged, nothing leaks, and later results have the same bits.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/thesis/particle.hpp>

#include "src/base/atomic_file.hpp"
#include "tests/support/failing_new.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/world/random_bodies.hpp"

#include <algorithm>
#include <array>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

const std::array<WorldSettings, 5> kSettings{{
    {.collider = {.backend = Backend::cpu, .algorithm = SphereAlgorithm::all_pairs}},
    {.collider = {.backend = Backend::cpu, .algorithm = SphereAlgorithm::grid}, .threads = 3},
    {.collider = {}},
    {.collider = {.backend = Backend::cpu}, .broad_phase = BroadPhase::hierarchy},
    {.collider = {.backend = Backend::cpu}, .broad_phase = BroadPhase::brute_force},
}};

JFPX_SOLVER_SUITE(OutOfMemoryInAWorld);

/// Bodies of all shapes, in contact.
Scene dense_scene(std::uint64_t seed, Solver solver) {
  Random random(seed);
  Scene scene;
  scene.solver = solver;
  for (int i = 0; i < 40; ++i) scene.bodies.push_back(random_body(&random, 2));
  BodyDef platform;
  platform.shape = Box{{3, Real(0.2), 3}};
  platform.mass = 0;
  platform.kinematic = true;
  platform.position = {0, -2, 0};
  platform.velocity = {1, 0, 0};
  scene.bodies.push_back(platform);
  scene.bodies.push_back(ground());
  BodyDef zone = ball({0, 0, 0}, 1, 0);
  zone.sensor = true;
  scene.bodies.push_back(zone);
  scene.bodies[4].filter = {.category = 2, .mask = 1};
  scene.ignored_pairs = {{8, 9}, {2, 6}};
  scene.resolver.max_iterations = 100;
  return scene;
}

/// Makes the same world in every call.
World make_world(const Scene& scene, const WorldSettings& settings, int steps,
                 bool with_generator = true) {
  World world(scene, settings);
  const BodyId first = world.bodies()[0], second = world.bodies()[1];
  world.add_force(Spring{.a = {first}, .b = {second}, .stiffness = 5, .rest_length = 1});
  if (with_generator) {
    world.add_contact_generator([first, second](ContactContext& context) {
      context.add({.a = first, .b = second, .normal = {0, 1, 0}});
    });
  }
  for (int n = 0; n < steps; ++n) world.step();
  return world;
}

/// Observable results of a step.
struct Moment {
  std::uint64_t hash = 0;
  std::vector<Contact> contacts;
  std::vector<ContactEvent> events;
  friend bool operator==(const Moment&, const Moment&) = default;
};
std::vector<Moment> follow(World& world, int steps) {
  std::vector<Moment> moments;
  for (int n = 0; n < steps; ++n) {
    world.step();
    moments.push_back({world.state_hash(),
                       {world.contacts().begin(), world.contacts().end()},
                       {world.contact_events().begin(), world.contact_events().end()}});
  }
  return moments;
}

TEST_P(OutOfMemoryInAWorld, AStepIsUndoneWhicheverAllocationFails) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed, GetParam());
  for (std::size_t i = 0; i < kSettings.size(); ++i) {
    for (const int warm : {0, 1, 4}) {
      SCOPED_TRACE("settings " + std::to_string(i) + " after " + std::to_string(warm) + " steps");
      World undisturbed = make_world(scene, kSettings[i], warm);
      const std::vector<Moment> expected = follow(undisturbed, 3);
      const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
        const std::size_t alive = live_allocations();
        {
          World world = make_world(scene, kSettings[i], warm);
          const std::uint64_t before = world.state_hash();
          const double time = world.time();
          const bool failed = runs_out(k, shortage, [&] { world.step(); });
          if (failed) {
            EXPECT_TRUE(world.state_hash() == before && world.time() == time) << k;
            EXPECT_TRUE(world.contacts().empty() && world.contact_events().empty()) << k;
            EXPECT_TRUE(follow(world, 3) == expected) << k;
          } else {
            const std::vector<Moment> rest(expected.begin() + 1, expected.end());
            EXPECT_EQ(world.state_hash(), expected[0].hash) << k;
            EXPECT_TRUE(follow(world, 2) == rest) << k;
          }
        }
        EXPECT_EQ(live_allocations(), alive) << k;
        return FailingNew::failed() && !testing::Test::HasFailure();
      });
      if (warm == 0) {
        EXPECT_GT(failures, 20u);
      }
    }
  }
}

TEST_P(OutOfMemoryInAWorld, AStepNamesTheBodiesAndAnAmountOfMemory) {
  const Scene scene = dense_scene(4, GetParam());
  std::size_t named = 0;
  with_every_failure([&](std::size_t k, Shortage) {
    World world = make_world(scene, kSettings[0], 0);
    std::string message;
    try {
      FailingNew failing(k, Shortage::once);
      world.step();
    } catch (const OutOfMemory& error) {
      message = error.what();
    } catch (const std::bad_alloc&) {
    }
    if (message.find("step of 43 bodies") != std::string::npos) {
      ++named;
      const std::size_t number = message.find_first_of("0123456789", message.find("about "));
      EXPECT_GE(std::stoull(message.substr(number)), 43 * sizeof(BodyDef)) << message;
    }
    return FailingNew::failed();
  });
  EXPECT_GT(named, 5u);
}

TEST_P(OutOfMemoryInAWorld, AFailedAdditionLeavesNoTrace) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed, GetParam());
  BodyDef def;
  def.shape = Compound{
      {{.shape = Sphere{}, .position = {0, 0, -1}}, {.shape = Box{}, .position = {0, 0, 1}}}};
  def.shape = centred(std::get<Compound>(def.shape));
  const auto body = [&](World& world) { world.add(def); };
  const auto force = [](World& world) { world.add_force(Drag{.linear = 1}); };
  const auto generator = [](World& world) {
    const std::array<BodyId, 4> far{world.bodies()[2], world.bodies()[3], {}, {}};
    world.add_contact_generator([far](ContactContext& context) {
      context.add({.a = far[0], .b = far[1], .normal = {1, 0, 0}});
    });
  };
  const auto pair = [](World& world) {
    world.set_pair_ignored(world.bodies()[1], world.bodies()[7], true);
    world.set_pair_ignored(world.bodies()[7], world.bodies()[3], true);
  };
  const auto joint = [](World& world) {
    const auto movable = std::ranges::find_if(
        world.bodies(), [&](BodyId id) { return id.index > 7 && world.mass(id) > 0; });
    world.add_joint(DistanceJoint{.a = world.bodies()[1], .b = *movable});
  };
  const auto comes = [&](const auto& come, bool into_a_gap) {
    const auto make = [&] {
      World world = make_world(scene, kSettings[0], 3);
      if (into_a_gap) world.remove(world.bodies()[5]);
      if (into_a_gap) world.step();
      return world;
    };
    World undisturbed = make();
    come(undisturbed);
    const std::vector<Moment> expected = follow(undisturbed, 3);
    const std::vector<BodyId> bodies(undisturbed.bodies().begin(), undisturbed.bodies().end());
    return with_every_failure([&](std::size_t k, Shortage shortage) {
      World world = make();
      const std::size_t contacts = world.contacts().size(), count = world.bodies().size();
      if (runs_out(k, shortage, [&] { come(world); })) {
        EXPECT_EQ(world.bodies().size(), count) << k;
        EXPECT_EQ(world.contacts().size(), contacts) << k;
        come(world);
      }
      EXPECT_TRUE(std::ranges::equal(world.bodies(), bodies)) << k;
      EXPECT_TRUE(follow(world, 3) == expected) << k;
      return FailingNew::failed() && !testing::Test::HasFailure();
    });
  };
  for (const bool into_a_gap : {false, true}) {
    SCOPED_TRACE(into_a_gap ? "into a gap" : "at the end");
    EXPECT_GT(comes(body, into_a_gap), 0u);
    EXPECT_GT(comes(force, into_a_gap), 0u);
    EXPECT_GT(comes(generator, into_a_gap), 0u);
    EXPECT_GT(comes(pair, into_a_gap), 0u);
    if (GetParam() == Solver::worst_first) continue;  // it has no joints
    EXPECT_GT(comes(joint, into_a_gap), 0u);
  }
}

TEST_P(OutOfMemoryInAWorld, AFailedAdditionOfABodyWithGivenInertiaLeavesTheSnapshot) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed, GetParam());
  BodyDef def;
  def.mass = 1;
  def.inertia = diagonal({1, 2, 2});
  EXPECT_GT(with_every_failure([&](std::size_t k, Shortage shortage) {
              World world = make_world(scene, kSettings[0], 3);
              const Snapshot before = world.snapshot();
              const bool failed = runs_out(k, shortage, [&] { world.add(def); });
              EXPECT_EQ(world.snapshot() == before, failed) << k;
              return FailingNew::failed() && !testing::Test::HasFailure();
            }),
            0u);
}

TEST_P(OutOfMemoryInAWorld, AFailedRestorationLeavesNoTrace) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed, GetParam());
  World earlier = make_world(scene, kSettings[0], 2), later = make_world(scene, kSettings[0], 5);
  const Snapshot snapshot = earlier.snapshot(), unchanged = later.snapshot();
  const Hull cube;  // the default hull is allocated once
  const std::vector<Moment> expected = follow(earlier, 2), others = follow(later, 2);
  const std::size_t failures = with_some_failures(seed, [&](std::size_t k, Shortage shortage) {
    const std::size_t alive = live_allocations();
    {
      World world = make_world(scene, kSettings[0], 5);
      world.remove_force(world.forces()[0]);  // so that a force is created, too
      world.restore(unchanged);
      Snapshot copy;
      const bool no_copy = runs_out(k, shortage, [&] { copy = world.snapshot(); });
      EXPECT_TRUE(copy == (no_copy ? Snapshot() : unchanged)) << k;
      world.remove_force(world.forces()[0]);
      const Snapshot without = world.snapshot();
      const bool failed = runs_out(k, shortage, [&] { world.restore(snapshot); });
      EXPECT_TRUE(world.snapshot() == (failed ? without : snapshot)) << k;
      if (failed) world.restore(unchanged);
      EXPECT_TRUE(follow(world, 2) == (failed ? others : expected)) << k;
    }
    EXPECT_EQ(live_allocations(), alive) << k;
    return FailingNew::failed() && !testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 20u);
}

TEST_P(OutOfMemoryInAWorld, AQueryAfterAFailedOneFindsTheSame) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const Scene scene = dense_scene(seed, GetParam());
  const Ray ray{.origin = {-9, 0, 0}, .direction = {1, 0, 0}};
  World undisturbed = make_world(scene, kSettings[0], 3);
  const std::vector<RayHit> hits = undisturbed.cast_ray_through(ray);
  const std::vector<BodyId> touched = undisturbed.overlapping(Sphere{1}, {});
  const std::vector<Moment> expected = follow(undisturbed, 2);
  const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
    World world = make_world(scene, kSettings[0], 3);
    runs_out(k, shortage, [&] {
      world.cast_ray_through(ray);
      world.overlapping(Sphere{1}, {});
    });
    const bool failed = FailingNew::failed();
    EXPECT_EQ(world.cast_ray_through(ray), hits) << k;
    EXPECT_EQ(world.overlapping(Sphere{1}, {}), touched) << k;
    EXPECT_TRUE(follow(world, 2) == expected) << k;
    return failed && !testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 5u);
}

constexpr int kChanges = 10;
/// Changes of bodies that need no memory but for the contacts of the last step.
/// @param number below kChanges
void change_bodies(World& w, int number) {
  const BodyId moved = w.bodies()[1], gone = w.bodies()[3];
  const BodyId pushed = *std::ranges::find_if(
      w.bodies(), [&](BodyId id) { return w.mass(id) > 0 && !(id == moved) && !(id == gone); });
  BodyState state = w.state(moved);
  state.position.y += 1;
  switch (number) {
    case 0:
      return w.set_filter(gone, {.category = 2});
    case 1:
      return w.set_mass(pushed, 2);
    case 2:
      return w.set_friction(moved, 1);
    case 3:
      return w.set_restitution(moved, 1);
    case 4:
      return w.set_damping(moved, 1, 1);
    case 5:
      return w.remove(gone);
    case 6:
      return w.set_pair_ignored(w.bodies()[0], moved, false);
    case 7:
      return w.set_state(moved, state);
    case 8:
      return w.apply_force(pushed, {1, 2, 3});
    default:
      return w.remove_force(w.forces()[0]);
  }
}

Scene scene_with_ignored_pairs(Solver solver) {
  Scene scene = dense_scene(1, solver);
  scene.ignored_pairs = {{0, 1}, {3, 0}, {3, 4}};
  return scene;
}

// An index of contacts that makes it faster is left out.
TEST_P(OutOfMemoryInAWorld, BodiesAreRemovedAndMovedWithoutMemoryOnceTheContactsAreListed) {
  const Scene scene = scene_with_ignored_pairs(GetParam());
  World undisturbed = make_world(scene, kSettings[0], 2);
  World world = make_world(scene, kSettings[0], 2);
  for (int change = 0; change < kChanges; ++change) change_bodies(undisturbed, change);
  (void)world.contact_events();  // lists the contacts of both steps
  {
    const FailingNew failing(0, Shortage::permanent);
    for (int change = 0; change < kChanges; ++change) change_bodies(world, change);
  }
  EXPECT_TRUE(follow(world, 2) == follow(undisturbed, 2));
}

TEST_P(OutOfMemoryInAWorld, AFailedChangeOfBodiesChangesNothing) {
  const Scene scene = scene_with_ignored_pairs(GetParam());
  int failures = 0;
  for (int change = 0; change < kChanges; ++change) {
    // With a generator, there would be room for a list of contacts.
    World undisturbed = make_world(scene, kSettings[0], 2, false);
    World world = make_world(scene, kSettings[0], 2, false);
    change_bodies(undisturbed, change);
    const bool failed = runs_out(0, Shortage::permanent, [&] { change_bodies(world, change); });
    if (failed) change_bodies(world, change);
    EXPECT_TRUE(follow(world, 2) == follow(undisturbed, 2)) << change;
    failures += failed ? 1 : 0;
  }
  EXPECT_GE(failures, GetParam() == Solver::soft_step ? 5 : 0);
}

TEST_P(OutOfMemoryInAWorld, AFailedReplacementChangesNothing) {
  const Scene scene = scene_with_ignored_pairs(GetParam());
  const auto make = [&] { return make_world(scene, kSettings[0], 2, false); };
  BodyDef def = ball({0, 1, 0});
  def.shape = Compound{{{Sphere{1}, {1, 0, 0}}, {Sphere{1}, {-1, 0, 0}}}};
  def.inertia = diagonal({1, 2, 2});
  const auto replace = [&](World& world) { world.replace(world.bodies()[2], def); };
  World undisturbed = make();
  replace(undisturbed);
  const auto expected = follow(undisturbed, 2);
  const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
    World world = make();
    if (runs_out(k, shortage, [&] { replace(world); })) replace(world);
    EXPECT_TRUE(follow(world, 2) == expected) << k;
    return FailingNew::failed() && !testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 2u);
}

TEST_P(OutOfMemoryInAWorld, AFailedConstructionLeaksNothing) {
  const Scene scene = dense_scene(2, GetParam());
  for (const WorldSettings& settings : kSettings) {
    { const World first(scene, settings); }  // allocates objects that are made once and kept
    const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
      const std::size_t alive = live_allocations();
      runs_out(k, shortage, [&] { const World world(scene, settings); });
      EXPECT_EQ(live_allocations(), alive) << k;
      return FailingNew::failed() && !testing::Test::HasFailure();
    });
    EXPECT_GT(failures, 20u);
  }
}

TEST(OutOfMemoryAmongParticles, AFailedAllocationLeavesTheStateUnchanged) {
  const auto make = [] {
    ParticleWorld world({.grounds = {HalfSpace{}}});
    for (int i = 0; i < 16; ++i) {
      ParticleDef def;
      def.radius = Real(0.3);
      def.position = {static_cast<Real>(i % 4) * Real(0.5), static_cast<Real>(i / 4) * Real(0.5),
                      0};
      world.add(def);
    }
    return world;
  };
  const auto end = [](ParticleWorld& world) {
    for (int n = 0; n < 3; ++n) world.step();
    std::vector<ParticleState> states;
    for (const ParticleId id : world.particles()) states.push_back(world.state(id));
    return states;
  };
  const auto step = [](ParticleWorld& world) { world.step(); };
  const auto add = [](ParticleWorld& world) { world.add({.position = {0, 3, 0}, .radius = 1}); };
  const auto happens = [&](const auto& happen) {
    ParticleWorld undisturbed = make();
    happen(undisturbed);
    const std::vector<ParticleState> expected = end(undisturbed);
    return with_every_failure([&](std::size_t k, Shortage shortage) {
      ParticleWorld world = make();
      if (runs_out(k, shortage, [&] { happen(world); })) {
        EXPECT_EQ(world.particles().size(), 16u);
        happen(world);
      }
      EXPECT_EQ(end(world), expected) << k;
      return FailingNew::failed() && !testing::Test::HasFailure();
    });
  };
  EXPECT_GT(happens(step), 5u);
  EXPECT_GT(happens(add), 0u);
}

TEST(OutOfMemoryInACollider, ACallAfterAFailedOneFindsAllContacts) {
  Random random(3);
  std::vector<SphereInstance> spheres(700);
  for (SphereInstance& sphere : spheres) {
    sphere = {random.uniform_in_box({0, 0, 0}, {9, 9, 9}), random.uniform(Real(0.2), Real(0.7))};
  }
  for (const WorldSettings& settings : kSettings) {
    const auto undisturbed = make_sphere_collider(settings.collider);
    const ContactSpan found = undisturbed->find_contacts(spheres);
    const std::vector<SphereContact> expected(found.begin(), found.end());
    const std::vector<SpherePair> pairs{
        {expected[0].a, expected[0].b}, {5, 3}, {expected[9].b, expected[9].a}, {699, 0}};
    const auto given = undisturbed->find_touching(spheres, pairs);
    const std::vector<PairContact> touching(given.begin(), given.end());
    EXPECT_GE(touching.size(), 2u);
    const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
      const auto collider = make_sphere_collider(settings.collider);
      runs_out(k, shortage, [&] { collider->find_contacts(spheres); });
      const bool failed = FailingNew::failed();
      EXPECT_TRUE(std::ranges::equal(collider->find_contacts(spheres), expected)) << k;
      runs_out(k, shortage, [&] { collider->find_touching(spheres, pairs); });
      EXPECT_TRUE(std::ranges::equal(collider->find_touching(spheres, pairs), touching)) << k;
      return (failed || FailingNew::failed()) && !testing::Test::HasFailure();
    });
    EXPECT_GT(failures, 3u);
  }
}

// Does not hold for the JSON in the header of a recording and in scene files: the JSON library
// terminates the program when a small allocation fails.
TEST(OutOfMemoryInFiles, AnUnfinishedFileIsRemovedWithoutMemory) {
  const TemporaryFolder folder;
  std::optional<AtomicFile> file(folder.file("file"));
  {
    const FailingNew failing(0, Shortage::permanent);
    file.reset();
  }
  EXPECT_EQ(folder.entries(), 0u);
}

TEST(OutOfMemoryInRecordings, FramesAreWrittenWithoutMemoryAndReadOnTheNextAttempt) {
  const TemporaryFolder folder;
  const std::string path = folder.file("run.rec");
  const RecordingHeader header{
      .engine = "native", .backend = "cpu", .scene = dense_scene(4, Solver::soft_step)};
  const std::vector<BodyState> states(header.scene.bodies.size());
  RecordingWriter writer(path, header);
  {
    const FailingNew failing(0, Shortage::permanent);
    writer.append(states);
    writer.append(states);
    writer.finish();
  }
  EXPECT_FALSE(FailingNew::failed());
  RecordingReader reader(path);
  const std::size_t failures = with_every_failure([&](std::size_t k, Shortage shortage) {
    runs_out(k, shortage, [&] { reader.states(2); });
    const bool failed = FailingNew::failed();
    EXPECT_EQ(reader.states(2), states) << k;
    return failed && !testing::Test::HasFailure();
  });
  EXPECT_GT(failures, 0u);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
