/// Backend::automatic: uses the device when it is expected to be faster, and replaces it when it
/// fails, without changing a result.
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/sphere_collider/device_double.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

std::vector<SpherePair> some_pairs(std::size_t spheres, std::size_t count, Random& random) {
  std::vector<SpherePair> pairs(count);
  for (SpherePair& p : pairs) {
    p = {static_cast<SphereIndex>(random.below(spheres)),
         static_cast<SphereIndex>(random.below(spheres))};
  }
  return pairs;
}

class AutomaticSphereColliderTest : public testing::Test {
 protected:
  std::unique_ptr<SphereCollider> make(const SphereColliderOptions& options) {
    return std::make_unique<AutomaticSphereCollider>(options, maker_with(&device_), true);
  }

  Device device_;
  Random random_{base_seed()};
};
using AutomaticCollider = AutomaticSphereColliderTest;

TEST_F(AutomaticCollider, UsesTheDeviceWhereTheModelExpectsIt) {
  const auto collider = make(device_wins());
  const auto spheres = make_gas(300, 1, 3, random_);
  EXPECT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres))) << seed_note();
  EXPECT_EQ(collider->backend(), Backend::cuda);
  EXPECT_EQ(collider->reason(), ChoiceReason::predicted);
  EXPECT_EQ(collider->device_failure(), "");
}

TEST_F(AutomaticCollider, DoesNotStartTheDeviceBeforeItPays) {
  SphereColliderOptions options = device_wins();
  options.costs.cuda_start_ms = 10;
  // The model predicts 20 ns for each of the 500500 pairs of 1001 spheres: 10.01 ms.
  options.algorithm = SphereAlgorithm::all_pairs;
  options.costs.x86_all_pairs = {.pair_ns = 20};
  const auto collider = make(options);
  const auto spheres = make_gas(1001, 1, 3, random_);
  collider->find_contacts(spheres);
  EXPECT_EQ(device_.made, 0);
  EXPECT_EQ(collider->backend(), Backend::cpu);
  EXPECT_EQ(collider->reason(), ChoiceReason::fixed);
  collider->find_contacts(spheres);
  EXPECT_EQ(device_.made, 1);
  EXPECT_EQ(collider->backend(), Backend::cuda);
}

TEST_F(AutomaticCollider, AMissingDeviceIsProbedOnceAndNotReported) {
  device_.when_made = [] { throw BackendUnavailable("cuda: no CUDA driver is installed"); };
  const auto collider = make(device_wins());
  const auto spheres = make_gas(300, 1, 3, random_);
  for (int i = 0; i < 5; ++i) {
    EXPECT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres))) << seed_note();
    EXPECT_EQ(collider->backend(), Backend::cpu);
    EXPECT_EQ(collider->device_failure(), "");
    EXPECT_NE(collider->reason(), ChoiceReason::device_failed);
  }
  EXPECT_EQ(device_.made, 1);
}

TEST_F(AutomaticCollider, AFailingDeviceIsReplacedInTheSameCallAndReportedOnce) {
  const std::function<void()> failures[] = {
      [] { throw DeviceError("the device is gone"); },
      [] { throw OutOfMemory("the device is gone"); },
  };
  for (const auto& fail : failures) {
    for (const bool when_made : {false, true}) {
      for (const bool given : {false, true}) {
        device_ = {};
        const auto collider = make(device_wins());
        const auto cpu = make_sphere_collider({.backend = Backend::cpu});
        const auto spheres = make_gas(300, 1, 3, random_);
        const auto pairs = some_pairs(300, 1000, random_);
        (when_made ? device_.when_made : device_.before_call) = [&] {
          if (when_made || device_.calls == 4) fail();
        };
        std::string reported_failures;
        for (int i = 0; i < 10; ++i) {
          if (given) {
            ASSERT_TRUE(same_bits(collider->find_touching(spheres, pairs),
                                  cpu->find_touching(spheres, pairs)))
                << seed_note();
          } else {
            ASSERT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres)))
                << seed_note();
          }
          reported_failures += collider->device_failure();
          const bool failed = !reported_failures.empty();
          EXPECT_EQ(collider->backend(), failed ? Backend::cpu : Backend::cuda);
          EXPECT_EQ(collider->reason() == ChoiceReason::device_failed, failed);
        }
        EXPECT_EQ(reported_failures, "the device is gone");
        EXPECT_EQ(device_.alive, 0) << "the failed collider must be destroyed";
        EXPECT_EQ(device_.calls, when_made ? 0 : 4) << "the device must not be used again";
      }
    }
  }
}

TEST_F(AutomaticCollider, InvalidInputIsNotADeviceFailure) {
  const auto collider = make(device_wins());
  auto spheres = make_gas(300, 1, 3, random_);
  spheres[7].radius = -1;
  EXPECT_THROW(collider->find_contacts(spheres), InvalidArgument);
  spheres[7].radius = 1;
  EXPECT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres))) << seed_note();
  EXPECT_EQ(collider->backend(), Backend::cuda);
}

TEST_F(AutomaticCollider, AFailureOfTheCpuIsThrown) {
  SphereColliderOptions options;
  for (const bool memory : {false, true}) {
    AutomaticSphereCollider collider(
        options,
        [&](const SphereColliderOptions&) -> std::unique_ptr<SphereCollider> {
          device_.before_call = [memory] {
            if (memory) throw OutOfMemory("no memory");
            throw DeviceError("no device");
          };
          return std::make_unique<DeviceDouble>(&device_, SphereAlgorithm::automatic);
        },
        true);
    const auto spheres = make_gas(30, 1, 3, random_);
    EXPECT_THROW(collider.find_contacts(spheres), Error);
  }
}

TEST_F(AutomaticCollider, KeepsTheRequestedAlgorithm) {
  for (const auto algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::sorted_tiles}) {
    const auto collider = make_sphere_collider({.algorithm = algorithm});
    for (const std::size_t n : {2u, 200u, 3000u}) {
      collider->find_contacts(make_gas(n, 1, 3, random_));
      EXPECT_EQ(collider->algorithm(), algorithm);
    }
  }
}

TEST_F(AutomaticCollider, AdaptsToANewSizeInTheSameCall) {
  const auto collider = make_sphere_collider();
  const auto few = make_gas(2, 1, 3, random_), many = make_gas(20000, 1, 3, random_);
  for (int i = 0; i < 50; ++i) collider->find_contacts(few);  // share a decision
  collider->find_contacts(many);
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::sorted_tiles);
  collider->find_contacts(few);
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::all_pairs);
}

TEST_F(AutomaticCollider, AFailureInOneKindOfCallIsNotReportedByTheNextOfTheOther) {
  SphereColliderOptions options = device_wins();
  options.costs.x86_all_pairs = {};  // searches use the CPU; one decision covers many of them
  const auto collider = make(options);
  const auto spheres = make_gas(20, 1, 3, random_);
  const auto pairs = some_pairs(20, 50, random_);
  for (int i = 0; i < 20; ++i) collider->find_contacts(spheres);
  device_.before_call = [] { throw DeviceError("the device is gone"); };
  collider->find_touching(spheres, pairs);
  EXPECT_EQ(collider->device_failure(), "the device is gone");
  collider->find_contacts(spheres);
  EXPECT_EQ(collider->device_failure(), "");
  EXPECT_EQ(collider->reason(), ChoiceReason::device_failed);
}

TEST_F(AutomaticCollider, RejectsInvalidCosts) {
  for (const double bad :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    SphereColliderOptions options;
    options.costs.x86_given_pairs.pair_ns = bad;
    try {
      make_sphere_collider(options);
      FAIL();
    } catch (const InvalidArgument& error) {
      EXPECT_NE(std::string(error.what()).find("x86_given_pairs.pair_ns"), std::string::npos)
          << error.what();
    }
  }
}

TEST_F(AutomaticCollider, StepReportsNameTheBackendAndTheFailureOnce) {
  const Scene scene = scenes::make("gas", {.spheres = 400, .seed = 1});
  World world(scene, make(device_wins()));
  World on_cpu(scene, {.collider = {.backend = Backend::cpu}});
  device_.before_call = [&] {
    if (device_.calls == 4) throw DeviceError("the device is gone");
  };
  for (int step = 1; step <= 20; ++step) {
    const StepReport report = world.step();
    on_cpu.step();
    ASSERT_EQ(world.state_hash(), on_cpu.state_hash());
    EXPECT_EQ(report.backend, step < 4 ? Backend::cuda : Backend::cpu);
    EXPECT_EQ(report.choice == ChoiceReason::device_failed, step >= 4);
    EXPECT_EQ(report.device_failure, step == 4 ? "the device is gone" : "");
    EXPECT_NE(report.algorithm, SphereAlgorithm::automatic);
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
