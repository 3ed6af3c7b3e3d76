/// Behaviour of the CUDA collider when the device or memory is missing or lost.
#include <jfpx/error.hpp>
#include <jfpx/periodic.hpp>

#include "tests/sphere_collider/cuda/device_arrays.hpp"

#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

TEST(CudaBackend, WithoutADeviceItIsUnavailableWithAReason) {
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

/// Runs `work` repeatedly: in run k, its CUDA call number k fails. Ends when `work` makes fewer
/// calls.
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
    for (const SphereAlgorithm algorithm : {SphereAlgorithm::automatic, SphereAlgorithm::grid}) {
      std::unique_ptr<SphereCollider> collider;
      with_every_call_failing(error, [&] {
        collider = make(algorithm);  // a new one, so that buffers grow while a call fails
        collider->find_contacts(spheres);
        collider->find_touching(spheres, pairs);
      });
      const auto survivor = make(algorithm);
      with_every_call_failing(error, [&] { survivor->find_contacts(spheres); });
      const auto touching = survivor->find_touching(spheres, pairs).size();
      with_every_call_failing(error, [&] { survivor->find_touching(spheres, pairs); });
      EXPECT_EQ(survivor->find_touching(spheres, pairs).size(), touching);
      EXPECT_TRUE(same_bits(survivor->find_contacts(spheres), expected)) << seed_note();
    }
  }
}

TEST_F(Cuda, AnyFailingCallOfASearchOnArraysIsAnErrorAndTheColliderGoesOn) {
  Random random(base_seed());
  const OwnedStream stream(0);
  const Spheres spheres = make_gas(3000, Real(0.5), 6, random);
  const DeviceSpheres arrays(spheres);
  const PeriodicCell cell{{9, 9, 9}};
  const std::vector<std::uint64_t> offsets{0, 1000, 3000};
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto search = [&](ArrayCollider& collider) {
    const DeviceArray<std::int64_t> indices(2 * 100'000);
    EXPECT_LT(collider.find_pairs(arrays.arrays(), indices.data(), 100'000, stream.get()),
              100'000u);
    collider.find_periodic_in_systems(arrays.arrays(), offsets, std::vector{cell, cell},
                                      ArrayResult::pairs, false, stream.get());
    return collider.find_periodic(arrays.arrays(), cell, ArrayResult::contacts, true, stream.get());
  };
  const std::size_t expected = 2 * find_periodic_contacts(*cpu, spheres, cell).size();
  for (const cudaError_t error : {cudaErrorMemoryAllocation, cudaErrorLaunchOutOfResources}) {
    with_every_call_failing(error, [&] {
      ArrayCollider collider;  // a new one, so that buffers grow while a call fails
      search(collider);
    });
    ArrayCollider survivor;
    with_every_call_failing(error, [&] { search(survivor); });
    EXPECT_EQ(search(survivor), expected) << seed_note();
  }
}

TEST_F(Cuda, AFailingTestOfPairsOnAStreamIsAnError) {
  const auto spheres = make_lattice(2, Real(1.9));
  DeviceData data(spheres, 0);
  DeviceBuffer<SpherePair> pairs;
  DeviceBuffer<PairResult> results;
  pairs.reserve(data.pool, data.stream.get(), 1, "pairs");
  results.reserve(data.pool, data.stream.get(), 1, "results");
  const SpherePair pair{0, 1};
  JFPX_CUDA_TRY(
      cudaMemcpyAsync(pairs.data(), &pair, sizeof pair, cudaMemcpyHostToDevice, data.stream.get()));
  DeviceSphereCollider collider(data.stream.get());
  with_every_call_failing(cudaErrorLaunchOutOfResources, [&] {
    collider.test_pairs(data.spheres.data(), pairs.data(), 1, results.data());
  });
  EXPECT_EQ(data.download(results.data(), 1)[0].touching, 1u);
}

// The copies of a list in device memory and in pinned memory grow one after the other. If the
// second allocation fails, the next call must still grow the second copy.
TEST_F(Cuda, AFailedCallForAPairListLeavesTheColliderUsable) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(3000, random);
  std::vector<SpherePair> pairs(20'000);
  for (SpherePair& p : pairs) {
    p = {static_cast<SphereIndex>(random.below(3000)),
         static_cast<SphereIndex>(random.below(3000))};
  }
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto expected = cpu->find_touching(spheres, pairs);
  const std::vector<SpherePair> few(10, {1, 2});
  for (long call = 0; call < 100; ++call) {
    const auto collider = make();
    collider->find_touching(std::span(spheres).first(10), few);
    inject_fault(call, cudaErrorMemoryAllocation);
    bool threw = false;
    try {
      collider->find_touching(spheres, pairs);
    } catch (const Error&) {
      threw = true;
    }
    inject_fault(-1, cudaSuccess);
    ASSERT_TRUE(same_bits(collider->find_touching(spheres, pairs), expected))
        << "call " << call << ", " << seed_note();
    if (!threw) return;
  }
  ADD_FAILURE() << "more than 100 CUDA calls";
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

// Buffers have slack. A size that grows by one element per call must use it, instead of a
// reallocation per call. A reallocated buffer has another address, because the old one is freed
// last.
TEST_F(Cuda, SlowlyGrowingCallsReallocateSeldom) {
  const auto spheres = make_lattice(30, Real(1.9));
  const auto collider = make();
  const void* last[2] = {};
  int reallocations[2] = {};
  const auto note = [&](int which, const void* data) {
    if (data == last[which]) return;
    last[which] = data;
    ++reallocations[which];
  };
  std::vector<SpherePair> pairs;
  for (SphereIndex i = 0; i < 1200; ++i) {
    pairs.push_back({i, i + 1});
    if (i < 1000) continue;
    note(0, collider->find_touching(spheres, pairs).data());
    const std::size_t n = 21'000 + 20 * (i - 1000);  // contacts are copied, not mapped
    note(1, collider->find_contacts(std::span(spheres).first(n)).data());
  }
  EXPECT_EQ(reallocations[0], 1) << "find_touching";
  EXPECT_EQ(reallocations[1], 1) << "find_contacts";
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

// The test allocates all device memory except for less than a search needs.
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

/// Runs in a separate process: after a kernel reads an invalid address, the process cannot use the
/// device any more. Exits with 0 if every call throws and every object can still be destroyed.
[[noreturn]] void lose_the_device() {
  const auto check = [](bool holds, const char* what) {
    if (holds) return;
    std::fprintf(stderr, "check failed: %s\n", what);
    std::exit(1);
  };
  {
    const Spheres spheres = make_lattice(12, Real(1.9));
    const std::vector<SpherePair> pairs(10, {0, 1});
    auto collider = make_sphere_collider({.backend = Backend::cuda});
    auto grid =
        make_sphere_collider({.backend = Backend::cuda, .algorithm = SphereAlgorithm::grid});
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
      check(is_refused([&] { collider->find_touching(spheres, pairs); }),
            "find_touching is refused");
    }
    const BackendStatus status = probe();
    check(!status.usable && !status.reason.empty(), "the backend reports that it is not usable");
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
