/// Groups of contacts have the same bits on a GPU and on the host.
#include <jfpx/error.hpp>

#include "src/contact_solver/sequential_impulse/cuda/group_solver_cuda.hpp"
#include "src/contact_solver/sequential_impulse/row_order.hpp"
#include "tests/contact_solver/host_group_solver.hpp"
#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// Random bodies and contacts, which need not touch: every field has a value of realistic size.
struct RandomGroup {
  GroupSize size;
  GroupSweeps sweeps;
  std::vector<rows::RowPair> pairs;
  std::vector<Real> bodies, factors, contacts;
  std::vector<std::uint8_t> split_impulses;  ///< by contact: may have a split impulse

  RandomGroup(std::size_t body_count, std::size_t contact_count, Random& random) {
    size = {.bodies = body_count, .contacts = contact_count, .factors = random.below(3) == 0};
    bodies.resize(body_count * rows::kBodyFields);
    factors.resize(body_count * rows::kFactorFields);
    for (std::size_t i = 1; i < body_count; ++i) fill_body(i, random);
    for (std::size_t i = 0; i < contact_count; ++i) add_contact(random);
    sweeps.settings = {.dt = Real(1) / 60,
                       .inverse_dt = 60,
                       .relaxation = 1,
                       .restitution_threshold = Real(0.2),
                       .slop = 0,
                       .split_threshold = Real(-0.04),
                       .friction_erp = Real(0.2),
                       .warm_factor = Real(0.85),
                       .epsilon = kEpsilon,
                       .split = random.below(4) != 0,
                       .warm_start = random.below(2) == 0,
                       .friction_follows_velocity = random.below(2) == 0};
    sweeps.iterations = 1 + static_cast<int>(random.below(12));
    sweeps.threshold = random.below(3) == 0 ? Real(1e-3) : Real(0);
    sweeps.directions = 1 + static_cast<std::uint32_t>(random.below(2));
    sweeps.interleave = random.below(2) == 0;
    sweeps.warm_start = sweeps.settings.warm_start;
  }

  void fill_body(std::size_t i, Random& random) {
    Real* b = bodies.data() + i * rows::kBodyFields;
    for (int k = 0; k < 20; ++k) b[k] = random.uniform(-1, 1);
    b[3] = random.uniform(Real(0.2), 2);
    for (int k = 0; k < 3; ++k) b[7 + 4 * k] = 1;
    for (int k = 0; k < 3; ++k) b[20 + 5 * k] = random.uniform(1, 5);
    Real* f = factors.data() + i * rows::kFactorFields;
    for (int k = 0; k < rows::kFactorFields; ++k) f[k] = k < 4 ? b[3] : Real(random.below(2));
  }
  void add_contact(Random& random) {
    const auto draw = [&] { return static_cast<std::int32_t>(random.below(size.bodies)); };
    rows::RowPair pair = {draw(), draw()};
    if (pair.a == 0 || pair.a == pair.b) pair.a = rows::kFixedBody;
    if (pair.b == 0) pair.b = rows::kFixedBody;
    if (random.below(16) == 0 && pair.a > 0) pair.a = ~pair.a;
    if (pair.a == rows::kFixedBody && pair.b == rows::kFixedBody) pair.b = 1;
    pairs.push_back(pair);
    const Vec3 normal = normalized(random.uniform_in_box({-1, -1, -1}, {1, 1, 1}));
    Real in[rows::kInputFields] = {normal.x, normal.y, normal.z};
    for (int k = rows::kInPointA; k < rows::kInDistance; ++k) in[k] = random.uniform(-1, 1);
    in[rows::kInDistance] = random.uniform(Real(-0.1), Real(0.02));
    in[rows::kInFriction] = random.uniform(0, 1);
    in[rows::kInRestitution] = random.uniform(0, 1);
    in[rows::kInImpulse] = random.uniform(0, 1);
    in[rows::kInErp] = Real(0.2);
    in[rows::kInAnchor] = random.below(8) == 0 ? Real(1) : Real(0);
    contacts.insert(contacts.end(), in, in + rows::kInputFields);
    split_impulses.push_back(in[rows::kInDistance] <= Real(-0.04) ? 1 : 0);
  }
  static Vec3 normalized(const Vec3& v) {
    return v * (1 / square_root(v.x * v.x + v.y * v.y + v.z * v.z));
  }

  rows::RowSweepReport solve_with(GroupSolver& solver) {
    const GroupInputs in = solver.inputs(size);
    std::copy(bodies.begin(), bodies.end(), in.bodies);
    if (size.factors) std::copy(factors.begin(), factors.end(), in.factors);
    std::copy(contacts.begin(), contacts.end(), in.contacts);
    RowOrder order;
    order.build(pairs, size.bodies, in.schedule, in.slot_contacts, in.contact_counts);
    sweeps.split_impulse_count =
        sweeps.settings.split
            ? RowOrder::select({in.schedule, size.contacts}, in.slot_contacts, split_impulses,
                               size.bodies, in.split_impulse_schedule, in.split_impulse_counts)
            : 0;
    return solver.solve(sweeps);
  }
};

bool same_outcomes(const GroupSize& size, const GroupSolver& a, const GroupSolver& b) {
  for (std::size_t i = 0; i < size.contacts; ++i) {
    const rows::ContactOutcome &x = a.outcomes()[i], &y = b.outcomes()[i];
    if (std::memcmp(x.direction, y.direction, sizeof(x.direction)) != 0 ||
        std::memcmp(x.second, y.second, sizeof(x.second)) != 0 ||
        std::memcmp(x.lateral, y.lateral, sizeof(x.lateral)) != 0 ||
        std::memcmp(&x.impulse, &y.impulse, sizeof(Real)) != 0 || x.has_second != y.has_second) {
      return false;
    }
  }
  return std::memcmp(a.velocities(), b.velocities(),
                     size.bodies * rows::kOutcomeVelocities * sizeof(Real)) == 0;
}

void expect_same(GroupSolver& device, RandomGroup& group, std::uint64_t seed) {
  HostGroupSolver host(seed);
  host.threads = 1;
  const rows::RowSweepReport expected = group.solve_with(host);
  const rows::RowSweepReport report = group.solve_with(device);
  ASSERT_EQ(report.broken, expected.broken);
  if (expected.broken) return;
  EXPECT_EQ(report.iterations, expected.iterations);
  EXPECT_EQ(report.residual, expected.residual);
  EXPECT_EQ(report.split_impulses, expected.split_impulses);
  EXPECT_TRUE(same_outcomes(group.size, device, host))
      << group.size.contacts << " contacts of " << group.size.bodies << " bodies";
}

// Sizes around those of a warp and a block. With few bodies all contacts depend on each other.
TEST_F(Cuda, GroupsOfAnySizeHaveTheBitsOfTheHost) {
  Random random(base_seed());
  const auto device = make_group_solver(0);
  for (const std::size_t contacts : {1, 2, 31, 32, 33, 63, 64, 65, 500, 5000}) {
    for (const std::size_t bodies : {std::size_t{2}, std::size_t{8}, contacts / 3 + 2}) {
      SCOPED_TRACE(seed_note());
      RandomGroup group(bodies, contacts, random);
      expect_same(*device, group, base_seed());
    }
  }
}

// For scripts/sanitize-cuda.
TEST_F(Cuda, FewContactsOfAGroup) {
  SCOPED_TRACE(seed_note());
  Random random(base_seed());
  RandomGroup group(20, 100, random);
  expect_same(*make_group_solver(0), group, base_seed());
}

// More contacts than an H200 has threads, so that every thread solves several.
TEST_F(Cuda, MoreContactsThanThreadsHaveTheBitsOfTheHost) {
  Random random(base_seed());
  const auto device = make_group_solver(0);
  for (const std::size_t contacts : {200'000, 600'000}) {
    SCOPED_TRACE(seed_note());
    RandomGroup group(contacts / 3, contacts, random);
    expect_same(*device, group, base_seed());
  }
}

TEST_F(Cuda, AnyFailingCallOfAGroupIsAnErrorAndTheNextIsSolved) {
  Random random(base_seed());
  RandomGroup group(300, 1000, random);
  for (const cudaError_t error : {cudaErrorMemoryAllocation, cudaErrorLaunchOutOfResources}) {
    const auto survivor = make_group_solver(0);
    int failed = 0;
    for (long call = 0; call < 200; ++call) {
      inject_fault(call, error);
      bool threw = false;
      try {
        make_group_solver(0);
        group.solve_with(*survivor);
      } catch (const BackendUnavailable&) {
        threw = true;  // the properties of the device were not available
      } catch (const std::exception& e) {
        threw = true;
        EXPECT_NE(std::string(e.what()).find("/cuda/"), std::string::npos) << e.what();
      }
      inject_fault(-1, cudaSuccess);
      if (!threw) break;
      ++failed;
    }
    EXPECT_GT(failed, 10);
    EXPECT_LT(failed, 200);
    expect_same(*survivor, group, base_seed());
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
