/// Warm steps allocate nothing. A program of its own, because it replaces operator new.
#include "examples/scenes/scenes.hpp"
#include "tests/world/support.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {
std::atomic<long> allocations{0};
}

void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace jfpx {
namespace {

TEST(Allocation, StepsOverTheSameContactsAllocateNothing) {
  // At rest and awake: the same contacts step after step.
  Scene scene = scenes::make("columns", {.spheres = 64, .seed = 1});
  scene.sleep.enabled = false;
  scene.resolver.max_iterations = 20000;
  World world(scene);
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

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  const auto memory = std::make_unique<int>(1);
  EXPECT_GT(allocations, before) << *memory;
}

}  // namespace
}  // namespace jfpx
