/// Tests that warm steps allocate nothing, and of the memory of a world. A separate program,
/// because it replaces operator new.
#include <jfpx/thesis/particle.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <malloc.h>
#include <new>

namespace {
std::atomic<long> allocations{0}, alive{0}, bytes{0};

void* counted(void* memory) {
  if (memory == nullptr) throw std::bad_alloc();
  ++allocations;
  ++alive;
  bytes += static_cast<long>(malloc_usable_size(memory));
  return memory;
}
void release(void* memory) noexcept {
  if (memory != nullptr) --alive;
  bytes -= static_cast<long>(malloc_usable_size(memory));
  std::free(memory);
}
}  // namespace

void* operator new(std::size_t size) { return counted(std::malloc(size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  const auto line = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(line, (size + line - 1) / line * line));
}
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }

namespace jfpx {
namespace {

JFPX_SOLVER_SUITE(Allocation);

/// `automatic` allocates when it first tries another algorithm or device.
const WorldSettings kFixed{.collider = {.backend = Backend::cpu}};

TEST_P(Allocation, StepsOverTheSameContactsAllocateNothing) {
  // At rest and awake: the same contacts step after step.
  Scene scene = scenes::make("columns", {.spheres = 64, .seed = 1});
  scene.solver = GetParam();
  scene.sleep.enabled = false;
  scene.resolver.max_iterations = 20000;
  World world(scene, kFixed);
  std::uint64_t most = 0;
  for (int n = 0; n < 200; ++n) most = std::max(most, world.step().contacts);
  const long before = allocations;
  for (int n = 0; n < 50; ++n) {
    const StepReport report = world.step();
    ASSERT_LE(report.contacts, most);
    ASSERT_GT(report.contacts, 0u);
  }
  EXPECT_EQ(allocations, before);
}

TEST_P(Allocation, NeitherBoxesNorForcesNorGeneratorsAllocateInWarmSteps) {
  Scene scene = test::empty_scene();
  for (int i = 0; i < 5; ++i) {
    BodyDef def;
    def.shape = Box{};
    def.position = {0, Real(0.5) + static_cast<Real>(i), 0};
    def.can_sleep = false;
    scene.bodies.push_back(def);
  }
  scene.bodies.push_back(test::ground());
  scene.soft_step.contact_hertz = 30;
  World world(scene, kFixed);
  world.add_force(Drag{.linear = Real(0.1)});
  world.add_force(Spring{.a = {world.bodies()[0]}, .b = {world.bodies()[1]}, .rest_length = 1});
  world.add_contact_generator([](ContactContext& context) {
    context.add({.a = context.bodies()[4], .b = context.bodies()[5], .normal = {0, 1, 0}});
  });
  for (int n = 0; n < 300; ++n) world.step();
  const long before = allocations;
  for (int n = 0; n < 50; ++n) {
    const StepReport report = world.step();
    // Soft contacts hold a corner when it is about to touch, which is not yet a contact.
    ASSERT_GE(report.contacts, GetParam() == Solver::soft_step ? 10u : 20u);
    ASSERT_EQ(report.generated_contacts, 1u);
  }
  EXPECT_EQ(allocations, before);
}

TEST(Allocation, ParticlesAtRestAllocateNothing) {
  ParticleWorld world({.grounds = {HalfSpace{}}});
  for (int i = 0; i < 50; ++i) {
    ParticleDef def;
    def.radius = Real(0.5);
    def.position = {static_cast<Real>(i % 10), Real(0.5) + static_cast<Real>(i / 10), 0};
    world.add(def);
  }
  for (int n = 0; n < 100; ++n) world.step();
  const long before = allocations;
  for (int n = 0; n < 50; ++n) ASSERT_GT(world.step().contacts, 0u);
  EXPECT_EQ(allocations, before);
}

TEST_P(Allocation, NeitherCarryingNorEventsAllocateInWarmSteps) {
  Scene scene = test::empty_scene();
  BodyDef platform = test::ball({0, -1, 0});
  platform.shape = Box{{50, 1, 50}};
  platform.mass = 0;
  platform.kinematic = true;
  platform.velocity = {Real(0.2), 0, 0};
  platform.restitution = 1;
  BodyDef zone = test::ball({1, 1, 1}, 2, 0);
  zone.sensor = true;
  scene.bodies = {platform, zone};
  for (int i = 0; i < 9; ++i) {
    BodyDef def = test::ball({static_cast<Real>(i % 3), 1, static_cast<Real>(i / 3)}, Real(0.4));
    def.acceleration = {0, Real(-9.81), 0};
    def.restitution = 1;  // bounces: contacts begin and end
    scene.bodies.push_back(def);
  }
  World world(scene);
  std::size_t begun = 0;
  for (int n = 0; n < 200; ++n) {
    world.step();
    begun += world.contact_events().size();
  }
  const long before = allocations;
  begun = 0;
  for (int n = 0; n < 100; ++n) {
    world.step();
    for (const ContactEvent& e : world.contact_events()) begun += e.phase == ContactPhase::begin;
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(begun, 0u);
}

// The original leaks six blocks of memory for each contact of each step.
TEST(Erratum, E31_contacts_keep_no_memory) {
  for (const Solver solver : test::kSolvers) {
    const long before = alive;
    long warm = 0, later = 0;
    std::uint64_t contacts = 0;
    {
      Scene scene = scenes::make("columns", {.spheres = 64, .seed = 1});
      scene.solver = solver;
      World world(scene);
      for (int n = 0; n < 40; ++n) world.step();
      warm = alive;
      for (int n = 0; n < 100; ++n) contacts += world.step().contacts;
      later = alive;
    }
    EXPECT_EQ(alive, before) << to_string(solver);
    EXPECT_EQ(later, warm) << to_string(solver);
    EXPECT_GT(contacts, 5000u) << to_string(solver);
  }
}

TEST_P(Allocation, WarmStepsOfCompoundsAllocateNothingWithAnyBroadPhase) {
  for (const BroadPhase way : {BroadPhase::cells, BroadPhase::hierarchy, BroadPhase::brute_force}) {
    Scene scene = test::empty_scene();
    for (int i = 0; i < 10; ++i) {
      BodyDef def;
      def.shape = Compound{{{.shape = Sphere{}, .position = {0, 0, -1}},
                            {.shape = Sphere{}, .position = {0, 0, 1}},
                            {.shape = Box{{Real(0.2), Real(0.2), 1}}}}};
      def.position = {static_cast<Real>(i) * Real(0.9), Real(0.5), 0};
      def.can_sleep = false;
      def.restitution = 0;
      scene.bodies.push_back(def);
    }
    scene.bodies.push_back(test::ground());
    scene.bodies.push_back(test::half_space({1, 0, 0}, -1));
    WorldSettings settings;
    settings.broad_phase = way;
    World world(scene, settings);
    for (int n = 0; n < 300; ++n) world.step();
    const long before = allocations;
    std::uint64_t contacts = 0;
    for (int n = 0; n < 50; ++n) contacts += world.step().contacts;
    EXPECT_GE(contacts, 50u * 20u);
    EXPECT_EQ(allocations, before) << static_cast<int>(way);
  }
}

// bench/results/soft_step.md says where the bytes go.
TEST(Allocation, AWorldTakesTheStatedMemory) {
  constexpr long kSpheres = 4096;
  const long before = bytes;
  World world(scenes::make("pile", {.spheres = kSpheres}), kFixed);
  StepReport report;
  for (int n = 0; n < 150; ++n) report = world.step();
  ASSERT_GT(report.contacts, 2u * kSpheres);
  EXPECT_LE((bytes - before) / kSpheres, static_cast<long>(325 * sizeof(Real)));
}

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  const auto memory = std::make_unique<int>(1);
  EXPECT_GT(allocations, before) << *memory;
}

}  // namespace
}  // namespace jfpx
