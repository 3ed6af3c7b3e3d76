/// What only the CUDA collider promises: streams, graphs, faults, memory, threads.
#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/error.hpp>

#include "src/cuda/device_buffer.hpp"
#include "src/cuda/probe_cuda.hpp"
#include "src/shared/sphere_pair.hpp"
#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <thread>

namespace jfpx::inline JFPX_ABI::test {
namespace {

using namespace cuda;
using Spheres = std::vector<SphereInstance>;

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
  EXPECT_EQ(make_sphere_collider({})->backend(), Backend::x86);
}

TEST(CudaBackend, ADeviceThatIsNotThereIsUnavailable) {
  EXPECT_FALSE(probe(1000).usable);
  EXPECT_FALSE(probe(-1).usable);
  EXPECT_THROW(make_sphere_collider({.backend = Backend::cuda, .device = 1000}),
               BackendUnavailable);
}

/// Tests that need a device: skipped without one, failed if the environment insists.
class Cuda : public testing::Test {
 protected:
  void SetUp() override {
    const BackendStatus status = probe();
    usable_ = status.usable;
    if (usable_) return;
    if (std::getenv("JFPX_REQUIRE_CUDA") != nullptr) FAIL() << status.reason;
    GTEST_SKIP() << status.reason;
  }
  void TearDown() override {
    inject_fault(-1, cudaSuccess);
    if (usable_) {
      EXPECT_EQ(cudaGetLastError(), cudaSuccess) << "an error was left behind";
    }
  }

  static std::unique_ptr<SphereCollider> make(
      SphereAlgorithm algorithm = SphereAlgorithm::automatic) {
    return make_sphere_collider({.backend = Backend::cuda, .algorithm = algorithm});
  }
  static std::size_t free_bytes() {
    std::size_t free = 0, total = 0;
    JFPX_CUDA_TRY(cudaDeviceSynchronize());
    JFPX_CUDA_TRY(cudaMemGetInfo(&free, &total));
    return free;
  }

 private:
  bool usable_ = false;
};

/// Input and output of a search on a stream.
struct DeviceData {
  explicit DeviceData(const Spheres& input, std::size_t capacity) : stream(0), pool(0) {
    spheres.grow(pool, stream.get(), input.size() + 1, "spheres");
    contacts.grow(pool, stream.get(), capacity + 1, "contacts");
    count.grow(1, "count");
    upload(input);
  }
  ~DeviceData() { static_cast<void>(cudaStreamSynchronize(stream.get())); }
  void upload(const Spheres& input) {
    JFPX_CUDA_TRY(cudaMemcpyAsync(spheres.data(), input.data(),
                                  input.size() * sizeof(SphereInstance), cudaMemcpyHostToDevice,
                                  stream.get()));
  }
  void wait() const { JFPX_CUDA_TRY(cudaStreamSynchronize(stream.get())); }
  template <typename T>
  std::vector<T> download(const T* from, std::size_t n) const {
    std::vector<T> to(n);
    JFPX_CUDA_TRY(
        cudaMemcpyAsync(to.data(), from, n * sizeof(T), cudaMemcpyDeviceToHost, stream.get()));
    wait();
    return to;
  }

  OwnedStream stream;
  MemoryPool pool;
  DeviceBuffer<SphereInstance> spheres;
  DeviceBuffer<SphereContact> contacts;
  PinnedBuffer<ContactCount> count;
};

constexpr SphereAlgorithm kAlgorithms[] = {SphereAlgorithm::all_pairs,
                                           SphereAlgorithm::sorted_tiles};

// Tile, block, warp and buffer boundaries: 256 rows a tile, 32 bits a word, the largest N of one
// launch and of mapped output.
TEST_F(Cuda, EqualsBruteForceAroundEveryBoundary) {
  Random random(base_seed());
  for (const SphereAlgorithm algorithm :
       {SphereAlgorithm::automatic, SphereAlgorithm::all_pairs, SphereAlgorithm::sorted_tiles}) {
    const auto collider = make(algorithm);
    for (const std::size_t edge : {32, 128, 256, 512, 768, 1024, 2048, 2304, 4096}) {
      for (const std::size_t n : {edge - 1, edge, edge + 1}) {
        const auto spheres = sphere_kind("uniform").make(n, random);
        ASSERT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres)))
            << "N = " << n << ", " << seed_note();
      }
    }
  }
}

TEST_F(Cuda, BothAlgorithmsAgreeOnLargeSets) {
  const auto all_pairs = make(SphereAlgorithm::all_pairs);
  const auto grid = make(SphereAlgorithm::sorted_tiles);
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed());
    const auto spheres = kind.make(30'000 + random.below(5'000), random);
    const ContactSpan a = all_pairs->find_contacts(spheres);
    ASSERT_TRUE(same_bits(grid->find_contacts(spheres), a)) << kind.name << ", " << seed_note();
  }
}

// 70 000 spheres need more than one band of the bit matrix.
TEST_F(Cuda, AllPairsInBandsAgreesWithTheGrid) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(70'000, random);
  const auto all_pairs = make(SphereAlgorithm::all_pairs);
  const auto grid = make(SphereAlgorithm::sorted_tiles);
  EXPECT_TRUE(same_bits(grid->find_contacts(spheres), all_pairs->find_contacts(spheres)))
      << seed_note();
}

// One sphere over 100 000 others: its list is as long as there are spheres. With index 0 it is a in
// all of its pairs, with the last index b.
TEST_F(Cuda, AGiantTouchesEverySphere) {
  for (const std::size_t giant : {std::size_t{0}, std::size_t{55'555}, std::size_t{99'999}}) {
    Random random(base_seed());
    auto spheres = make_gas(100'000, Real(0.5), 1, random);
    spheres[giant] = {{0, 0, 0}, 10'000};
    const auto collider = make();
    const ContactSpan contacts = collider->find_contacts(spheres);
    std::size_t found = 0;
    for (const SphereContact& c : contacts) found += c.a == giant || c.b == giant ? 1 : 0;
    EXPECT_EQ(found, spheres.size() - 1) << giant;
    EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(), [](const auto& p, const auto& q) {
      return std::pair(p.a, p.b) < std::pair(q.a, q.b);
    }));
  }
}

TEST_F(Cuda, TwentyRepeatsGiveTheSameBits) {
  Random random(base_seed());
  const auto spheres = sphere_kind("polydisperse").make(50'000, random);
  const auto collider = make(SphereAlgorithm::sorted_tiles);
  const ContactSpan span = collider->find_contacts(spheres);
  const std::vector<SphereContact> first(span.begin(), span.end());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(same_bits(collider->find_contacts(spheres), first)) << "repeat " << i;
  }
}

// What the promise of equal bits stands on: pairs of all magnitudes, near and far, on both sides.
TEST_F(Cuda, AThousandMillionPairsHaveTheBitsOfX86) {
  constexpr std::size_t kSpheres = 1 << 20, kPairs = 1 << 24, kRounds = 60;
  const unsigned threads = std::max(1u, std::thread::hardware_concurrency());
  const auto collider = make();
  std::size_t touching = 0;
  for (std::size_t round = 0; round < kRounds; ++round) {
    Random random(base_seed() + round);
    const auto kinds = sphere_kinds();
    const auto spheres = kinds[round % kinds.size()].make(kSpheres, random);
    std::vector<SpherePair> pairs(kPairs);
    std::vector<PairResult> expected(kPairs);
    const auto work = [&](std::size_t first, std::size_t past) {
      Random mine(base_seed() + round * 1000 + first);
      for (std::size_t i = first; i < past; ++i) {
        const auto a = static_cast<SphereIndex>(mine.below(kSpheres));
        const auto b = static_cast<SphereIndex>((a + mine.below(60)) % kSpheres);
        pairs[i] = {a, mine.below(2) == 0 ? b : static_cast<SphereIndex>(mine.below(kSpheres))};
        expected[i] = shared::test_sphere_pair(spheres[pairs[i].a], spheres[pairs[i].b]);
      }
    };
    std::vector<std::jthread> workers;
    for (unsigned t = 0; t < threads; ++t) {
      workers.emplace_back(work, kPairs * t / threads, kPairs * (t + 1) / threads);
    }
    workers.clear();
    const auto results = collider->test_pairs(spheres, pairs);
    ASSERT_TRUE(same_bits(results, expected)) << "round " << round << ", " << seed_note();
    for (const PairResult& r : expected) touching += r.touching;
  }
  EXPECT_GT(touching, kPairs / 10) << "the test must meet touching pairs";
}

TEST_F(Cuda, ASearchOnAStreamLeavesContactsOnTheDevice) {
  for (const SphereAlgorithm algorithm : kAlgorithms) {
    for (const std::size_t n : {0, 1, 500, 3000}) {
      Random random(base_seed());
      const auto spheres = sphere_kind("uniform").make(n, random);
      const auto expected = brute_force(spheres);
      DeviceData data(spheres, expected.size());
      DeviceSphereCollider collider(data.stream.get(), 0, algorithm);
      collider.reserve(n, expected.size());
      collider.find_contacts(data.spheres.data(), n, data.contacts.data(), expected.size(),
                             data.count.data());
      data.wait();
      ASSERT_EQ(data.count.data()->contacts, expected.size()) << seed_note();
      ASSERT_EQ(data.count.data()->complete, 1u);
      ASSERT_TRUE(same_bits(data.download(data.contacts.data(), expected.size()), expected));

      auto* d_pairs = reinterpret_cast<SpherePair*>(data.contacts.data());
      collider.find_pairs(data.spheres.data(), n, d_pairs, expected.size(), data.count.data());
      const auto pairs = data.download(d_pairs, expected.size());
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        ASSERT_EQ(pairs[i], (SpherePair{expected[i].a, expected[i].b})) << seed_note();
      }
    }
  }
}

TEST_F(Cuda, TooLittleRoomIsCountedExactlyAndNothingIsWritten) {
  for (const SphereAlgorithm algorithm : kAlgorithms) {
    for (const std::size_t n : {700, 3000}) {
      Random random(base_seed());
      const auto spheres = sphere_kind("uniform").make(n, random);
      const auto expected = brute_force(spheres);
      DeviceData data(spheres, expected.size());
      const SphereContact canary{7, 8, {1, 2, 3}, 4};
      const std::vector<SphereContact> untouched(expected.size() + 1, canary);
      JFPX_CUDA_TRY(cudaMemcpyAsync(data.contacts.data(), untouched.data(),
                                    untouched.size() * sizeof(SphereContact),
                                    cudaMemcpyHostToDevice, data.stream.get()));
      DeviceSphereCollider collider(data.stream.get(), 0, algorithm);
      const std::size_t room = expected.size() - 1;
      collider.reserve(n, room);
      collider.find_contacts(data.spheres.data(), n, data.contacts.data(), room, data.count.data());
      data.wait();
      EXPECT_EQ(data.count.data()->contacts, expected.size()) << seed_note();
      EXPECT_EQ(data.count.data()->complete, 0u);
      EXPECT_TRUE(same_bits(data.download(data.contacts.data(), untouched.size()), untouched));

      collider.reserve(n, expected.size());
      collider.find_contacts(data.spheres.data(), n, data.contacts.data(), expected.size(),
                             data.count.data());
      auto with_canary = expected;
      with_canary.push_back(canary);
      EXPECT_TRUE(same_bits(data.download(data.contacts.data(), with_canary.size()), with_canary))
          << "nothing may be written past the end";
    }
  }
}

TEST_F(Cuda, ASearchCanBeCapturedAndReplayedOnNewInput) {
  for (const SphereAlgorithm algorithm : kAlgorithms) {
    constexpr std::size_t kN = 2500;
    Random random(base_seed());
    DeviceData data(sphere_kind("uniform").make(kN, random), 10 * kN);
    DeviceSphereCollider collider(data.stream.get(), 0, algorithm);
    collider.reserve(kN, 10 * kN);
    cudaGraph_t graph = nullptr;
    cudaGraphExec_t search = nullptr;
    JFPX_CUDA_TRY(cudaStreamBeginCapture(data.stream.get(), cudaStreamCaptureModeGlobal));
    collider.find_contacts(data.spheres.data(), kN, data.contacts.data(), 10 * kN,
                           data.count.data());
    JFPX_CUDA_TRY(cudaStreamEndCapture(data.stream.get(), &graph));
    JFPX_CUDA_TRY(cudaGraphInstantiate(&search, graph, 0));
    for (int i = 0; i < 5; ++i) {
      const auto spheres = sphere_kind("uniform").make(kN, random);
      const auto expected = brute_force(spheres);
      data.upload(spheres);
      JFPX_CUDA_TRY(cudaGraphLaunch(search, data.stream.get()));
      data.wait();
      ASSERT_EQ(data.count.data()->contacts, expected.size()) << seed_note();
      ASSERT_TRUE(same_bits(data.download(data.contacts.data(), expected.size()), expected));
    }
    JFPX_CUDA_TRY(cudaGraphExecDestroy(search));
    JFPX_CUDA_TRY(cudaGraphDestroy(graph));
  }
}

TEST_F(Cuda, MoreSpheresThanReservedAreRejected) {
  DeviceData data({}, 1);
  DeviceSphereCollider collider(data.stream.get());
  collider.reserve(10, 10);
  EXPECT_THROW(
      collider.find_contacts(data.spheres.data(), 11, data.contacts.data(), 1, data.count.data()),
      InvalidArgument);
}

TEST_F(Cuda, AnInvalidSphereOnTheDeviceIsNamed) {
  for (const SphereAlgorithm algorithm : kAlgorithms) {
    for (const std::size_t n : {500, 3000}) {
      Random random(base_seed());
      auto spheres = sphere_kind("uniform").make(n, random);
      spheres[333].centre.z = std::numeric_limits<Real>::infinity();
      spheres[400].radius = 0;
      DeviceData data(spheres, 100 * n);
      DeviceSphereCollider collider(data.stream.get(), 0, algorithm);
      collider.reserve(n, 100 * n);
      collider.find_contacts(data.spheres.data(), n, data.contacts.data(), 100 * n,
                             data.count.data());
      data.wait();
      EXPECT_EQ(data.count.data()->first_invalid, 333u);
      EXPECT_EQ(data.count.data()->complete, 0u);
      EXPECT_EQ(data.count.data()->contacts, 0u);
    }
  }
}

TEST_F(Cuda, CollidersInSeveralThreadsAreIndependent) {
  std::vector<std::jthread> workers;
  for (std::uint64_t t = 0; t < 4; ++t) {
    workers.emplace_back([t] {
      Random random(base_seed() + t);
      const auto collider = make(kAlgorithms[t % 2]);
      for (int i = 0; i < 20; ++i) {
        const auto spheres = sphere_kind("clusters").make(200 + random.below(1500), random);
        ASSERT_TRUE(same_bits(collider->find_contacts(spheres), brute_force(spheres)))
            << seed_note();
      }
    });
  }
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
      EXPECT_NE(std::string(e.what()).find("src/cuda/"), std::string::npos) << e.what();
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
      });
      const auto survivor = make(algorithm);
      with_every_call_failing(error, [&] { survivor->find_contacts(spheres); });
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

}  // namespace
}  // namespace jfpx::inline JFPX_ABI::test
