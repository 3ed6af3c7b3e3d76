/// Sizes that need more than 32 bits or most of the memory of a large GPU. Skipped if there is
/// less.
#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

#include <cstdio>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

constexpr double kGiga = 1e9;

/// Downloads an array in slices, so that the host need not hold all of it.
template <typename T, typename Check>
void for_each_slice(const DeviceData& data, const T* from, std::uint64_t count, Check&& check) {
  constexpr std::uint64_t kSlice = 1 << 25;
  for (std::uint64_t first = 0; first < count; first += kSlice) {
    check(first, data.download(from + first, std::min(kSlice, count - first)));
  }
}

// 465^3 = 100 544 625 spheres, spacing 1.99 of 2: neighbours along the axes touch, those on
// diagonals are 2.81 apart. So sphere a touches a+1, a+465 and a+465^2 if these are in the same
// row, layer and cube: 3 * 465^2 * 464 contacts, each of which is checked.
TEST_F(Cuda, AHundredMillionSpheresOfALatticeHaveAllTheirContacts) {
  constexpr std::uint64_t kN = 465, kSpheres = kN * kN * kN, kContacts = 3 * kN * kN * (kN - 1);
  const std::size_t before = free_bytes();
  if (before < std::size_t{60} << 30) GTEST_SKIP() << "needs 60 GiB, free are " << before;
  const auto spheres = make_lattice(kN, Real(1.99));
  DeviceData data(spheres, kContacts);
  DeviceSphereCollider collider(data.stream.get());
  const std::size_t without = free_bytes();
  collider.reserve(kSpheres, kContacts);
  const std::size_t after = free_bytes();
  const auto search = [&] {
    collider.find_contacts(data.spheres.data(), kSpheres, data.contacts.data(), kContacts,
                           data.count.data());
  };
  search();
  data.wait();
  cudaEvent_t events[2];
  for (cudaEvent_t& e : events) JFPX_CUDA_TRY(cudaEventCreate(&e));
  JFPX_CUDA_TRY(cudaEventRecord(events[0], data.stream.get()));
  search();
  JFPX_CUDA_TRY(cudaEventRecord(events[1], data.stream.get()));
  data.wait();
  float ms = 0;
  JFPX_CUDA_TRY(cudaEventElapsedTime(&ms, events[0], events[1]));
  for (cudaEvent_t e : events) JFPX_CUDA_TRY(cudaEventDestroy(e));
  std::printf("%.1f ms; spheres and contacts %.2f GB, the search's own memory %.2f GB\n",
              static_cast<double>(ms), static_cast<double>(before - without) / kGiga,
              static_cast<double>(without - after) / kGiga);

  ASSERT_EQ(data.count.data()->complete, 1u);
  ASSERT_EQ(data.count.data()->contacts, kContacts);
  std::uint64_t a = 0;
  unsigned step = 0;
  constexpr std::uint64_t kSteps[3] = {1, kN, kN * kN};
  const auto is_inside = [&] { return a / kSteps[step] % kN + 1 < kN; };
  const auto advance = [&] {
    if (++step == 3) step = 0, ++a;
  };
  for_each_slice(data, data.contacts.data(), kContacts,
                 [&](std::uint64_t first, const auto& slice) {
                   for (std::size_t i = 0; i < slice.size(); ++i, advance()) {
                     while (!is_inside()) advance();
                     ASSERT_EQ(slice[i].a, a) << "contact " << first + i;
                     ASSERT_EQ(slice[i].b, a + kSteps[step]) << "contact " << first + i;
                   }
                 });
}

// 92 683 spheres in one place: 92 683 * 92 682 / 2 = 4 295 022 903 pairs, more than 2^32.
TEST_F(Cuda, MoreThanFourThousandMillionPairsAreFoundInOrder) {
  constexpr std::uint64_t kSpheres = 92'683, kPairs = kSpheres * (kSpheres - 1) / 2;
  static_assert(kPairs > std::uint64_t{1} << 32);
  for (const SphereAlgorithm algorithm : {SphereAlgorithm::all_pairs, SphereAlgorithm::grid}) {
    const std::size_t free = free_bytes();
    if (free < std::size_t{105} << 30) GTEST_SKIP() << "needs 105 GiB, free are " << free;
    const Spheres spheres(kSpheres, {{-1, 2, 3}, Real(0.25)});
    DeviceData data(spheres, 1);
    DeviceBuffer<SpherePair> pairs;
    pairs.reserve(data.pool, data.stream.get(), kPairs, "pairs");
    DeviceSphereCollider collider(data.stream.get(), 0, algorithm);
    collider.reserve(kSpheres, kPairs);
    collider.find_pairs(data.spheres.data(), kSpheres, pairs.data(), kPairs, data.count.data());
    data.wait();
    ASSERT_EQ(data.count.data()->contacts, kPairs);
    ASSERT_EQ(data.count.data()->complete, 1u);
    SpherePair expected{0, 1};
    for_each_slice(data, pairs.data(), kPairs, [&](std::uint64_t first, const auto& slice) {
      for (std::size_t i = 0; i < slice.size(); ++i) {
        ASSERT_EQ(slice[i], expected) << "pair " << first + i;
        if (++expected.b == kSpheres) expected.b = ++expected.a + 1;
      }
    });
  }
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
