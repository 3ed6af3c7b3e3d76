/// Backend::automatic: uses the device when it is expected to be faster, and replaces it when it
/// fails, without changing a result.
#include <jfpx/world.hpp>

#include "src/scenes/scenes.hpp"
#include "tests/sphere_collider/device_double.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <future>
#include <span>
#include <string>
#include <thread>

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

/// Options whose costs state that the start of the device takes next to no time.
SphereColliderOptions device_pays_soon() {
  SphereColliderOptions options = device_wins();
  options.costs.cuda_start_ms = 1e-6;
  return options;
}

void call_until_cuda(SphereCollider& collider, std::span<const SphereInstance> spheres) {
  while (collider.backend() != Backend::cuda) {
    EXPECT_TRUE(same_bits(collider.find_contacts(spheres), brute_force(spheres))) << seed_note();
    EXPECT_EQ(collider.device_failure(), "");
  }
}

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
  options.costs.cpu_all_pairs = {.pair_ns = 20};
  const auto collider = make(options);
  const auto spheres = make_gas(1001, 1, 3, random_);
  collider->find_contacts(spheres);
  EXPECT_EQ(device_.made, 0);
  EXPECT_EQ(collider->backend(), Backend::cpu);
  EXPECT_EQ(collider->reason(), ChoiceReason::fixed);
  call_until_cuda(*collider, spheres);
  EXPECT_GE(device_.made, 1);
}

TEST_F(AutomaticCollider, StartsTheDeviceOnAnotherThreadWhileTheCpuGoesOn) {
  for (const bool given : {false, true}) {
    device_ = {};
    std::promise<void> may_end;
    std::shared_future<void> end(may_end.get_future());
    std::thread::id thread;
    device_.when_made = [&] {
      if (device_.made == 1) thread = std::this_thread::get_id();
      end.wait();
    };
    const auto collider = make(device_pays_soon());
    const auto spheres = make_gas(300, 1, 3, random_);
    const auto pairs = some_pairs(300, 1000, random_);
    const auto call = [&] {
      if (!given) {
        EXPECT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres)));
      } else {
        collider->find_touching(spheres, pairs);
      }
    };
    for (int i = 0; i < 20; ++i) {
      call();
      EXPECT_EQ(collider->backend(), Backend::cpu) << "no call waits";
    }
    may_end.set_value();
    while (collider->backend() == Backend::cpu) call();
    EXPECT_NE(thread, std::thread::id());
    EXPECT_NE(thread, std::this_thread::get_id());
    EXPECT_EQ(device_.made, given ? 1 : 2);
    EXPECT_GT(device_.calls, device_.made) << "the start repeats a call to allocate memory";
    EXPECT_EQ(collider->device_failure(), "");
  }
}

TEST_F(AutomaticCollider, IsDestroyedWhileTheDeviceStarts) {
  device_.when_made = [] { std::this_thread::sleep_for(std::chrono::milliseconds(20)); };
  {
    const auto collider = make(device_pays_soon());
    const auto spheres = make_gas(300, 1, 3, random_);
    for (int i = 0; i < 3; ++i) collider->find_contacts(spheres);
    EXPECT_EQ(collider->backend(), Backend::cpu);
  }
  EXPECT_EQ(device_.alive, 0);
  EXPECT_GE(device_.made, 1);
}

/// Starts the GPU, if there is one, and ends the process.
[[noreturn]] void exit_while_the_device_starts(bool destroy) {
  SphereColliderOptions options;
  options.costs.cuda_start_ms = 1e-6;
  auto collider = make_sphere_collider(options);
  Random random(1);
  const auto spheres = make_gas(20000, 1, 3, random);
  for (int i = 0; i < 3; ++i) collider->find_contacts(spheres);
  if (!destroy) static_cast<void>(collider.release());
  collider.reset();
  std::exit(0);
}

TEST(AutomaticColliderDeathTest, TheProcessMayExitWhileTheDeviceStarts) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";  // CUDA does not survive a fork
  for (const bool destroy : {false, true}) {
    EXPECT_EXIT(exit_while_the_device_starts(destroy), testing::ExitedWithCode(0), "");
  }
}

TEST_F(AutomaticCollider, AFailureWhileTheDeviceStartsIsReportedOnce) {
  for (const bool when_made : {false, true}) {
    for (const std::string failure : {"", "the device is gone"}) {
      device_ = {};
      (when_made ? device_.when_made : device_.before_call) = [&failure] {
        if (failure.empty()) throw BackendUnavailable("cuda: no CUDA driver is installed");
        throw DeviceError(failure);
      };
      SphereColliderOptions options = device_pays_soon();
      const auto collider = make(options);
      const auto spheres = make_gas(300, 1, 3, random_);
      std::string reported;
      for (int i = 0; i < 300; ++i) {
        ASSERT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres)));
        reported += collider->device_failure();
        EXPECT_EQ(collider->backend(), Backend::cpu);
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
      EXPECT_EQ(reported, failure);
      EXPECT_EQ(collider->reason() == ChoiceReason::device_failed, !failure.empty());
      EXPECT_EQ(device_.made, 1);
      EXPECT_EQ(device_.alive, 0);
    }
  }
}

TEST_F(AutomaticCollider, InvalidInputWhileTheDeviceStartsIsNotItsFailure) {
  const auto collider = make(device_pays_soon());
  auto spheres = make_gas(300, 1, 3, random_);
  collider->find_contacts(spheres);
  spheres[7].radius = -1;
  EXPECT_THROW(collider->find_contacts(spheres), InvalidArgument) << "and starts the device";
  spheres[7].radius = 1;
  call_until_cuda(*collider, spheres);
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
  for (const auto algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
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
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::grid);
  collider->find_contacts(few);
  EXPECT_EQ(collider->algorithm(), SphereAlgorithm::all_pairs);
}

TEST_F(AutomaticCollider, AFailureInOneKindOfCallIsNotReportedByTheNextOfTheOther) {
  SphereColliderOptions options = device_wins();
  options.costs.cpu_all_pairs = {};  // searches use the CPU; one decision covers many of them
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
    options.costs.cpu_given_pairs.pair_ns = bad;
    try {
      make_sphere_collider(options);
      FAIL();
    } catch (const InvalidArgument& error) {
      EXPECT_NE(std::string(error.what()).find("cpu_given_pairs.pair_ns"), std::string::npos)
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
