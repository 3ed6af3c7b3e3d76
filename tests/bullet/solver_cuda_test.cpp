/// The constraint solver on a GPU: random worlds have the results of stock Bullet, and the CPU
/// replaces a GPU that fails.
#include <jfpx/bullet/constraint_solver.hpp>

#include "tests/bullet/stock_bits.hpp"
#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

class CudaSolver : public test::Cuda {};

WorldParts on_cuda(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [threads = world.threads] {
    return std::make_unique<ConstraintSolver>(
        ConstraintSolverOptions{.backend = Backend::cuda, .threads = threads, .minimum_batch = 0});
  };
  return parts;
}
WorldParts with_our_world(const SolverWorld& world) {
  return {.solver = on_cuda(world).solver, .world = our_world(world).world};
}
TEST_F(CudaSolver, MovesRandomWorldsAsStock) {
  const SolverTotals totals = expect_stocks_bits(wanted_solver_steps(), on_cuda, make_stock);
  EXPECT_GT(totals.on_device, totals.steps / 8) << "groups that the CPU solves test nothing";
}

TEST_F(CudaSolver, MovesRandomWorldsAsStockWithOurDispatcherAndWorld) {
  expect_stocks_bits(wanted_solver_steps() / 4, with_our_world, make_ours);
}

TEST_F(CudaSolver, MovesAHeapAsStockWithContactAndFrictionInEitherOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  SolverTotals totals;
  const auto failure = run(make_large_heap(seed), &totals, with_our_world, make_ours);
  EXPECT_FALSE(failure) << failure->what;
  EXPECT_GT(totals.on_device, 0u);
}

TEST_F(CudaSolver, IsReplacedByTheCpuInTheGroupInWhichItFailsAndReportsItOnce) {
  for (long call = 0; call < 100; ++call) {
    Twins twins({.parts = on_cuda({})});
    twins.both([](BulletWorld& w) { add_heap(w, 60, 17); });
    auto& solver = dynamic_cast<ConstraintSolver&>(*twins.ours().solver);
    cuda::inject_fault(call, cudaErrorECCUncorrectable);
    const bool same = twins.step(3);
    const bool failed =
        cuda::take_injected_fault() == cudaSuccess && !solver.stats().device_failure.empty();
    cuda::inject_fault(-1, cudaSuccess);
    ASSERT_TRUE(same) << "call " << call;
    if (!failed) {
      EXPECT_GE(solver.stats().on_device, 3u);
      EXPECT_GT(call, 5);
      return;
    }
    EXPECT_LT(solver.stats().on_device, 3u);
    EXPECT_NE(solver.stats().device_failure.find("/cuda/"), std::string::npos)
        << solver.stats().device_failure;
  }
  ADD_FAILURE() << "more than 100 CUDA calls";
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
