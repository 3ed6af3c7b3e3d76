/// Groups that are handed to a device: a double of one, whose walkers are those of the kernels.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/error.hpp>

#include "src/contact_solver/row_order.hpp"
#include "tests/bullet/stock_bits.hpp"
#include "tests/contact_solver/group_double.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

using test::GroupDouble;

WorldParts with_double(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [seed = world.base.seed, threads = world.threads] {
    return std::make_unique<ConstraintSolver>(
        std::make_unique<GroupDouble>(seed),
        ConstraintSolverOptions{.backend = Backend::cuda, .threads = threads, .minimum_batch = 0});
  };
  return parts;
}

TEST(GpuIslandSolver, MoveRandomWorldsAsStock) {
  const SolverTotals totals =
      expect_stocks_bits(wanted_solver_steps() / 2, with_double, make_stock);
  EXPECT_GT(totals.on_device, totals.steps / 8) << "groups that x86 solves show nothing";
}

TEST(GpuIslandSolver, MoveAHeapAsStockWithContactAndFrictionInEitherOrder) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  const SolverWorld world = make_large_heap(seed);
  SolverTotals totals;
  const auto failure = run(world, &totals, with_double, make_stock);
  EXPECT_FALSE(failure) << failure->what;
  EXPECT_GT(totals.on_device, 0u);
  EXPECT_GT(totals.contacts, 12u * 1000u);
}

WorldParts with_slightly_wrong_double(const SolverWorld& world) {
  WorldParts parts;
  parts.solver = [seed = world.base.seed] {
    auto device = std::make_unique<GroupDouble>(seed);
    device->slightly_wrong = true;
    return std::make_unique<ConstraintSolver>(
        std::move(device), ConstraintSolverOptions{.backend = Backend::cuda, .minimum_batch = 0});
  };
  return parts;
}

TEST(GpuIslandSolver, ShowAnErrorOfOneBit) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  int failed = 0;
  for (std::uint64_t i = 0; i < 40; ++i) {
    failed += run(make_solver_world(seed + i), nullptr, with_slightly_wrong_double) ? 1 : 0;
  }
  EXPECT_GT(failed, 5) << "most worlds with contacts must fail";
}

/// The device fails in its third group, before or after it has filled its results.
TEST(GpuIslandSolver, ADeviceThatFailsIsReplacedInTheSameGroupAndReportedOnce) {
  int groups = 0;
  WorldParts parts;
  parts.solver = [&] {
    auto device = std::make_unique<GroupDouble>(7);
    device->before_solve = [&] {
      if (++groups == 3) throw DeviceError("the device is gone");
    };
    return std::make_unique<ConstraintSolver>(
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

TEST(GpuIslandSolver, ABackendThatCantBeHadIsUnavailableAndAutomaticDoesWithout) {
  EXPECT_THROW(ConstraintSolver({.backend = Backend::cuda, .device = 1000}), BackendUnavailable);
  const ConstraintSolver solver({.backend = Backend::automatic, .device = 1000});
  EXPECT_EQ(solver.stats().device_failure, "");
}

TEST(GpuIslandSolver, AreNotAskedForOnX86) {
  int groups = 0;
  WorldParts parts;
  parts.solver = [&] {
    auto device = std::make_unique<GroupDouble>(7);
    device->before_solve = [&] { ++groups; };
    return std::make_unique<ConstraintSolver>(
        std::move(device), ConstraintSolverOptions{.backend = Backend::cpu, .minimum_batch = 0});
  };
  Twins twins({.parts = parts});
  twins.both([](BulletWorld& w) { add_heap(w, 60, 17); });
  ASSERT_TRUE(twins.step(3));
  EXPECT_EQ(groups, 0);
}

/// Such as that of a contact without a normal, which pushes nobody: it would be another NaN on a
/// GPU than on x86, so that Bullet has to solve the group.
TEST(GpuIslandSolver, ADirectionThatIsNoNumberBreaksTheGroup) {
  GroupDouble device(1);
  for (const Real normal : {Real(1), Real(0)}) {
    const GroupInputs in = device.inputs({.bodies = 2, .contacts = 1});
    std::fill_n(in.bodies, 2 * rows::kBodyFields, Real(0));
    in.bodies[rows::kBodyFields + 3] = 1;
    std::fill_n(in.contacts, rows::kInputFields, Real(0));
    in.contacts[rows::kInNormal] = normal;
    in.contacts[rows::kInDistance] = 1;
    const std::vector<rows::RowPair> pairs = {{1, rows::kFixedBody}};
    RowOrder().build(pairs, 2, in.places, in.place_contacts, in.moves);
    GroupSweeps sweeps{};
    sweeps.settings.dt = sweeps.settings.inverse_dt = sweeps.settings.relaxation = 1;
    EXPECT_EQ(device.solve(sweeps).broken, normal == 0);
    EXPECT_EQ(device.outcomes()[0].impulse, 0);
  }
}

/// Each body meets its contacts in the given order, and a place never needs a later one.
TEST(RowOrder, KeepsTheOrderOfEveryBody) {
  const std::uint64_t seed = test_seed();
  SCOPED_TRACE("JFPX_TEST_SEED=" + std::to_string(seed));
  Random random(seed);
  RowOrder order;
  for (int round = 0; round < 200; ++round) {
    const std::size_t bodies = 1 + random.below(40), count = random.below(200);
    std::vector<rows::RowPair> pairs(count);
    for (rows::RowPair& pair : pairs) {
      const auto id = [&] {
        const auto body = static_cast<std::int32_t>(random.below(bodies));
        return body == 0 || random.below(8) == 0 ? ~body : body;
      };
      pair = {id(), id()};
      if (pair.a == pair.b) pair.b = rows::kFixedBody;
    }
    std::vector<rows::Place> places(count), chosen(count + 1);
    std::vector<std::uint32_t> contacts(count), moves(bodies), chosen_moves(bodies);
    order.build(pairs, bodies, places.data(), contacts.data(), moves.data());
    std::vector<std::uint8_t> marks(count);
    for (std::uint8_t& mark : marks) mark = random.below(3) == 0 ? 1 : 0;
    const std::uint32_t some = RowOrder::choose(places, contacts.data(), marks, bodies,
                                                chosen.data(), chosen_moves.data());

    std::vector<std::uint32_t> met(bodies), met_of_chosen(bodies);
    std::vector<std::int64_t> last(bodies, -1);
    std::uint32_t next_chosen = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
      const rows::Place& place = places[k];
      ASSERT_EQ(place.row, k);
      ASSERT_EQ(place.a, pairs[contacts[k]].a);
      ASSERT_EQ(place.b, pairs[contacts[k]].b);
      const bool is_chosen = marks[contacts[k]] != 0;
      const auto expect_turn = [&](std::int32_t id, std::uint32_t rank, std::uint32_t chosen_rank) {
        if (id < 0) return;
        const auto body = static_cast<std::size_t>(id);
        EXPECT_EQ(rank, met[body]++);
        EXPECT_LT(last[body], contacts[k]);
        last[body] = contacts[k];
        if (!is_chosen) return;
        EXPECT_EQ(chosen_rank, met_of_chosen[body]++);
      };
      const rows::Place& in_chosen = chosen[std::min(next_chosen, some)];
      expect_turn(place.a, place.rank_a, in_chosen.rank_a);
      expect_turn(place.b, place.rank_b, in_chosen.rank_b);
      if (!is_chosen) continue;
      EXPECT_EQ(in_chosen.row, k);
      ++next_chosen;
    }
    EXPECT_EQ(next_chosen, some);
    EXPECT_EQ(met, moves);
    EXPECT_EQ(met_of_chosen, chosen_moves);
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
