/// Backend::automatic of a world: moves it between the processor and the device from step to step,
/// which no bit shows.
#include <jfpx/backend.hpp>
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/equal_worlds.hpp"
#include "tests/world/host_device.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <future>
#include <string>
#include <thread>

namespace jfpx {
namespace {

using test::expect_equal_contacts;
using test::operator""_r;

/// A device that fails on request.
class FailingDevice final : public DeviceWorld {
 public:
  /// @param calls number of calls that change the state on the device before all of them fail
  FailingDevice(const Scene& scene, int calls)
      : device_(test::make_host_device_world(scene)), calls_(calls) {}

  void configure(const Scene& scene) noexcept override { device_->configure(scene); }
  void upload(const BodyStore& bodies, SubShapeTable* sub_shapes, soft_step::ContactSet* last,
              bool keeps_velocities) override {
    count_call();
    device_->upload(bodies, sub_shapes, last, keeps_velocities);
  }
  void upload_joints(JointStore* joints) override {
    count_call();
    device_->upload_joints(joints);
  }
  void upload_forces(const BodyStore& bodies) override {
    count_call();
    device_->upload_forces(bodies);
  }
  bool has_room(std::size_t slots) const noexcept override { return device_->has_room(slots); }
  void edit(const BodyStore& bodies, const BodyEdits& edits) override {
    count_call();
    device_->edit(bodies, edits);
  }
  Result step(const ForceTable* forces, std::uint64_t steps) override {
    count_call();
    return device_->step(forces, steps);
  }
  void prepare(const ForceTable* forces, std::uint64_t steps) override {
    count_call();
    device_->prepare(forces, steps);
  }
  void enqueue(const ForceTable* forces, std::uint64_t steps, cuda::Stream stream,
               std::uint64_t* left) override {
    count_call();
    device_->enqueue(forces, steps, stream, left);
  }
  bool is_capturing(cuda::Stream stream) override { return device_->is_capturing(stream); }
  bool capture(const ForceTable* forces, std::uint64_t steps, std::uint32_t count,
               cuda::Stream stream) override {
    return device_->capture(forces, steps, count, stream);
  }
  bool has_graph() const noexcept override { return device_->has_graph(); }
  void hold() override { device_->hold(); }
  bool is_held() const noexcept override { return device_->is_held(); }
  void wait_for(cuda::Stream stream) override { device_->wait_for(stream); }
  Finished finish() override { return device_->finish(); }
  cuda::DeviceStates states() const noexcept override { return device_->states(); }
  Vec3 fetch_position(std::uint32_t body) override { return device_->fetch_position(body); }
  void fetch_states(MotionArrays* moving, ThreadPool* pool) override {
    device_->fetch_states(moving, pool);
  }
  void fetch_other_motion(MotionArrays* moving, ThreadPool* pool) override {
    device_->fetch_other_motion(moving, pool);
  }
  void fetch_contact_set(soft_step::ContactSet* last) override { device_->fetch_contact_set(last); }
  void fetch_joints(JointStore* joints) override { device_->fetch_joints(joints); }
  void fetch_contacts(const BodiesOfStep& bodies, bool of_step_before, soft_step::ContactSet* set,
                      DetectedContacts* detected) override {
    device_->fetch_contacts(bodies, of_step_before, set, detected);
  }

 private:
  void count_call() {
    if (calls_-- <= 0) throw DeviceError("the device is gone");
  }

  std::unique_ptr<DeviceWorld> device_;
  int calls_;
};

/// Costs that make a device seem free of charge.
CostModel device_wins() {
  CostModel costs;
  costs.cuda_world = {};
  costs.cuda_start_ms = 0;
  return costs;
}

/// A pile that stays awake: steps of a sleeping world are left out, whatever the device.
Scene small_pile() {
  Scene scene = scenes::make("pile", {.spheres = 10});
  scene.sleep.enabled = false;
  return scene;
}

World on_host(const Scene& scene) { return World(scene, {.collider = {.backend = Backend::cpu}}); }

/// A world that moves to the devices of `make`.
World automatic(const Scene& scene, const CostModel& costs, AutomaticDevice::Maker make) {
  World world = on_host(scene);
  WorldAccess::impl(world).automatic = std::make_unique<AutomaticDevice>(costs, std::move(make));
  return world;
}
World automatic(const Scene& scene, const CostModel& costs = device_wins()) {
  return automatic(scene, costs, [] { return test::make_host_device_world(Scene{}); });
}

/// Makes the next choice believe that the last step took this time.
void set_time(World* world, double us) { WorldAccess::impl(*world).spent_us = us; }

// A program that reads contacts pays for the list wherever the world is.
TEST(AutomaticWorld, CountsTheTimeOfListsOfContactsOnTheHost) {
  Scene scene;
  scene.bodies = {test::heavy({0, 0.9999_r, 0}), test::ground()};
  World world = on_host(scene);
  world.step();
  set_time(&world, 0);
  EXPECT_EQ(world.contacts().size(), 1u);
  const double spent = WorldAccess::impl(world).spent_us;
  EXPECT_GT(spent, 0);
  (void)world.contacts();  // makes no second list
  EXPECT_EQ(WorldAccess::impl(world).spent_us, spent);
}

TEST(AutomaticWorld, HasTheSameBitsWhereverItMoves) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  Scene scene;
  for (int i = 0; i < 25; ++i) scene.bodies.push_back(test::random_body(&random, 2));
  scene.bodies.push_back(test::ground());
  scene.sleep.enabled = false;
  CostModel costs = device_wins();
  costs.cpu_world = {};
  World host = on_host(scene), world = automatic(scene, costs);
  int moves = 0;
  bool was_on_device = false;
  for (int n = 0; n < 900; ++n) {
    if (random.below(8) == 0) {
      const Vec3 force = random.uniform_in_box({-9, -9, -9}, {9, 9, 9});
      const std::uint64_t i = random.below(20), action = random.below(4);
      const BodyDef def = test::random_body(&random, 2);
      for (World* w : {&host, &world}) {
        const BodyId id = w->bodies()[i];
        if (action == 0) w->apply_force(id, force);
        if (action == 1) w->remove(id);
        if (action == 1) w->add(def);
        if (action == 2) w->set_friction(id, absolute(force.x));
        if (action == 3) w->restore(w->snapshot());
      }
    }
    const StepReport a = host.step(), b = world.step();
    ASSERT_EQ(a.contacts, b.contacts) << "step " << n;
    ASSERT_EQ(a.awake, b.awake) << "step " << n;
    ASSERT_EQ(b.device_failure, "");
    if (n % 3 == 0) {
      ASSERT_EQ(host.state_hash(), world.state_hash()) << "step " << n;
    }
    if (n % 5 == 0) {
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, world)) << "step " << n;
    }
    const bool on_device = b.backend == Backend::cuda;
    ASSERT_EQ(on_device, WorldAccess::impl(world).resident());
    moves += on_device != was_on_device ? 1 : 0;
    was_on_device = on_device;
    // The device is faster in every second hundred of steps.
    const bool device_is_fast = n / 100 % 2 == 0;
    set_time(&world, on_device == device_is_fast ? 10 : 1000);
  }
  EXPECT_TRUE(world.snapshot() == host.snapshot());
  EXPECT_GE(moves, 5);
}

TEST(AutomaticWorld, IsContinuedByTheProcessorInTheStepInWhichTheDeviceFails) {
  Scene scene = scenes::make("mixed", {.spheres = 20});
  for (int calls = 0; calls < 12; ++calls) {
    World host = on_host(scene);
    World world = automatic(scene, device_wins(),
                            [calls] { return std::make_unique<FailingDevice>(Scene{}, calls); });
    for (World* w : {&host, &world}) {
      w->add_force(Drag{.linear = 0.1_r});
      if (calls % 2 == 1) w->add_force([](ForceContext&) {});  // then the host applies both
    }
    int failures = 0;
    for (int n = 0; n < 15; ++n) {
      host.step();
      const StepReport report = world.step();
      ASSERT_EQ(world.state_hash(), host.state_hash()) << "calls " << calls << ", step " << n;
      ASSERT_NO_FATAL_FAILURE(expect_equal_contacts(host, world));
      if (!report.device_failure.empty()) {
        EXPECT_EQ(report.device_failure, "the device is gone");
        ++failures;
      }
      if (failures > 0) {
        EXPECT_EQ(report.backend, Backend::cpu);
        EXPECT_EQ(report.choice, ChoiceReason::device_failed);
      }
      set_time(&world, report.backend == Backend::cuda ? 1 : 1000);
    }
    EXPECT_EQ(failures, 1) << "calls " << calls;
    try {
      cuda::device_states(world);
      FAIL();
    } catch (const BackendUnavailable& error) {
      EXPECT_NE(std::string(error.what()).find("the device is gone"), std::string::npos);
    }
  }
}

TEST(AutomaticWorld, DoesNotStartTheDeviceBeforeItPays) {
  const Scene scene = small_pile();
  CostModel costs = device_wins();
  costs.cuda_start_ms = 10;
  costs.cpu_world = {.call_us = 1000};
  int made = 0;
  World world = automatic(scene, costs, [&made] {
    ++made;
    return test::make_host_device_world(Scene{});
  });
  for (int n = 0; n < 10; ++n) {
    const StepReport report = world.step();
    EXPECT_EQ(report.backend, Backend::cpu);
    EXPECT_EQ(report.choice, ChoiceReason::fixed);
    set_time(&world, 1000);
    EXPECT_EQ(made, 0) << "10 ms are saved after ten steps";
  }
  for (int n = 0; WorldAccess::impl(world).device == nullptr; ++n) {
    ASSERT_LT(n, 1000000) << "steps while the device starts";
    world.step();
    set_time(&world, 1000);
  }
  EXPECT_EQ(made, 1);
}

TEST(AutomaticWorld, StartsTheDeviceOnAnotherThreadWhileTheProcessorGoesOn) {
  const Scene scene = small_pile();
  CostModel costs = device_wins();
  costs.cuda_start_ms = 1e-6;
  std::promise<void> may_end;
  std::thread::id thread;
  World world = automatic(scene, costs, [&thread, end = may_end.get_future().share()] {
    thread = std::this_thread::get_id();
    end.wait();
    return test::make_host_device_world(Scene{});
  });
  World host = on_host(scene);
  for (int n = 0; n < 20; ++n) {
    host.step();
    EXPECT_EQ(world.step().backend, Backend::cpu) << "no step waits";
    EXPECT_THROW(cuda::device_states(world), BackendUnavailable);
  }
  may_end.set_value();
  while (world.step().backend == Backend::cpu) {
    host.step();
    set_time(&world, 1000);
  }
  host.step();
  EXPECT_NE(thread, std::this_thread::get_id());
  EXPECT_EQ(world.state_hash(), host.state_hash());
}

TEST(AutomaticWorld, IsDestroyedWhileTheDeviceStarts) {
  CostModel costs = device_wins();
  costs.cuda_start_ms = 1e-6;
  bool made = false;
  {
    World world = automatic(small_pile(), costs, [&made] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      made = true;
      return test::make_host_device_world(Scene{});
    });
    for (int n = 0; n < 3; ++n) EXPECT_EQ(world.step().backend, Backend::cpu);
  }
  EXPECT_TRUE(made);
}

TEST(AutomaticWorld, StaysOnTheProcessorWithoutADeviceAndSaysWhyOneFailed) {
  const Scene scene = small_pile();
  for (const std::string failure : {"", "the device is gone"}) {
    World world = automatic(scene, device_wins(), [failure]() -> std::unique_ptr<DeviceWorld> {
      if (failure.empty()) throw BackendUnavailable("cuda: there is none");
      throw DeviceError(failure);
    });
    for (int n = 0; n < 20; ++n) {
      const StepReport report = world.step();
      EXPECT_EQ(report.backend, Backend::cpu);
      EXPECT_EQ(report.device_failure, n == 0 ? failure : "");
      EXPECT_EQ(report.choice, failure.empty() ? ChoiceReason::fixed : ChoiceReason::device_failed);
    }
  }
}

TEST(AutomaticWorld, MovesToAWarmDevice) {
  const Scene scene = small_pile();
  CostModel costs = device_wins();
  costs.cuda_start_ms = 1e-6;
  World host = on_host(scene),
        world = automatic(scene, costs, [] {
          return WorldAccess::Impl::warmed(test::make_host_device_world(Scene{}));
        });
  for (int on_device = 0; on_device < 5;) {
    host.step();
    on_device += world.step().backend == Backend::cuda ? 1 : 0;
    ASSERT_EQ(host.state_hash(), world.state_hash());
    set_time(&world, 1000);
  }
}

/// With a GPU, as a program makes a world.
TEST(AutomaticWorld, MovesToTheGpu) {
  const auto backends = available_backends();
  if (!std::ranges::any_of(backends, [](const BackendStatus& status) {
        return status.backend == Backend::cuda && status.usable;
      })) {
    ASSERT_EQ(std::getenv("JFPX_REQUIRE_CUDA"), nullptr);
    GTEST_SKIP() << "no CUDA device";
  }
  const Scene scene = scenes::make("mixed", {.spheres = 300});
  World host = on_host(scene), world(scene, {.collider = {.costs = device_wins()}});
  int on_device = 0;
  for (int n = 0; n < 60; ++n) {
    host.step();
    const StepReport report = world.step();
    if (report.backend == Backend::cuda) {
      ++on_device;
      EXPECT_GT(report.detect_ms, 0);
      EXPECT_GT(report.resolve_ms, 0);
    }
    ASSERT_EQ(host.state_hash(), world.state_hash()) << "step " << n;
    set_time(&world, 1);
  }
  EXPECT_GE(on_device, 5);
}

}  // namespace
}  // namespace jfpx
