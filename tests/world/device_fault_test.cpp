/// Steps on a CUDA device while CUDA calls fail.
#include <jfpx/backend.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/base/cuda/cuda_try.hpp"
#include "src/scenes/scenes.hpp"
#include "src/world/world_impl.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace jfpx {
namespace {

bool has_device() {
  for (const BackendStatus& status : available_backends()) {
    if (status.backend == Backend::cuda && status.usable) return true;
  }
  return false;
}

void add_forces(World* world) {
  world->add_force(Gravity{});
  world->add_force(Spring{.a = {world->bodies()[0]}, .b = {world->bodies()[1]}, .stiffness = 1});
  world->add_force(Buoyancy{.density = 1});
}

/// If a call of a step fails, the processor completes this step and the later ones.
TEST(CudaWorld, AnyFailingCallLeavesTheBitsOfTheProcessor) {
  if (!has_device()) {
    ASSERT_EQ(std::getenv("JFPX_REQUIRE_CUDA"), nullptr);
    GTEST_SKIP() << "no CUDA device";
  }
  constexpr int kSteps = 4;
  const Scene scene = scenes::make("mixed", {.spheres = 40});
  World host(scene, {.collider = {.backend = Backend::cpu, .threads = 1}});
  add_forces(&host);
  for (int n = 0; n < kSteps; ++n) host.step();
  long failing = 0;
  for (bool was_reached = true; was_reached; ++failing) {
    ASSERT_LT(failing, 2000);
    World world(scene, {.collider = {.backend = Backend::cpu, .threads = 1}});
    add_forces(&world);
    WorldAccess::impl(world).device = make_device_world(scene);
    cuda::inject_fault(failing, cudaErrorLaunchOutOfResources);
    for (int n = 0; n < kSteps; ++n) world.step();
    for (long n = 0; n <= failing; ++n) {
      if (cuda::take_injected_fault() != cudaSuccess) was_reached = false;
    }
    cuda::inject_fault(-1, cudaSuccess);
    ASSERT_EQ(world.state_hash(), host.state_hash()) << "call " << failing;
  }
  EXPECT_GT(failing, 50);
}

}  // namespace
}  // namespace jfpx
