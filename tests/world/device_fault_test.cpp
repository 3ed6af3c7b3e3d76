/// Steps on a CUDA device while CUDA calls fail.
#include <jfpx/cuda/world.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/base/cuda/cuda_try.hpp"
#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"
#include "tests/world/cuda_devices.hpp"
#include "tests/world/several_blocks.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace jfpx {
namespace {

/// On one device, and on several parts of it.
class CudaWorld : public testing::TestWithParam<test::CudaDevices> {
 protected:
  static constexpr long kMostCalls = 10'000;  ///< more than a run makes

 private:
  test::SeveralBlocks several_blocks_{
      GetParam().devices.size() > 1 ? 8 : soft_step::kMostBodiesInOneBlock};
};
INSTANTIATE_TEST_SUITE_P(Devices, CudaWorld, testing::ValuesIn([] {
                           std::vector<test::CudaDevices> all = test::one_cuda_device();
                           for (const auto& devices : test::several_cuda_devices()) {
                             all.push_back(devices);
                           }
                           return all;
                         }()),
                         [](const auto& row) { return row.param.name; });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(CudaWorld);  // no CUDA device

void add_forces(World* world) {
  world->add_force(Gravity{});
  world->add_force(Spring{.a = {world->bodies()[0]}, .b = {world->bodies()[1]}, .stiffness = 1});
  world->add_force(Buoyancy{.density = 1});
}

/// Makes a change again if it fails, which must then have changed nothing.
template <class Change>
void retry(const Change& change) {
  try {
    change();
  } catch (const DeviceError&) {
    change();
  }
}

/// If a call of a step fails, the processor completes this step and the later ones.
TEST_P(CudaWorld, AnyFailingCallLeavesTheBitsOfTheProcessor) {
  constexpr int kSteps = 4;
  const Scene scene = scenes::make("mixed", {.spheres = 40});
  const auto run = [&scene](World* world) {
    for (int n = 0; n < kSteps; ++n) {
      world->apply_force(world->bodies()[1], {3, 4, 5});
      world->set_state(world->bodies()[2], {{0, static_cast<Real>(n), 0}, {}, {1, 0, 0}, {}});
      if (n == 2) retry([&] { world->remove(world->bodies()[20]); });
      if (n > 0) {
        retry([&] { world->add(scene.bodies[static_cast<std::size_t>(10 + n)]); });
      }
      world->step();
    }
  };
  World host(scene, {.collider = {.backend = Backend::cpu}});
  add_forces(&host);
  run(&host);
  long failing = 0;
  for (bool was_reached = true; was_reached; ++failing) {
    ASSERT_LT(failing, kMostCalls);
    World world(scene, {.collider = {.backend = Backend::cpu}});
    add_forces(&world);
    WorldAccess::impl(world).device = GetParam()(scene);
    cuda::inject_fault(failing, cudaErrorLaunchOutOfResources);
    run(&world);
    for (long n = 0; n <= failing; ++n) {
      if (cuda::take_injected_fault() != cudaSuccess) was_reached = false;
    }
    cuda::inject_fault(-1, cudaSuccess);
    ASSERT_EQ(world.state_hash(), host.state_hash()) << "call " << failing;
  }
  EXPECT_GT(failing, 50);
}

/// The same for enqueued steps: whichever call fails, of the queue, of the wait for it, or of the
/// changes in between, the processor makes the steps that the device has not completed.
TEST_P(CudaWorld, AnyFailingCallOfAQueueLeavesTheBitsOfTheProcessor) {
  const Scene scene = scenes::make("mixed", {.spheres = 40});
  const auto run = [](World* world, bool is_queue) {
    for (std::uint32_t n = 1; n < 4; ++n) {
      world->apply_force(world->bodies()[1], {3, 4, 5});
      bool was_enqueued = false;
      if (is_queue) {
        try {
          cuda::enqueue_steps(*world, n, nullptr);
          was_enqueued = true;
        } catch (const BackendUnavailable&) {  // the device has failed before
        } catch (const DeviceError&) {         // it cannot report whether the stream is captured
        }
      }
      for (std::uint32_t k = 0; k < n && !was_enqueued; ++k) world->step();
      if (n == 2) retry([&] { world->remove(world->bodies()[20]); });
    }
  };
  World host(scene, {.collider = {.backend = Backend::cpu}});
  add_forces(&host);
  run(&host, false);
  long failing = 0;
  for (bool was_reached = true; was_reached; ++failing) {
    ASSERT_LT(failing, kMostCalls);
    World world(scene, {.collider = {.backend = Backend::cpu}});
    add_forces(&world);
    WorldAccess::impl(world).device = GetParam()(scene);
    cuda::inject_fault(failing, cudaErrorLaunchOutOfResources);
    run(&world, true);
    const StepReport report = cuda::finish_steps(world);
    for (long n = 0; n <= failing; ++n) {
      if (cuda::take_injected_fault() != cudaSuccess) was_reached = false;
    }
    cuda::inject_fault(-1, cudaSuccess);
    ASSERT_EQ(world.steps(), host.steps()) << "call " << failing;
    ASSERT_EQ(world.state_hash(), host.state_hash()) << "call " << failing;
    if (was_reached) {
      EXPECT_EQ(report.device_failure.empty(), WorldAccess::impl(world).device != nullptr);
    }
  }
  EXPECT_GT(failing, 50);
}

}  // namespace
}  // namespace jfpx
