/// What the CUDA collider does when the device or the memory is not there, or goes.
#include <jfpx/error.hpp>

#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

TEST(CudaBackend, WithoutADeviceItIsUnavailableAndSaysWhy) {
  const BackendStatus status = probe();
  if (status.usable) GTEST_SKIP() << "there is a device: " << status.device;
  EXPECT_FALSE(status.reason.empty());
  EXPECT_TRUE(status.compiled);
  try {
    make_sphere_collider({.backend = Backend::cuda});
    ADD_FAILURE() << "BackendUnavailable was not thrown";
  } catch (const BackendUnavailable& e) {
    EXPECT_EQ(std::string(e.what()), "cuda: " + status.reason);
  }
  EXPECT_THROW(DeviceSphereCollider(nullptr), BackendUnavailable);
  EXPECT_EQ(make_sphere_collider({})->backend(), Backend::cpu);
}

TEST(CudaBackend, HeadersOfAnotherBuildAreRefusedBeforeTheDeviceIsAsked) {
  const Build other{detail::pack_build(JFPX_VERSION_MAJOR, JFPX_VERSION_MINOR + 1, sizeof(Real),
                                       sizeof(detail::LayoutProbe))};
  EXPECT_THROW(DeviceSphereCollider(nullptr, 0, SphereAlgorithm::automatic, other), BuildMismatch);
}

TEST(CudaBackend, ADeviceThatIsNotThereIsUnavailable) {
  EXPECT_FALSE(probe(1000).usable);
  EXPECT_FALSE(probe(-1).usable);
  EXPECT_THROW(make_sphere_collider({.backend = Backend::cuda, .device = 1000}),
               BackendUnavailable);
}

TEST(CudaBackend, ADriverThatIsMissingOrTooOldIsNamed) {
  EXPECT_EQ(why_unusable(cudaErrorNoDevice, 13000, 13000), "the CUDA driver sees no GPU");
  EXPECT_EQ(why_unusable(cudaErrorInsufficientDriver, 0, 13000), "no CUDA driver is installed");
  EXPECT_EQ(why_unusable(cudaErrorInsufficientDriver, 12090, 13000),
            "the CUDA driver is too old: it supports CUDA 12.9, this build needs 13.0");
  EXPECT_EQ(why_unusable(cudaErrorECCUncorrectable, 13000, 13000).find("cudaErrorECCUncorrectable"),
            0u);
}

/// Fails every CUDA call of `work` in turn, until it makes fewer calls than that.
template <typename Work>
void with_every_call_failing(cudaError_t error, Work&& work) {
  for (long call = 0; call < 500; ++call) {
    inject_fault(call, error);
    bool threw = false;
    try {
      work();
    } catch (const DeviceError& e) {
      threw = true;
      EXPECT_NE(std::string(e.what()).find(cudaGetErrorName(error)), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("/cuda/"), std::string::npos) << e.what();
    } catch (const OutOfMemory& e) {
      threw = true;
      EXPECT_NE(std::string(e.what()).find(" bytes of "), std::string::npos) << e.what();
    }
    const bool reached = take_injected_fault() == cudaSuccess && threw;
    inject_fault(-1, cudaSuccess);
    if (!reached) return;
  }
  ADD_FAILURE() << "more than 500 CUDA calls";
}

TEST_F(Cuda, AnyFailingCallIsAnErrorAndTheColliderGoesOn) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(3000, random);
  const auto expected = brute_force(spheres);
  const std::vector<SpherePair> pairs(100, {1, 2});
  for (const cudaError_t error : {cudaErrorMemoryAllocation, cudaErrorLaunchOutOfResources}) {
    for (const SphereAlgorithm algorithm :
         {SphereAlgorithm::automatic, SphereAlgorithm::sorted_tiles}) {
      std::unique_ptr<SphereCollider> collider;
      with_every_call_failing(error, [&] {
        collider = make(algorithm);  // anew each time: what grows, grows under the fault
        collider->find_contacts(spheres);
        collider->test_pairs(spheres, pairs);
        collider->find_touching(spheres, pairs);
      });
      const auto survivor = make(algorithm);
      with_every_call_failing(error, [&] { survivor->find_contacts(spheres); });
      const auto touching = survivor->find_touching(spheres, pairs).size();
      with_every_call_failing(error, [&] { survivor->find_touching(spheres, pairs); });
      EXPECT_EQ(survivor->find_touching(spheres, pairs).size(), touching);
      EXPECT_TRUE(same_bits(survivor->find_contacts(spheres), expected)) << seed_note();
      EXPECT_EQ(survivor->test_pairs(spheres, pairs).size(), pairs.size());
    }
  }
}

TEST_F(Cuda, NothingLeaksWhetherItFailsOrNot) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(30'000, random);
  const auto use = [&] { make()->find_contacts(spheres); };
  use();
  const std::size_t before = free_bytes();
  for (int i = 0; i < 10; ++i) use();
  with_every_call_failing(cudaErrorMemoryAllocation, use);
  EXPECT_EQ(free_bytes(), before);
}

TEST_F(Cuda, WarmCallsTakeNoMemory) {
  Random random(base_seed());
  const auto collider = make();
  const auto spheres = sphere_kind("uniform").make(30'000, random);
  for (int i = 0; i < 3; ++i) collider->find_contacts(spheres);
  const std::size_t before = free_bytes();
  for (int i = 0; i < 5; ++i) {
    collider->find_contacts(sphere_kind("uniform").make(29'000 + random.below(1000), random));
  }
  EXPECT_EQ(free_bytes(), before);
}

// Memory is taken away for real: all of it but less than a search needs.
TEST_F(Cuda, WithoutDeviceMemoryASearchNamesTheBytesAndTheColliderGoesOn) {
  constexpr std::size_t kLeft = std::size_t{256} << 20;
  Random random(base_seed());
  const auto few = sphere_kind("uniform").make(3000, random);
  const std::vector<SphereInstance> many(4'000'000, {{1, 2, 3}, 1});
  const auto expected = brute_force(few);
  const auto collider = make();
  collider->find_contacts(few);
  const std::size_t before = free_bytes();
  {
    MemoryPool pool(0);
    OwnedStream stream(0);
    const DeviceMemory rest(pool, stream.get(), before - kLeft, "all there is");
    ASSERT_LE(free_bytes(), kLeft);
    for (int i = 0; i < 2; ++i) {
      try {
        collider->find_contacts(many);
        ADD_FAILURE() << "OutOfMemory was not thrown";
      } catch (const OutOfMemory& e) {
        EXPECT_NE(std::string(e.what()).find(" bytes of "), std::string::npos) << e.what();
        EXPECT_NE(std::string(e.what()).find("/cuda/"), std::string::npos) << e.what();
      }
      EXPECT_TRUE(same_bits(collider->find_contacts(few), expected)) << seed_note();
    }
  }
  EXPECT_TRUE(same_bits(collider->find_contacts(few), expected)) << seed_note();
}

/// In a process of its own: a kernel that reads where nothing is takes the device from the process.
/// Exits with 0 if everything is refused with a reason and can still be destroyed.
[[noreturn]] void lose_the_device() {
  const auto check = [](bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "not so: %s\n", what);
    std::exit(1);
  };
  {
    const Spheres spheres = make_lattice(12, Real(1.9));
    const std::vector<SpherePair> pairs(10, {0, 1});
    auto collider = make_sphere_collider({.backend = Backend::cuda});
    auto grid = make_sphere_collider(
        {.backend = Backend::cuda, .algorithm = SphereAlgorithm::sorted_tiles});
    check(collider->find_contacts(spheres).size() == 3 * 12 * 12 * 11, "it works before");
    check(grid->find_contacts(spheres).size() == 3 * 12 * 12 * 11, "the grid works before");
    {
      DeviceData data(spheres, 10'000);
      DeviceSphereCollider misled(data.stream.get());
      misled.reserve(spheres.size(), 10'000);
      misled.find_contacts(reinterpret_cast<const SphereInstance*>(64), spheres.size(),
                           data.contacts.data(), 10'000, data.count.data());
    }
    const auto is_refused = [&](auto&& call) {
      try {
        call();
      } catch (const DeviceError& e) {
        const std::string what = e.what();
        return what.find("cudaErrorIllegalAddress") != std::string::npos &&
               what.find("/cuda/") != std::string::npos;
      }
      return false;
    };
    for (int i = 0; i < 2; ++i) {
      check(is_refused([&] { collider->find_contacts(spheres); }), "find_contacts is refused");
      check(is_refused([&] { grid->find_contacts(spheres); }), "the grid is refused");
      check(is_refused([&] { collider->test_pairs(spheres, pairs); }), "test_pairs is refused");
    }
    const BackendStatus status = probe();
    check(!status.usable && !status.reason.empty(), "the backend says that it is not usable");
    try {
      make_sphere_collider({.backend = Backend::cuda});
      check(false, "no new collider can be made");
    } catch (const BackendUnavailable&) {
    } catch (const DeviceError&) {
    }
  }
  std::exit(0);
}

TEST_F(Cuda, ALostDeviceIsAnErrorOfEveryCallAndEverythingCanBeDestroyed) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(lose_the_device(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
