/// cuda::device_states(): the arrays that a device has are the states of the world.
#include <jfpx/backend.hpp>
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>

#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/cuda_devices.hpp"
#include "tests/world/host_device.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>
#if JFPX_HAS_CUDA
#include <cuda_runtime_api.h>
#endif

#include <cstring>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

namespace jfpx {
namespace {

struct Kind {
  friend void PrintTo(const Kind& kind, std::ostream* out) { *out << kind.name; }
  std::string name;
  std::function<std::unique_ptr<DeviceWorld>(const Scene&)> make;
  /// Copies bytes from the device to the host.
  std::function<void(void* to, const void* from, std::size_t bytes)> copy;
};

std::vector<Kind> kinds() {
  std::vector<Kind> kinds{{"Host", test::make_host_device_world, std::memcpy}};
#if JFPX_HAS_CUDA
  for (const auto& devices : test::one_cuda_device()) {
    kinds.push_back({devices.name, devices, [](void* to, const void* from, std::size_t bytes) {
                       ASSERT_EQ(cudaMemcpy(to, from, bytes, cudaMemcpyDefault), cudaSuccess);
                     }});
  }
#endif
  return kinds;
}

class DeviceStatesTest : public testing::TestWithParam<Kind> {
 protected:
  World on_device(const Scene& scene) const {
    World world(scene, {.collider = {.backend = Backend::cpu}});
    WorldAccess::impl(world).device = GetParam().make(scene);
    return world;
  }

  template <class T>
  std::vector<T> fetch(const T* from, std::size_t count) const {
    std::vector<T> to(count);
    GetParam().copy(to.data(), from, count * sizeof(T));
    return to;
  }

  /// The arrays are the states of `world`.
  void expect_states(World* world, const std::vector<BodyState>& states) const {
    const cuda::DeviceStates device = cuda::device_states(*world);
    const std::span<const BodyId> bodies = world->bodies();
    ASSERT_EQ(fetch(device.ids, device.count), std::vector(bodies.begin(), bodies.end()));
    const auto positions = fetch(device.positions, device.slots);
    const auto orientations = fetch(device.orientations, device.slots);
    const auto velocities = fetch(device.velocities, device.slots);
    const auto angular_velocities = fetch(device.angular_velocities, device.slots);
    ASSERT_EQ(states.size(), bodies.size());
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      const std::uint32_t i = bodies[k].index;
      ASSERT_LT(i, device.slots);
      ASSERT_EQ(positions[i], states[k].position);
      ASSERT_EQ(orientations[i], states[k].orientation);
      ASSERT_EQ(velocities[i], states[k].velocity);
      ASSERT_EQ(angular_velocities[i], states[k].angular_velocity);
    }
  }
};
INSTANTIATE_TEST_SUITE_P(Devices, DeviceStatesTest, testing::ValuesIn(kinds()),
                         [](const auto& row) { return row.param.name; });

TEST_P(DeviceStatesTest, AreThoseAfterEachStepAndChange) {
  const Scene scene = scenes::make("mixed", {.spheres = 30});
  World host(scene, {.collider = {.backend = Backend::cpu}}), device = on_device(scene);
  ASSERT_NO_FATAL_FAILURE(expect_states(&device, host.states())) << "before the first step";
  for (int n = 0; n < 12; ++n) {
    host.step();
    device.step();
    ASSERT_NO_FATAL_FAILURE(expect_states(&device, host.states())) << "step " << n;
    for (World* world : {&host, &device}) {
      if (n == 3) world->remove(world->bodies()[5]);
      if (n == 6) world->add(test::ball({0, 20, 0}));
      if (n == 9) world->set_state(world->bodies()[2], {{0, 30, 0}, {}, {1, 0, 0}, {0, 2, 0}});
    }
    ASSERT_NO_FATAL_FAILURE(expect_states(&device, host.states())) << "after step " << n;
    EXPECT_TRUE(WorldAccess::impl(device).resident());
  }
}

TEST_P(DeviceStatesTest, LeaveTheContactsAsTheyAre) {
  const Scene scene = scenes::make("pile", {.spheres = 60});
  World host(scene, {.collider = {.backend = Backend::cpu}}), device = on_device(scene);
  const auto copy = [](const auto& span) { return std::vector(span.begin(), span.end()); };
  for (int n = 0; n < 40; ++n) {
    host.step();
    device.step();
    if (n % 3 == 0) {
      for (World* world : {&host, &device}) world->wake(world->bodies()[0]);  // a change
    }
    cuda::device_states(device);
    ASSERT_EQ(copy(device.contacts()), copy(host.contacts())) << "step " << n;
    ASSERT_EQ(copy(device.contact_events()), copy(host.contact_events())) << "step " << n;
  }
  EXPECT_FALSE(host.contacts().empty());
}

TEST_P(DeviceStatesTest, OfAWorldWithoutBodies) {
  World world = on_device(Scene{});
  EXPECT_EQ(cuda::device_states(world).count, 0u);
}

TEST(DeviceStates, RequireADevice) {
  const Scene scene = scenes::make("pile", {.spheres = 5});
  World world(scene, {.collider = {.backend = Backend::cpu}});
  world.step();
  EXPECT_THROW(cuda::device_states(world), BackendUnavailable);
}

/// The contact finder of a world with the thesis' solver uses the GPU; its state does not.
TEST(DeviceStates, RequireSoftStep) {
  if (test::one_cuda_device().empty()) GTEST_SKIP() << "no CUDA device";
  Scene scene = scenes::make("pile", {.spheres = 5});
  scene.solver = Solver::worst_first;
  World world(scene, {.collider = {.backend = Backend::cuda}});
  EXPECT_THROW(cuda::device_states(world), BackendUnavailable);
  scene.solver = Solver::soft_step;
  World resident(scene, {.collider = {.backend = Backend::cuda}});
  EXPECT_EQ(cuda::device_states(resident).count, scene.bodies.size());
}

}  // namespace
}  // namespace jfpx
