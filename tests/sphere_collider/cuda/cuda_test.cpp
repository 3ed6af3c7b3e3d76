/// Promises of the CUDA collider alone: streams, graphs, threads, any size.
#include <jfpx/error.hpp>

#include "src/collide/sphere_pair.hpp"
#include "src/sphere_collider/cuda/grid.hpp"
#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

#include <array>
#include <limits>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

constexpr SphereAlgorithm kAlgorithms[] = {SphereAlgorithm::all_pairs, SphereAlgorithm::grid};

// Boundaries of tiles, blocks, warps and buffers: 256 rows per tile, 32 bits per word, the largest
// N of one launch and of mapped output.
TEST_F(Cuda, EqualsBruteForceAroundEveryBoundary) {
  Random random(base_seed());
  for (const SphereAlgorithm algorithm :
       {SphereAlgorithm::automatic, SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
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
  const auto grid = make(SphereAlgorithm::grid);
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
  const auto grid = make(SphereAlgorithm::grid);
  EXPECT_TRUE(same_bits(grid->find_contacts(spheres), all_pairs->find_contacts(spheres)))
      << seed_note();
}

// Up to kMaxDirect spheres of similar radius are not sorted, unless a cell has too few slots for
// its spheres or a block too few for its pairs, which the kernel detects on the way. The reference
// is the CPU.
TEST_F(Cuda, SearchesWithoutSortingEqualX86) {
  const auto cpu = make_sphere_collider({.backend = Backend::cpu, .threads = 0});
  const auto collider = make(SphereAlgorithm::grid);
  Random random(base_seed());
  const auto check = [&](const Spheres& spheres, const char* what) {
    for (int repeat = 0; repeat < 2; ++repeat) {
      ASSERT_TRUE(same_bits(collider->find_contacts(spheres), cpu->find_contacts(spheres)))
          << what << ", N = " << spheres.size() << ", " << seed_note();
    }
  };
  for (const std::size_t n : {10'000u, kMaxDirect - 1, kMaxDirect, kMaxDirect + 1, 100'000u}) {
    check(make_gas(n, Real(0.5), 3, random), "gas");
  }
  auto clustered = make_gas(20'000, Real(0.5), 3, random);
  for (std::size_t i = 0; i < 40; ++i) clustered[500 * i].centre = clustered[7].centre;
  check(clustered, "a cell with too few slots");
  // Eight spheres a cell, each in contact with 32: the first 45 have nearly all of these as b.
  auto dense = make_lattice(28, Real(0.5));
  for (SphereInstance& s : dense) s.radius = Real(0.5);
  for (std::size_t i = dense.size(); i > 1; --i) std::swap(dense[i - 1], dense[random.below(i)]);
  check(dense, "a block with too few slots");
  check(make_gas(10'000, Real(0.5), 3, random), "gas again");
  auto wide = make_gas(20'000, Real(0.5), 3, random);
  for (SphereInstance& s : wide) s.radius *= random.uniform(Real(0.4), 1);
  check(wide, "radii that differ by more than two");
}

// For more than 2^18 spheres each phase of the grid search is a launch. The reference is the CPU.
TEST_F(Cuda, SearchesOfManyLaunchesEqualX86) {
  constexpr std::size_t kEdge = 1 << 18;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu, .threads = 0});
  const auto collider = make();
  for (const std::string_view name :
       {"uniform", "lattice", "line", "plane", "polydisperse", "far", "outliers", "touching"}) {
    Random random(base_seed());
    const std::size_t n = kEdge - 1 + random.below(3) + random.below(2) * random.below(50'000);
    const auto spheres = sphere_kind(name).make(n, random);
    ASSERT_TRUE(same_bits(collider->find_contacts(spheres), cpu->find_contacts(spheres)))
        << name << ", N = " << n << ", " << seed_note();
  }
}

// A dense cluster in a corner of a gas: more spheres than one block sorts in shared memory, and
// rows of all lengths for spheres of one level.
TEST_F(Cuda, SearchesOfManyLaunchesHandleDenseClusters) {
  const auto cpu = make_sphere_collider({.backend = Backend::cpu, .threads = 0});
  const auto collider = make();
  Random random(base_seed());
  for (const std::size_t cluster : {1'000, 5'000}) {
    auto spheres = make_gas(280'000, Real(0.5), 3, random);
    for (std::size_t i = 0; i < cluster; ++i) spheres[53 * i].centre *= Real(0.03);
    ASSERT_TRUE(same_bits(collider->find_contacts(spheres), cpu->find_contacts(spheres)))
        << cluster << ", " << seed_note();
  }
}

TEST_F(Cuda, SearchesOfManyLaunchesNameBadSpheresAndGrowTheirBuffers) {
  constexpr std::size_t kN = 300'000;
  const auto collider = make();
  // 500 spheres in one place, between eight of a lattice whose spheres are apart; then groups of
  // 200 as well: far more contacts than were reserved.
  Spheres spheres = make_lattice(67, 3);
  spheres.resize(kN);
  const Vec3 between = spheres[0].centre + Vec3{1.5, 1.5, 1.5};
  for (std::size_t i = 0; i < 500; ++i) spheres[599 * i].centre = between;
  EXPECT_EQ(collider->find_contacts(spheres).size(), 500u * 499 / 2);
  for (std::size_t i = 0; i < kN; ++i) spheres[i].centre = spheres[i / 200 * 200].centre;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu, .threads = 0});
  const ContactSpan contacts = collider->find_contacts(spheres);
  EXPECT_GT(contacts.size(), 20'000'000u);
  EXPECT_TRUE(same_bits(contacts, cpu->find_contacts(spheres)));
  spheres[123'456].radius = -1;
  spheres[200'000].centre.x = std::numeric_limits<Real>::infinity();
  try {
    collider->find_contacts(spheres);
    ADD_FAILURE() << "InvalidArgument was not thrown";
  } catch (const InvalidArgument& e) {
    EXPECT_EQ(std::string(e.what()).find("sphere 123456: radius is -1"), 0u) << e.what();
  }
}

// One sphere contains 100 000 others: its row can have n - 1 contacts. With index 0 it is a in all
// of its pairs, with the last index b.
TEST_F(Cuda, ALargeSphereTouchesAllOthers) {
  for (const std::size_t large : {std::size_t{0}, std::size_t{55'555}, std::size_t{99'999}}) {
    Random random(base_seed());
    auto spheres = make_gas(100'000, Real(0.5), 1, random);
    spheres[large] = {{0, 0, 0}, 10'000};
    const auto collider = make();
    const ContactSpan contacts = collider->find_contacts(spheres);
    std::size_t found = 0;
    for (const SphereContact& c : contacts) found += c.a == large || c.b == large ? 1 : 0;
    EXPECT_EQ(found, spheres.size() - 1) << large;
    EXPECT_TRUE(std::is_sorted(contacts.begin(), contacts.end(), [](const auto& p, const auto& q) {
      return std::pair(p.a, p.b) < std::pair(q.a, q.b);
    }));
  }
}

TEST_F(Cuda, TwentyRepeatsGiveTheSameBits) {
  Random random(base_seed());
  const auto spheres = sphere_kind("polydisperse").make(50'000, random);
  const auto collider = make(SphereAlgorithm::grid);
  const ContactSpan span = collider->find_contacts(spheres);
  const std::vector<SphereContact> first(span.begin(), span.end());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(same_bits(collider->find_contacts(spheres), first)) << "repeat " << i;
  }
}

// Evidence for the promise of equal bits: pairs of all magnitudes, near and far, on both devices.
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
        expected[i] = detail::test_sphere_pair(spheres[pairs[i].a], spheres[pairs[i].b]);
      }
    };
    std::vector<std::jthread> workers;
    for (unsigned t = 0; t < threads; ++t) {
      workers.emplace_back(work, kPairs * t / threads, kPairs * (t + 1) / threads);
    }
    workers.clear();
    const auto found = collider->find_touching(spheres, pairs);
    ASSERT_TRUE(same_bits(found, touching_of(expected)))
        << "round " << round << ", " << seed_note();
    touching += found.size();
  }
  EXPECT_GT(touching, kPairs / 10) << "the test must cover touching pairs";
}

// Blocks of 4 KiB that differ from the previous list are uploaded, and touching pairs are
// downloaded: an unchanged list causes no upload.
TEST_F(Cuda, OnlyChangedBlocksOfAPairListAreUploaded) {
  Random random(base_seed());
  const auto collider = make();
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  auto spheres = sphere_kind("uniform").make(60'000, random);
  std::vector<SpherePair> pairs(300'000);
  for (SpherePair& p : pairs) {
    p = {static_cast<SphereIndex>(random.below(60'000)),
         static_cast<SphereIndex>(random.below(60'000))};
  }
  for (SphereIndex i = 0; i < 1000; ++i) pairs[300 * i] = {i, i};
  const auto find = [&] {
    const auto expected = cpu->find_touching(spheres, pairs);
    EXPECT_TRUE(same_bits(collider->find_touching(spheres, pairs), expected)) << seed_note();
    EXPECT_EQ(collider->transferred().from_device, expected.size() * sizeof(PairContact) + 8);
    return collider->transferred().to_device;
  };
  const std::size_t all =
      spheres.size() * sizeof(SphereInstance) + pairs.size() * sizeof(SpherePair);
  EXPECT_EQ(find(), all);
  EXPECT_EQ(find(), 0u);
  spheres[17].centre.x += 1;
  EXPECT_EQ(find(), 4096u);
  std::swap(pairs[100'000], pairs[200'000]);
  EXPECT_EQ(find(), 2 * 4096u);
  collider->find_contacts(spheres);
  EXPECT_EQ(find(), 0u) << "other calls use other buffers";
  pairs.resize(299'000);
  EXPECT_EQ(find(), 0u);
  pairs.resize(300'500, {5, 5});
  EXPECT_LE(find(), 1500 * sizeof(SpherePair) + 2 * 4096);
  spheres.resize(200'000, {{0, 0, 0}, 1});
  pairs.resize(900'000, {199'999, 199'998});
  EXPECT_EQ(find(), spheres.size() * sizeof(SphereInstance) + pairs.size() * sizeof(SpherePair));
  for (int round = 0; round < 20; ++round) {
    for (int k = 0; k < 50; ++k) {
      spheres[random.below(spheres.size())].centre.y += 1;
      pairs[random.below(pairs.size())].a = static_cast<SphereIndex>(random.below(spheres.size()));
    }
    find();
  }
}

TEST_F(Cuda, GivenPairsOnAStreamHaveTheBitsOfX86) {
  for (const SphereKind& kind : sphere_kinds()) {
    Random random(base_seed());
    for (const std::size_t m : {1, 255, 256, 257, 20'000}) {  // blocks have 256 threads
      const auto spheres = kind.make(400, random);
      std::vector<SpherePair> pairs(m);
      std::vector<PairResult> expected;
      for (SpherePair& p : pairs) {
        p = {static_cast<SphereIndex>(random.below(400)),
             static_cast<SphereIndex>(random.below(400))};
        expected.push_back(detail::test_sphere_pair(spheres[p.a], spheres[p.b]));
      }
      DeviceData data(spheres, 0);
      ASSERT_TRUE(same_bits(test_pairs(data, pairs), expected))
          << kind.name << ", " << m << " pairs, " << seed_note();
    }
  }
}

TEST_F(Cuda, GivenPairsOnAStreamTreatNaNAsBulletDoes) {
  constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
  const Spheres spheres = {{{0, 0, 0}, 1}, {{kNan, 0, 0}, 1}, {{0, 0, 0}, kNan}, {{9, 0, 0}, 1}};
  DeviceData data(spheres, 0);
  const std::vector<SpherePair> pairs = {{0, 1}, {2, 3}, {0, 3}};
  const auto results = test_pairs(data, pairs);
  EXPECT_EQ(results[0].touching, 1u) << "NaN in a centre";
  EXPECT_EQ(results[1].touching, 1u) << "NaN in a radius";
  EXPECT_EQ(results[2].touching, 0u);
  EXPECT_TRUE(test_pairs(data, {}).empty());
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
    Random random(base_seed());
    for (const Spheres& spheres :
         {sphere_kind("uniform").make(700, random), sphere_kind("uniform").make(3000, random),
          make_gas(3000, Real(0.5), 20, random), make_gas(3000, Real(0.5), 60, random)}) {
      const std::size_t n = spheres.size();
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

TEST_F(Cuda, OutputsThatAreNotAlignedAreRefused) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(3000, random);
  DeviceData data(spheres, 100);
  DeviceSphereCollider collider(data.stream.get());
  collider.reserve(spheres.size(), 100);
  auto* const odd = reinterpret_cast<unsigned char*>(data.contacts.data()) + 4;
  EXPECT_THROW(collider.find_contacts(data.spheres.data(), spheres.size(),
                                      reinterpret_cast<SphereContact*>(odd), 99, data.count.data()),
               InvalidArgument);
  EXPECT_THROW(collider.find_pairs(data.spheres.data(), spheres.size(),
                                   reinterpret_cast<SpherePair*>(odd), 99, data.count.data()),
               InvalidArgument);
}

TEST_F(Cuda, ContactsCanBeReservedBeforeSpheres) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(6000, random);
  const auto expected = brute_force(spheres);
  DeviceData data(spheres, expected.size());
  DeviceSphereCollider collider(data.stream.get());
  collider.reserve(1000, expected.size());
  collider.reserve(spheres.size(), 0);
  collider.find_contacts(data.spheres.data(), spheres.size(), data.contacts.data(), expected.size(),
                         data.count.data());
  data.wait();
  EXPECT_EQ(data.count.data()->complete, 1u) << seed_note();
  EXPECT_TRUE(same_bits(data.download(data.contacts.data(), expected.size()), expected));
}

TEST_F(Cuda, AbsurdSizesAreRefusedAndNothingIsLost) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(6000, random);
  const auto expected = brute_force(spheres);
  DeviceData data(spheres, expected.size());
  DeviceSphereCollider collider(data.stream.get());
  EXPECT_THROW(collider.reserve((std::size_t{1} << 31) + 1, 0), InvalidArgument);
  collider.reserve(spheres.size(), expected.size());
  EXPECT_THROW(collider.reserve(0, std::numeric_limits<std::size_t>::max() / 2), OutOfMemory);
  collider.reserve(spheres.size(), expected.size());
  collider.find_contacts(data.spheres.data(), spheres.size(), data.contacts.data(), expected.size(),
                         data.count.data());
  EXPECT_TRUE(same_bits(data.download(data.contacts.data(), expected.size()), expected));
}

TEST_F(Cuda, EarlierCudaErrorsOfTheUserAreNotReported) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(2000, random);
  const auto expected = brute_force(spheres);
  for (const SphereAlgorithm algorithm : kAlgorithms) {
    const auto collider = make(algorithm);
    void* memory = nullptr;
    ASSERT_NE(cudaMalloc(&memory, std::size_t{1} << 60), cudaSuccess);
    EXPECT_TRUE(same_bits(collider->find_contacts(spheres), expected)) << seed_note();
    static_cast<void>(cudaGetLastError());
  }
}

/// The limit of dynamic shared memory is set before each launch, and applies to all host threads.
TEST_F(Cuda, LargeCollidersInSeveralThreadsAreIndependent) {
  Random random(base_seed());
  const auto spheres = sphere_kind("uniform").make(600'000, random);
  std::array<std::uint64_t, 2> expected{};
  constexpr std::array<std::size_t, 2> kSizes = {262'145, 600'000};
  const auto count_of = [&](DeviceData& data, DeviceSphereCollider& collider, std::size_t n) {
    collider.find_pairs(data.spheres.data(), n, nullptr, 0, data.count.data());
    data.wait();
    return data.count.data()->contacts;
  };
  constexpr int kRounds = 500;  // an earlier version failed in one launch of 5,000
  {
    DeviceData data(spheres, 0);
    DeviceSphereCollider collider(data.stream.get());
    collider.reserve(spheres.size(), 0);
    for (std::size_t k = 0; k < 2; ++k) expected[k] = count_of(data, collider, kSizes[k]);
  }
  std::vector<std::jthread> workers;
  for (std::size_t t = 0; t < 8; ++t) {
    workers.emplace_back([&, n = kSizes[t % 2], contacts = expected[t % 2]] {
      DeviceData data(spheres, 0);
      DeviceSphereCollider collider(data.stream.get());
      collider.reserve(n, 0);
      for (int i = 0; i < kRounds; ++i) ASSERT_EQ(count_of(data, collider, n), contacts);
    });
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

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
