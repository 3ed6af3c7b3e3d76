/// Tests of snapshots: the steps after a restoration have the bits of the steps without, in any
/// world; damaged snapshots are errors.
#include <jfpx/error.hpp>
#include <jfpx/snapshot.hpp>

#include "src/base/hash64.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/world/random_bodies.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <limits>
#include <set>
#include <string>
#include <vector>

namespace jfpx {
namespace {

using test::operator""_r;
using test::fresh_seed;
using test::trace;
using ::testing::HasSubstr;

JFPX_SOLVER_SUITE(Snapshots);

const WorldSettings kSettings[] = {
    {.collider = {.backend = Backend::cpu}},
    {.collider = {.backend = Backend::cpu}, .threads = 3},
    {.collider = {.backend = Backend::cpu, .algorithm = SphereAlgorithm::all_pairs}},
    {.collider = {.backend = Backend::cpu}, .threads = 2, .broad_phase = BroadPhase::hierarchy},
    {.collider = {.backend = Backend::cpu}, .broad_phase = BroadPhase::brute_force},
};

/// Bodies of all kinds, in contact.
Scene busy_scene(std::uint64_t seed) {
  Random random(seed);
  Scene scene = test::empty_scene();
  scene.name = "busy \xe9";  // not UTF-8
  scene.dt = 1 / 50._r;
  scene.soft_step.substeps = 3;
  scene.sleep.time = 0.2_r;
  scene.materials.friction = CombineRule::maximum;
  scene.resolver.max_iterations = 100;
  for (int i = 0; i < 40; ++i) {
    BodyDef def = test::random_body(&random, 2);
    def.friction = random.uniform(0, 1);
    def.restitution = random.uniform(0, 1);
    def.rolling_friction = random.uniform(0, 0.1_r);
    def.spinning_friction = random.uniform(0, 0.1_r);
    def.can_sleep = random.below(4) > 0;
    def.user_data = random.next();
    if (random.below(5) == 0) def.filter = {.category = 2, .mask = 1};
    if (random.below(9) == 0) def.sensor = true;
    if (scene.solver == Solver::soft_step) def.motion_locks = test::random_locks(&random);
    scene.bodies.push_back(def);
  }
  BodyDef platform;
  platform.shape = Box{{3, 0.2_r, 3}};
  platform.mass = 0;
  platform.kinematic = true;
  platform.position = {0, -3, 0};
  platform.velocity = {0.1_r, 0, 0};
  scene.bodies.push_back(platform);
  scene.bodies.push_back(test::half_space({0, 1.0002_r, 0}, -5));
  scene.ignored_pairs = {{1, 2}, {5, 3}};
  return scene;
}

/// Forces of all kinds and a contact generator. Worlds in which it is called have equal callbacks.
void add_callbacks(World& world) {
  const BodyId a{0, 0}, b{1, 0}, c{2, 0};
  world.remove_force(world.add_force(Gravity{}));
  world.add_force(Gravity{{0.1_r, 0, 0}, a});
  world.add_force(Drag{.linear = 0.1_r, .wind = {1, 0, 0}});
  world.add_force([](ForceContext& context) {
    for (const BodyId id : context.bodies()) {
      if (id.index % 5 == 0) context.apply_force(id, {0, 0, 1});
    }
  });
  world.add_force(Spring{.a = {a}, .b = {b}, .stiffness = 5, .rest_length = 1});
  world.add_force(Bungee{.a = {c}, .b = {{}, {0, 5, 0}}, .stiffness = 3, .rest_length = 2});
  world.add_force(Aero{.body = b, .tensor = diagonal({-1, -2, -3})});
  world.add_force(AeroControl{.body = c, .highest = diagonal({-1, -2, -3}), .control = 0.5_r});
  world.add_force(Buoyancy{.liquid = {{0, 1, 0}, -2}, .density = 1});
  world.add_force(Explosion{.start = 0.3_r, .peak_force = 20, .speed = 10, .thickness = 3});
  world.add_contact_generator([a, b](ContactContext& context) {
    if (!context.contains(a) || !context.contains(b)) return;
    context.add({.a = a, .b = b, .normal = {0, 1, 0}, .friction = 0.5_r});
  });
}

/// Removes, adds and changes bodies.
void meddle(World& world, Random* random) {
  const auto any = [&] { return world.bodies()[random->below(world.bodies().size())]; };
  for (int i = 0; i < 2; ++i) world.remove(any());
  world.add(test::random_body(random, 2));
  world.apply_force(any(), random->uniform_in_box({-9, -9, -9}, {9, 9, 9}));
  world.apply_torque(any(), {0, 1, 0});
  BodyId id = any();
  if (world.mass(id) > 0) world.set_mass(id, random->uniform(1, 2));
  id = any();
  if (world.mass(id) > 0) world.set_inertia(id, diagonal({1.5_r, 1.25_r, 1}));
  world.set_friction(any(), 0.25_r);
  world.set_damping(any(), 0.75_r, 0.5_r);
  if (world.settings().solver == Solver::soft_step) {
    world.set_motion_locks(any(), test::random_locks(random));
  }
  world.set_acceleration(any(), {0, -5, 0});
  world.set_filter(any(), {.category = 4, .mask = 5});
  const BodyId first = any(), second = any();
  if (first != second) world.set_pair_ignored(first, second, true);
  id = any();
  BodyState state = world.state(id);
  state.velocity.x += 1;
  world.set_state(id, state);
}

/// A world in the middle of a simulation.
World busy_world(std::uint64_t seed, const WorldSettings& settings = kSettings[0]) {
  World world(busy_scene(seed), settings);
  add_callbacks(world);
  Random random(seed);
  for (int n = 0; n < 4; ++n) {
    for (int i = 0; i < 5; ++i) world.step();
    meddle(world, &random);
  }
  return world;
}

/// Everything that can be observed after a step.
struct Moment {
  std::uint64_t hash = 0;
  double time = 0;
  std::uint32_t awake = 0;
  std::vector<BodyId> bodies;
  std::vector<Vec3> accelerations;
  std::vector<Contact> contacts;
  std::vector<ContactEvent> events;
  friend bool operator==(const Moment&, const Moment&) = default;
};

/// Results of many steps, and of changes between them.
std::vector<Moment> follow(World& world, std::uint64_t seed) {
  Random random(seed);
  std::vector<Moment> moments;
  for (int n = 0; n < 24; ++n) {
    Moment moment;
    moment.awake = world.step().awake;
    moment.hash = world.state_hash();
    moment.time = world.time();
    moment.bodies = {world.bodies().begin(), world.bodies().end()};
    for (const BodyId id : moment.bodies) {
      moment.accelerations.push_back(world.last_acceleration(id));
    }
    moment.contacts = {world.contacts().begin(), world.contacts().end()};
    moment.events = {world.contact_events().begin(), world.contact_events().end()};
    moments.push_back(std::move(moment));
    if (n % 6 == 5) meddle(world, &random);
  }
  return moments;
}

/// A world with other bodies and settings, and the callbacks of busy_world().
World other_world(const WorldSettings& settings) {
  Scene scene;
  scene.solver =
      test::SolverTest::GetParam() == Solver::soft_step ? Solver::worst_first : Solver::soft_step;
  for (int i = 0; i < 5; ++i) scene.bodies.push_back(test::ball({Real(i), 0, 0}));
  World world(scene, settings);
  add_callbacks(world);
  for (int n = 0; n < 3; ++n) world.step();
  return world;
}

/// The message of InvalidSnapshot; empty if the snapshot is valid.
std::string complaint(World& world, const Snapshot& snapshot) {
  try {
    world.restore(snapshot);
  } catch (const InvalidSnapshot& error) {
    return error.what();
  }
  return {};
}

TEST_P(Snapshots, TheStepsAfterARestorationHaveTheBitsOfThoseWithout) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  World world = busy_world(seed);
  const Snapshot snapshot = world.snapshot();
  const std::vector<Moment> expected = follow(world, seed + 1);
  EXPECT_FALSE(expected.back().contacts.empty());
  for (int again = 0; again < 2; ++again) {
    world.restore(snapshot);
    EXPECT_TRUE(world.snapshot() == snapshot);
    EXPECT_TRUE(follow(world, seed + 1) == expected) << again;
  }
}

TEST_P(Snapshots, AreInterchangeableBetweenThreadsAndBroadPhases) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  World first = busy_world(seed);
  const Snapshot snapshot = first.snapshot();
  const std::vector<Moment> expected = follow(first, seed + 1);
  for (const WorldSettings& settings : kSettings) {
    World same = busy_world(seed, settings), other = other_world(settings);
    EXPECT_TRUE(same.snapshot() == snapshot);
    other.restore(snapshot);
    EXPECT_TRUE(other.snapshot() == snapshot);
    EXPECT_TRUE(follow(other, seed + 1) == expected);
    EXPECT_TRUE(other.snapshot() == first.snapshot());
  }
}

TEST_P(Snapshots, RestorePropertiesContactsAndSettings) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  World world = busy_world(seed);
  world.step();  // so that there are contacts
  World other = other_world(kSettings[0]);
  other.restore(world.snapshot());
  ASSERT_TRUE(std::ranges::equal(world.bodies(), other.bodies()));
  for (const BodyId id : world.bodies()) {
    EXPECT_EQ(world.shape(id), other.shape(id));
    EXPECT_EQ(world.state(id), other.state(id));
    EXPECT_EQ(world.awake(id), other.awake(id));
    EXPECT_EQ(world.mass(id), other.mass(id));
    EXPECT_EQ(world.inertia(id), other.inertia(id));
    EXPECT_EQ(world.inverse_inertia(id), other.inverse_inertia(id));
    EXPECT_EQ(world.last_acceleration(id), other.last_acceleration(id));
    EXPECT_EQ(world.friction(id), other.friction(id));
    EXPECT_EQ(world.restitution(id), other.restitution(id));
    EXPECT_EQ(world.acceleration(id), other.acceleration(id));
    EXPECT_EQ(world.linear_damping(id), other.linear_damping(id));
    EXPECT_EQ(world.angular_damping(id), other.angular_damping(id));
    EXPECT_EQ(world.user_data(id), other.user_data(id));
    EXPECT_EQ(world.sensor(id), other.sensor(id));
    EXPECT_EQ(world.filter(id), other.filter(id));
    for (const BodyId b : world.bodies()) {
      EXPECT_EQ(world.pair_ignored(id, b), other.pair_ignored(id, b));
    }
  }
  EXPECT_EQ(world.steps(), 21u);
  EXPECT_EQ(other.steps(), 21u);
  EXPECT_EQ(other.time(), world.time());
  EXPECT_FALSE(world.contacts().empty());
  EXPECT_TRUE(std::ranges::equal(other.contacts(), world.contacts()));
  EXPECT_TRUE(other.contact_events().empty());
  EXPECT_EQ(other.settings(), world.settings());
  const Ray ray{.origin = {0, 50, 0}, .direction = {0, -1, 0}};
  EXPECT_EQ(world.cast_ray_through(ray), other.cast_ray_through(ray));
}

TEST_P(Snapshots, KeepSleepersAndWhatTheyLieOn) {
  Scene scene = test::empty_scene();
  scene.bodies.push_back(test::ground());
  for (int i = 0; i < 3; ++i) {
    BodyDef box;
    box.shape = Box{};
    box.position = {0, 0.5_r + Real(i), 0};
    scene.bodies.push_back(box);
  }
  World world(scene);
  while (world.awake(world.bodies()[3])) world.step();
  World other{Scene{}};
  other.restore(world.snapshot());
  const auto fall = [](World& w) {
    w.remove(w.bodies()[1]);
    EXPECT_TRUE(w.awake(w.bodies()[1])) << "the removal wakes the box above";
    for (int n = 0; n < 60; ++n) w.step();
    return w.states();
  };
  EXPECT_FALSE(other.awake(other.bodies()[3]));
  EXPECT_EQ(fall(other), fall(world));
  EXPECT_LT(other.states()[1].position.y, 0.6_r);
}

TEST_P(Snapshots, KeepFiltersAndIgnoredPairs) {
  for (const bool by_filter : {true, false}) {
    Scene scene = test::empty_scene();
    scene.bodies = {test::ball({0, 0, 0}), test::ball({0.5_r, 0, 0})};
    if (by_filter) scene.bodies[0].filter = {.category = 2, .mask = 0};
    if (!by_filter) scene.ignored_pairs = {{1, 0}};
    World world{Scene{}};
    world.restore(World(scene).snapshot());
    EXPECT_EQ(world.step().contacts, 0u);
    if (by_filter) world.set_filter(world.bodies()[0], {});
    if (!by_filter) world.set_pair_ignored(world.bodies()[0], world.bodies()[1], false);
    EXPECT_EQ(world.step().contacts, 1u);
  }
}

TEST_P(Snapshots, HaveTheStatedSize) {
  const auto size = [](int balls, Real distance) {
    Scene scene = test::empty_scene();
    for (int i = 0; i < balls; ++i) scene.bodies.push_back(test::ball({distance * Real(i), 0, 0}));
    World world(scene);
    world.step();
    return world.snapshot().bytes.size();
  };
  EXPECT_EQ(size(9, 5) - size(8, 5), sizeof(Real) == 4 ? 206u : 382u);
  const std::size_t contact = size(2, 1.5_r) - size(2, 5);
  if (GetParam() == Solver::soft_step) {
    EXPECT_EQ(contact, sizeof(Real) == 4 ? 98u : 162u);
  }
}

TEST_P(Snapshots, OfAWorldWithoutBodies) {
  World world(test::empty_scene());
  const Snapshot empty = world.snapshot();
  const BodyId id = world.add(test::ball({0, 0, 0}));
  world.step();
  world.restore(empty);
  EXPECT_TRUE(world.bodies().empty());
  EXPECT_FALSE(world.contains(id));
  EXPECT_EQ(world.steps(), 0u);
  EXPECT_EQ(world.add(test::ball({0, 0, 0})), id) << "ids are given again";
  world.step();
  EXPECT_TRUE(world.contacts().empty());
}

TEST_P(Snapshots, OfAWorldThatCannotStepRestoreOneThatCannotEither) {
  World world(test::empty_scene());
  const BodyId id = world.add(test::ball({0, 0, 0}));
  for (int i = 0; i < 2; ++i) world.apply_force(id, {std::numeric_limits<Real>::max(), 0, 0});
  World other{Scene{}};
  other.restore(world.snapshot());
  for (int n = 0; n < 2; ++n) {
    const StepReport report = other.step();
    EXPECT_TRUE(report.non_finite);
    EXPECT_EQ(report.non_finite_body, id);
  }
  EXPECT_EQ(other.state(id), world.state(id));
}

TEST_P(Snapshots, RestoreForcesWithTheirParameters) {
  World world(test::empty_scene());
  const BodyId id = world.add(test::ball({0, 0, 0}));
  const ForceId kept = world.add_force(AeroControl{.body = id, .control = 0.25_r});
  const ForceId removed = world.add_force(Spring{.a = {id}, .stiffness = 7});
  const Snapshot snapshot = world.snapshot();
  AeroControl& control = world.force<AeroControl>(kept);
  control.control = 1;
  world.remove_force(removed);
  const ForceId later = world.add_force(Gravity{});
  world.restore(snapshot);
  EXPECT_EQ(&world.force<AeroControl>(kept), &control) << "references remain valid";
  EXPECT_EQ(control.control, 0.25_r);
  EXPECT_EQ(world.force<Spring>(removed).stiffness, 7);
  EXPECT_EQ(world.forces().size(), 2u);
  EXPECT_EQ(world.add_force(Gravity{}), later) << "ids are given again";

  World other{Scene{}};
  other.add_force(Spring{.b = {other.add(test::ball({}))}});
  other.restore(snapshot);
  EXPECT_EQ(other.force<AeroControl>(kept).control, 0.25_r) << "it replaces one of another type";
  EXPECT_EQ(other.force<Spring>(removed).stiffness, 7);
}

TEST_P(Snapshots, RequireTheSameFunctionsOfTheProgram) {
  const auto force = [](ForceContext&) {};
  const auto generator = [](ContactContext&) {};
  World world(test::empty_scene()), other(test::empty_scene());
  world.add_force(Gravity{});
  world.add_force(force);
  world.add_contact_generator(generator);
  const Snapshot snapshot = world.snapshot();
  const std::uint64_t before = other.state_hash();
  EXPECT_THAT(complaint(other, snapshot), HasSubstr("the user-defined force 1 is in the snapshot"));
  const ForceId early = other.add_force(force);
  EXPECT_THAT(complaint(other, snapshot), HasSubstr("the user-defined force 1 is in the snapshot"));
  other.add_force(force);
  EXPECT_THAT(complaint(other, snapshot), HasSubstr("the user-defined force 0 is in the world"));
  other.remove_force(early);
  EXPECT_THAT(complaint(other, snapshot), HasSubstr("the contact generator 0 is in the snapshot"));
  other.add_contact_generator(generator);
  const ContactGeneratorId extra = other.add_contact_generator(generator);
  EXPECT_THAT(complaint(other, snapshot), HasSubstr("the contact generator 1 is in the world"));
  other.remove_contact_generator(extra);
  EXPECT_EQ(other.state_hash(), before);
  EXPECT_EQ(other.forces().size(), 1u);
  EXPECT_EQ(complaint(other, snapshot), "");
  EXPECT_EQ(other.forces().size(), 2u);
  EXPECT_EQ(other.add_force(force), ForceId{2});
  EXPECT_EQ(other.add_contact_generator(generator), ContactGeneratorId{1});
}

TEST_P(Snapshots, SurviveAFile) {
  const std::uint64_t seed = fresh_seed();
  SCOPED_TRACE(trace(seed));
  const test::TemporaryFolder folder;
  const std::string path = folder.file("world.snap");
  const Snapshot snapshot = busy_world(seed).snapshot();
  save_snapshot(snapshot, path);
  EXPECT_TRUE(load_snapshot(path) == snapshot);
  std::filesystem::resize_file(path, snapshot.bytes.size() - 1);
  try {
    load_snapshot(path);
    ADD_FAILURE() << "a truncated file was accepted";
  } catch (const InvalidSnapshot& error) {
    EXPECT_THAT(error.what(), HasSubstr("world.snap: the snapshot has"));
  }
  EXPECT_THROW(load_snapshot(folder.file("missing.snap")), FileError);
  EXPECT_THROW(save_snapshot(snapshot, folder.file("no/such/x.snap")), FileError);
}

/// A world with few bytes, with all parts of a snapshot.
World small_world() {
  Scene scene = test::empty_scene();
  BodyDef compound;
  compound.shape = Compound{{{.shape = Sphere{}}, {.shape = Box{}}}};
  compound.position = {0, 0.5_r, 0};
  scene.bodies = {test::ground(), test::ball({1.5_r, 1, 0}), compound, test::ball({3.5_r, 1, 0})};
  scene.bodies[1].inertia = diagonal({1, 1, 1.5_r});
  scene.ignored_pairs = {{0, 3}};
  World world(scene);
  world.add_force(Gravity{.body = world.bodies()[1]});
  world.add_force([](ForceContext&) {});
  world.add_contact_generator(
      [id = world.bodies()[2], ground = world.bodies()[0]](ContactContext& context) {
        if (!context.contains(id) || !context.contains(ground)) return;
        context.add({.a = id, .b = ground, .normal = {0, 1, 0}});
      });
  for (int n = 0; n < 3; ++n) world.step();
  world.remove(world.add(test::ball({9, 9, 9})));
  return world;
}

TEST_P(Snapshots, EveryFlippedByteIsAnErrorAndChangesNothing) {
  World world = small_world();
  const Snapshot good = world.snapshot();
  for (std::size_t i = 0; i < good.bytes.size(); ++i) {
    Snapshot bad = good;
    bad.bytes[i] ^= std::byte{0x10};
    EXPECT_THROW(world.restore(bad), InvalidSnapshot) << "byte " << i;
  }
  EXPECT_TRUE(world.snapshot() == good);
}

TEST_P(Snapshots, EveryTruncationIsAnErrorAndChangesNothing) {
  World world = small_world();
  const Snapshot good = world.snapshot();
  for (std::size_t size = 0; size < good.bytes.size(); ++size) {
    Snapshot bad = good;
    bad.bytes.resize(size);
    EXPECT_THROW(world.restore(bad), InvalidSnapshot) << "size " << size;
  }
  Snapshot longer = good;
  longer.bytes.push_back(std::byte{0});
  EXPECT_THROW(world.restore(longer), InvalidSnapshot);
  EXPECT_TRUE(world.snapshot() == good);
}

TEST_P(Snapshots, ErrorsNameTheCause) {
  World world = small_world();
  const Snapshot good = world.snapshot();
  const auto complaint_with = [&](std::size_t byte, int value) {
    Snapshot bad = good;
    bad.bytes[byte] = static_cast<std::byte>(value);
    return complaint(world, bad);
  };
  EXPECT_THAT(complaint(world, {}), HasSubstr("not a snapshot of jfpx"));
  EXPECT_THAT(complaint_with(0, 'X'), HasSubstr("not a snapshot of jfpx"));
  EXPECT_THAT(complaint_with(8, 9), HasSubstr("is of version 9; this build reads versions 1 to 6"));
  EXPECT_THAT(complaint_with(12, sizeof(Real) == 4 ? 8 : 4),
              HasSubstr(sizeof(Real) == 4 ? "is float64 (double precision); it must be float32"
                                          : "is float32 (single precision); it must be float64"));
  EXPECT_THAT(complaint_with(good.bytes.size() - 1, 42), HasSubstr("checksum"));
}

/// Makes the header and the checksum fit the content.
void seal(Snapshot* snapshot) {
  constexpr std::size_t kHeader = 24, kChecksum = 8;
  std::vector<std::byte>& bytes = snapshot->bytes;
  const std::uint64_t size = bytes.size() - kHeader - kChecksum;
  std::memcpy(bytes.data() + 16, &size, sizeof size);
  Hash64 hash;
  hash.add_bytes(bytes.data(), bytes.size() - kChecksum);
  const std::uint64_t checksum = hash.value();
  std::memcpy(bytes.data() + bytes.size() - kChecksum, &checksum, sizeof checksum);
}

constexpr std::size_t kHeader = 24;

/// Restores the snapshot of a world with each byte changed to some values, from byte `first` on.
/// Checks that each is either an error or the world of the snapshot, which makes steps.
/// @param accepted receives how many are no error. @returns the messages of the errors
std::set<std::string> complaints_about_bytes(World& world, std::size_t first,
                                             std::size_t* accepted) {
  const Snapshot good = world.snapshot();
  std::set<std::string> complaints;
  for (std::size_t i = first; i < good.bytes.size() - 8; ++i) {
    for (const int value : {0x00, 0x01, 0x7f, 0x80, 0xff}) {
      Snapshot bad = good;
      bad.bytes[i] = static_cast<std::byte>(value);
      seal(&bad);
      const std::string found = complaint(world, bad);
      if (!found.empty()) {
        complaints.insert(found);
        continue;
      }
      ++*accepted;
      EXPECT_TRUE(world.snapshot() == bad) << "byte " << i << ", value " << value;
      for (int n = 0; n < 2; ++n) world.step();
    }
  }
  return complaints;
}

TEST_P(Snapshots, OfBadContentIsAnErrorOrAWorldThoughTheChecksumIsRight) {
  World world = small_world();
  const Snapshot good = world.snapshot();
  std::size_t accepted = 0;
  const std::set<std::string> complaints = complaints_about_bytes(world, kHeader, &accepted);
  EXPECT_GT(accepted, 200u);
  std::vector<std::string> expected{
      "its list of unused ids is invalid",
      "its list of bodies is invalid",
      "a value is of an unknown kind",
      "a flag of a body is neither 0 nor 1",
      "an immovable body is awake",
      "a wall has no finite offset",
      "an ignored pair is not of two bodies",
      "its list of callbacks is not sorted",
      "it ends too early",
      "a truth value is neither 0 nor 1",
  };
  if (GetParam() == Solver::soft_step) {
    expected.insert(expected.end(),
                    {"its contacts are not sorted", "a contact is not of two bodies",
                     "a contact with an immovable body has a color",
                     "a contact of bodies without rolling friction has a rolling impulse",
                     "two contacts of a body have the same color"});
  }
  for (const std::string& reason : expected) {
    EXPECT_TRUE(complaints.contains("the snapshot is corrupt: " + reason)) << reason;
  }
  for (std::size_t size = kHeader + 8; size < good.bytes.size(); ++size) {
    Snapshot bad = good;
    bad.bytes.resize(size);
    seal(&bad);
    EXPECT_NE(complaint(world, bad), "") << "size " << size;
  }
}

TEST(SnapshotsOfLocks, OfBadContentAreAnErrorOrAWorldThoughTheChecksumIsRight) {
  Scene scene;
  scene.bodies = {test::ground(), test::ball({0, 1, 0}), test::ball({3, 1, 0}),
                  test::ball({6, 1, 0})};
  for (std::size_t i = 1; i < 4; ++i) scene.bodies[i].velocity = {1, 2, 3};
  scene.bodies[1].motion_locks = kFixedRotation;
  scene.bodies[2].motion_locks = kPlanarMotion;
  World world(scene);
  world.step();
  constexpr std::size_t kBytesOfLocks = 4 * 6, kChecksum = 8;
  std::size_t accepted = 0;
  const std::set<std::string> complaints = complaints_about_bytes(
      world, world.snapshot().bytes.size() - kBytesOfLocks - kChecksum, &accepted);
  EXPECT_GT(accepted, 20u);
  for (const char* reason :
       {"an immovable body has locked axes, or a body moves along or about a locked axis",
        "a truth value is neither 0 nor 1"}) {
    EXPECT_TRUE(complaints.contains(std::string("the snapshot is corrupt: ") + reason)) << reason;
  }
}

TEST(SnapshotsOfJoints, OfBadContentAreAnErrorOrAWorldThoughTheChecksumIsRight) {
  Scene scene;
  scene.bodies = {test::ground(), test::ball({0, 1, 0}), test::ball({3, 1, 0}),
                  test::ball({6, 1, 0})};
  World world(scene);
  const std::vector<BodyId> ids(world.bodies().begin(), world.bodies().end());
  world.step();
  const std::size_t without_joints = world.snapshot().bytes.size();
  const JointId removed = world.add_joint(DistanceJoint{.a = ids[1]});
  world.add_joint(DistanceJoint{.a = ids[1], .b = ids[2], .max_length = 3});
  world.add_joint(DistanceJoint{.a = ids[2], .b = ids[3], .max_length = 3});
  world.add_joint(DistanceJoint{.a = ids[3], .max_length = 7});
  world.remove_joint(removed);
  world.step();
  std::size_t accepted = 0;
  const std::set<std::string> complaints =
      complaints_about_bytes(world, without_joints - 8, &accepted);
  EXPECT_GT(accepted, 100u);
  for (const char* reason :
       {"its list of unused ids of joints is invalid", "its list of joints is invalid",
        "a joint is not of bodies of the world", "a joint with an immovable body has a color",
        "two joints or contacts of a body have the same color"}) {
    EXPECT_TRUE(complaints.contains(std::string("the snapshot is corrupt: ") + reason)) << reason;
  }
}

}  // namespace
}  // namespace jfpx
