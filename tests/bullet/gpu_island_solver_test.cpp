/// Groups that a device solves, with a test double that runs the code of the kernels on the host.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/solver/constraint_solver_test_access.hpp"
#include "src/contact_solver/sequential_impulse/coloring.hpp"
#include "src/contact_solver/sequential_impulse/row_order.hpp"
#include "tests/bullet/stock_bits.hpp"
#include "tests/contact_solver/host_group_solver.hpp"

#include <atomic>
#include <chrono>
#include <future>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

using test::HostGroupSolver;

WorldParts with_host_device(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [seed = world.base.seed, threads = world.threads] {
    return ConstraintSolverTestAccess::make(
        std::make_unique<HostGroupSolver>(seed),
        ConstraintSolverOptions{.backend = Backend::cuda, .threads = threads, .minimum_batch = 0});
  };
  return parts;
}

TEST(GpuIslandSolver, MovesRandomWorldsAsStock) {
  const SolverTotals totals =
      expect_stocks_bits(wanted_solver_steps() / 2, with_host_device, make_stock);
  EXPECT_GT(totals.on_device, totals.steps / 8) << "groups that the CPU solves test nothing";
}

TEST(GpuIslandSolver, MovesAHeapAsStockWithContactAndFrictionInEitherOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  const SolverWorld world = make_large_heap(seed);
  SolverTotals totals;
  const auto failure = run(world, &totals, with_host_device, make_stock);
  EXPECT_FALSE(failure) << failure->what;
  EXPECT_GT(totals.on_device, 0u);
  EXPECT_GT(totals.contacts, 12u * 1000u);
}

WorldParts with_slightly_wrong_device(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [seed = world.base.seed] {
    auto device = std::make_unique<HostGroupSolver>(seed);
    device->slightly_wrong = true;
    return ConstraintSolverTestAccess::make(
        std::move(device), ConstraintSolverOptions{.backend = Backend::cuda, .minimum_batch = 0});
  };
  return parts;
}

TEST(GpuIslandSolver, ShowsAnErrorOfOneBit) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  int failed = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    failed += run(make_solver_world(seed + i), nullptr, with_slightly_wrong_device) ? 1 : 0;
  }
  EXPECT_GT(failed, 5) << "most worlds with contacts must fail";
}

/// The device fails in its third group.
TEST(GpuIslandSolver, ADeviceThatFailsIsReplacedInTheSameGroupAndReportedOnce) {
  int groups = 0;
  WorldParts parts;
  parts.solver = [&] {
    auto device = std::make_unique<HostGroupSolver>(7);
    device->before_solve = [&] {
      if (++groups == 3) throw DeviceError("the device is gone");
    };
    return ConstraintSolverTestAccess::make(
        std::move(device), ConstraintSolverOptions{.backend = Backend::cuda, .minimum_batch = 0});
  };
  Twins twins({.parts = parts});
  twins.both([](BulletWorld& w) { add_heap(w, 60, 17); });
  auto& solver = dynamic_cast<ConstraintSolver&>(*twins.ours().solver);
  ASSERT_TRUE(twins.step());
  EXPECT_EQ(solver.stats().device_failure, "");
  ASSERT_TRUE(twins.step(30));
  EXPECT_EQ(groups, 3);
  EXPECT_EQ(solver.stats().on_device, 2u);
  EXPECT_GT(solver.stats().groups, 20u);
  EXPECT_EQ(solver.stats().device_failure, "the device is gone");
  solver.reset_stats();
  EXPECT_EQ(solver.stats().groups, 0u);
  EXPECT_EQ(solver.stats().device_failure, "the device is gone");
}

/// Groups of some thousand contacts and many iterations, for which a GPU is predicted to be faster.
void add_work_for_a_device(BulletWorld& w) {
  add_heap(w, 3200, 17, btScalar(13));
  w.world.getSolverInfo().m_numIterations = 100;
}

TEST(GpuIslandSolver, StartsOnAnotherThreadWhileTheCpuGoesOn) {
  for (const bool fails : {false, true}) {
    std::promise<void> may_end;
    std::shared_future<void> end(may_end.get_future());
    WorldParts parts;
    parts.solver = [&] {
      const auto start = [&]() -> std::unique_ptr<GroupSolver> {
        end.wait();
        if (fails) throw BackendUnavailable("cuda: no CUDA driver is installed");
        return std::make_unique<HostGroupSolver>(7);
      };
      return ConstraintSolverTestAccess::make(start, 1e-6, {.minimum_batch = 0});
    };
    Twins twins({.parts = parts});
    twins.both(add_work_for_a_device);
    const auto& stats = dynamic_cast<ConstraintSolver&>(*twins.ours().solver).stats();
    ASSERT_TRUE(twins.step(4));
    EXPECT_GT(stats.groups, 0u);
    EXPECT_EQ(stats.on_device, 0u) << "no step waits";
    may_end.set_value();
    for (int i = 0; i < 100 && stats.on_device == 0 && !fails; ++i) ASSERT_TRUE(twins.step());
    ASSERT_TRUE(twins.step(3));
    EXPECT_EQ(stats.on_device > 0, !fails);
    EXPECT_EQ(stats.device_failure, "");
  }
}

TEST(GpuIslandSolver, IsDestroyedWhileItStarts) {
  std::atomic<bool> made = false;
  WorldParts parts;
  parts.solver = [&] {
    const auto start = [&]() -> std::unique_ptr<GroupSolver> {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      made = true;
      return std::make_unique<HostGroupSolver>(7);
    };
    return ConstraintSolverTestAccess::make(start, 1e-6, {.minimum_batch = 0});
  };
  {
    Twins twins({.parts = parts});
    twins.both(add_work_for_a_device);
    ASSERT_TRUE(twins.step(5));
  }
  EXPECT_TRUE(made);
}

TEST(GpuIslandSolver, AnUnavailableBackendThrowsAndAutomaticRunsWithoutIt) {
  EXPECT_THROW(ConstraintSolver({.backend = Backend::cuda, .device = 1000}), BackendUnavailable);
  const ConstraintSolver solver({.backend = Backend::automatic, .device = 1000});
  EXPECT_EQ(solver.stats().device_failure, "");
}

TEST(GpuIslandSolver, IsNotUsedByTheCpuBackend) {
  int groups = 0;
  WorldParts parts;
  parts.solver = [&] {
    auto device = std::make_unique<HostGroupSolver>(7);
    device->before_solve = [&] { ++groups; };
    return ConstraintSolverTestAccess::make(
        std::move(device), ConstraintSolverOptions{.backend = Backend::cpu, .minimum_batch = 0});
  };
  Twins twins({.parts = parts});
  twins.both([](BulletWorld& w) { add_heap(w, 60, 17); });
  ASSERT_TRUE(twins.step(3));
  EXPECT_EQ(groups, 0);
}

/// A contact without a normal has such a direction. The bits of its NaN would differ between a GPU
/// and a CPU, so Bullet has to solve the group.
TEST(GpuIslandSolver, ADirectionThatIsNaNBreaksTheGroup) {
  HostGroupSolver device(1);
  for (const Real normal : {Real(1), Real(0)}) {
    const GroupInputs in = device.inputs({.bodies = 2, .contacts = 1});
    std::fill_n(in.bodies, 2 * rows::kBodyFields, Real(0));
    in.bodies[rows::kBodyFields + 3] = 1;
    std::fill_n(in.contacts, rows::kInputFields, Real(0));
    in.contacts[rows::kInNormal] = normal;
    in.contacts[rows::kInDistance] = 1;
    const std::vector<rows::RowPair> pairs = {{1, rows::kFixedBody}};
    RowOrder().build(pairs, 2, in.schedule, in.slot_contacts, in.contact_counts);
    GroupSweeps sweeps{};
    sweeps.settings.dt = sweeps.settings.inverse_dt = sweeps.settings.relaxation = 1;
    EXPECT_EQ(device.solve(sweeps).broken, normal == 0);
    EXPECT_EQ(device.outcomes()[0].impulse, 0);
  }
}

std::vector<rows::RowPair> random_pairs(std::size_t bodies, std::size_t count, Random& random) {
  std::vector<rows::RowPair> pairs(count);
  for (rows::RowPair& pair : pairs) {
    const auto id = [&] {
      const auto body = static_cast<std::int32_t>(random.below(bodies));
      return body == 0 || random.below(8) == 0 ? ~body : body;
    };
    pair = {id(), id()};
    if (pair.a == pair.b) pair.b = rows::kFixedBody;
  }
  return pairs;
}

TEST(ContactColoring, GivesEachContactTheLowestColorAboveEarlierContactsOfItsBodies) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  ContactColoring coloring;
  for (int round = 0; round < 200; ++round) {
    const std::size_t bodies = 1 + random.below(40), count = random.below(200);
    const std::vector<rows::RowPair> pairs = random_pairs(bodies, count, random);
    coloring.build(pairs, bodies);
    std::vector<std::uint32_t> contacts_of(coloring.colors());
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t lowest = 0;
      for (std::size_t k = 0; k < i; ++k) {
        const auto shares = [&](std::int32_t id) {
          return id >= 0 && (id == pairs[k].a || id == pairs[k].b);
        };
        if (!shares(pairs[i].a) && !shares(pairs[i].b)) continue;
        lowest = std::max(lowest, coloring.colors_of_contacts()[k] + 1);
      }
      ASSERT_EQ(coloring.colors_of_contacts()[i], lowest);
      ASSERT_LT(lowest, coloring.colors());
      ++contacts_of[lowest];
    }
    for (std::uint32_t color = 0; color < coloring.colors(); ++color) {
      EXPECT_GT(contacts_of[color], 0u);
      EXPECT_EQ(coloring.contacts_of(color), contacts_of[color]);
    }
  }
}

/// Each body meets its contacts in the given order, and no slot depends on a later slot.
TEST(RowOrder, KeepsTheOrderOfEveryBody) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  RowOrder order;
  for (int round = 0; round < 200; ++round) {
    const std::size_t bodies = 1 + random.below(40), count = random.below(200);
    const std::vector<rows::RowPair> pairs = random_pairs(bodies, count, random);
    std::vector<rows::ScheduledContact> schedule(count), selected(count + 1);
    std::vector<std::uint32_t> contacts(count), contact_counts(bodies), selected_counts(bodies);
    order.build(pairs, bodies, schedule.data(), contacts.data(), contact_counts.data());
    std::vector<std::uint8_t> is_marked(count);
    for (std::uint8_t& mark : is_marked) mark = random.below(3) == 0 ? 1 : 0;
    const std::uint32_t selected_count = RowOrder::select(
        schedule, contacts.data(), is_marked, bodies, selected.data(), selected_counts.data());

    std::vector<std::uint32_t> met(bodies), met_of_selected(bodies);
    std::vector<std::int64_t> last(bodies, -1);
    std::uint32_t next_selected = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const rows::ScheduledContact& contact = schedule[k];
      ASSERT_EQ(contact.slot, k);
      ASSERT_EQ(contact.a, pairs[contacts[k]].a);
      ASSERT_EQ(contact.b, pairs[contacts[k]].b);
      const bool is_selected = is_marked[contacts[k]] != 0;
      const auto expect_rank = [&](std::int32_t id, std::uint32_t rank,
                                   std::uint32_t selected_rank) {
        if (id < 0) return;
        const auto body = static_cast<std::size_t>(id);
        EXPECT_EQ(rank, met[body]++);
        EXPECT_LT(last[body], contacts[k]);
        last[body] = contacts[k];
        if (!is_selected) return;
        EXPECT_EQ(selected_rank, met_of_selected[body]++);
      };
      const rows::ScheduledContact& in_selected = selected[std::min(next_selected, selected_count)];
      expect_rank(contact.a, contact.rank_a, in_selected.rank_a);
      expect_rank(contact.b, contact.rank_b, in_selected.rank_b);
      if (!is_selected) continue;
      EXPECT_EQ(in_selected.slot, k);
      ++next_selected;
    }
    EXPECT_EQ(next_selected, selected_count);
    EXPECT_EQ(met, contact_counts);
    EXPECT_EQ(met_of_selected, selected_counts);
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
