/// Searches on arrays in device memory against the functions on the host.
#include <jfpx/contact_list.hpp>
#include <jfpx/error.hpp>

#include "tests/sphere_collider/cuda/device_arrays.hpp"

#include <chrono>
#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

std::vector<std::int64_t> signed_offsets(ContactSpan contacts, std::size_t rows) {
  const auto offsets = row_offsets(contacts, rows);
  return {offsets.begin(), offsets.end()};
}

TEST_F(Cuda, FewArraysHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  for (const std::size_t n : std::initializer_list<std::size_t>{0, 1, 2, 300, 6000}) {
    const Spheres spheres = make_gas(n, Real(0.5), 6, random);
    const DeviceSpheres arrays(spheres);
    const auto cpu = make_sphere_collider({.backend = Backend::cpu});
    const ContactSpan found = cpu->find_contacts(spheres);
    const std::vector<SphereContact> half(found.begin(), found.end());
    for (const bool both : {false, true}) {
      const auto expected = both ? in_both_orders(half, n) : half;
      ASSERT_EQ(collider.find(arrays.arrays(), ArrayResult::contacts, both, stream.get()),
                expected.size());
      EXPECT_TRUE(
          same_bits(contacts_of<std::int32_t>(collider, expected.size(), stream.get()), expected))
          << "N = " << n << ", " << seed_note();
      EXPECT_TRUE(
          same_bits(contacts_of<std::int64_t>(collider, expected.size(), stream.get()), expected));
      const DeviceArray<std::int64_t> offsets(n + 1);
      collider.write_offsets(offsets.data(), stream.get());
      EXPECT_EQ(offsets.download(), signed_offsets(expected, n));

      ASSERT_EQ(collider.find(arrays.arrays(), ArrayResult::pairs, both, stream.get()),
                expected.size());
      EXPECT_EQ(pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
      collider.write_offsets(offsets.data(), stream.get());
      EXPECT_EQ(offsets.download(), signed_offsets(expected, n));
    }
  }
}

TEST_F(Cuda, FewArraysOfTwoSetsHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  for (const auto& [queries, points] : {std::pair{0, 7}, {7, 0}, {1, 900}, {2500, 3000}}) {
    const Spheres all = make_gas(static_cast<std::size_t>(queries + points), Real(0.5), 6, random);
    const Spheres first(all.begin(), all.begin() + queries),
        second(all.begin() + queries, all.end());
    const auto expected = find_contacts_between(*cpu, first, second);
    const DeviceSpheres d_first(first), d_second(second);
    for (const ArrayResult result : {ArrayResult::contacts, ArrayResult::pairs}) {
      ASSERT_EQ(collider.find_between(d_first.arrays(), d_second.arrays(), result, stream.get()),
                expected.size());
      EXPECT_EQ(pairs_of(collider, expected.size(), stream.get()), pairs_of(expected))
          << seed_note();
      const DeviceArray<std::int64_t> offsets(first.size() + 1);
      collider.write_offsets(offsets.data(), stream.get());
      EXPECT_EQ(offsets.download(), signed_offsets(expected, first.size()));
    }
    ASSERT_EQ(collider.find_between(d_first.arrays(), d_second.arrays(), ArrayResult::contacts,
                                    stream.get()),
              expected.size());
    EXPECT_TRUE(
        same_bits(contacts_of<std::int32_t>(collider, expected.size(), stream.get()), expected));
  }
}

TEST_F(Cuda, FewArraysOfSystemsHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const std::vector<std::uint64_t> several{0, 0, 1, 33, 34, 67, 131, 131, 600, 600};
  const std::vector<std::vector<std::uint64_t>> all_offsets{{0}, {0, 0}, {0, 600}, several};
  for (const std::vector<std::uint64_t>& offsets : all_offsets) {
    const std::size_t n = offsets.back();
    const Spheres spheres = make_gas(n, Real(0.5), 6, random);
    const DeviceSpheres arrays(spheres);
    const auto half = find_contacts_in_systems(*cpu, spheres, offsets);
    for (const bool both : {false, true}) {
      const auto expected = both ? in_both_orders(half, n) : half;
      ASSERT_EQ(collider.find_in_systems(arrays.arrays(), offsets, ArrayResult::contacts, both,
                                         stream.get()),
                expected.size())
          << seed_note();
      EXPECT_TRUE(
          same_bits(contacts_of<std::int64_t>(collider, expected.size(), stream.get()), expected))
          << seed_note();
      ASSERT_EQ(collider.find_in_systems(arrays.arrays(), offsets, ArrayResult::pairs, both,
                                         stream.get()),
                expected.size());
      EXPECT_EQ(pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
    }
  }
}

TEST_F(Cuda, ArraysOfSystemsAreCheckedAsOnTheHost) {
  Random random(base_seed());
  Spheres spheres = make_gas(50, Real(0.5), 2, random);
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto message_of = [&](const std::vector<std::uint64_t>& offsets) -> std::string {
    const DeviceSpheres arrays(spheres);
    try {
      collider.find_in_systems(arrays.arrays(), offsets, ArrayResult::pairs, false, stream.get());
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "no exception";
  };
  EXPECT_EQ(message_of({1, 50}), "offsets must begin with 0");
  EXPECT_EQ(message_of({0, 49}), "the last offset is 49; it must be the number of spheres, 50");
  spheres[41].radius = -1;
  EXPECT_EQ(message_of({0, 20, 50}), "sphere 41: radius is -1; it must be finite and > 0");
  SphereArrays many = DeviceSpheres(spheres).arrays();  // not read
  many.count = (std::size_t{1} << 31) + 1;
  const std::vector<std::uint64_t> all{0, many.count};
  EXPECT_THROW(collider.find_in_systems(many, all, ArrayResult::pairs, false, stream.get()),
               InvalidArgument);
}

TEST_F(Cuda, FewArraysOfOneRadiusAndAnyStrides) {
  Random random(base_seed());
  const OwnedStream stream(0);
  const std::size_t n = 500;
  const Spheres spheres = make_gas(n, Real(0.5), 6, random);
  std::vector<Real> columns(3 * n);  // x of all, y of all, z of all
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      columns[k * n + i] = spheres[i].centre[static_cast<int>(k)];
    }
  }
  const DeviceArray<Real> positions(columns);
  ArrayCollider collider;
  const auto expected = brute_force(spheres);
  ASSERT_EQ(collider.find({.count = n,
                           .positions = positions.data(),
                           .row_stride = 1,
                           .column_stride = static_cast<std::ptrdiff_t>(n),
                           .radius = Real(0.5)},
                          ArrayResult::contacts, false, stream.get()),
            expected.size());
  EXPECT_TRUE(
      same_bits(contacts_of<std::int32_t>(collider, expected.size(), stream.get()), expected))
      << seed_note();
}

TEST_F(Cuda, ArraysWithABadSphereNameItAndTheColliderStaysUsable) {
  const OwnedStream stream(0);
  Spheres spheres(50, {{}, 1});
  spheres[31].radius = -2;
  spheres[40].centre.y = std::numeric_limits<Real>::quiet_NaN();
  ArrayCollider collider;
  const DeviceSpheres bad(spheres);
  try {
    collider.find(bad.arrays(), ArrayResult::pairs, false, stream.get());
    FAIL() << "InvalidArgument was not thrown";
  } catch (const InvalidArgument& e) {
    EXPECT_STREQ(e.what(), "sphere 31: radius is -2; it must be finite and > 0");
  }
  const DeviceSpheres good(Spheres(50, {{}, 1}));
  EXPECT_EQ(collider.find(good.arrays(), ArrayResult::pairs, false, stream.get()), 50u * 49 / 2);
}

TEST_F(Cuda, ArraysCanBeSearchedInAGraph) {
  Random random(base_seed());
  const OwnedStream stream(0);
  const std::size_t n = 3000;
  const Spheres spheres = make_gas(n, Real(0.5), 6, random);
  const auto expected = brute_force(spheres);
  const DeviceSpheres arrays(spheres);
  ArrayCollider collider;
  const std::size_t capacity = expected.size() + 10;
  collider.reserve(n, capacity);
  const DeviceArray<std::int32_t> a(capacity), b(capacity);
  const DeviceArray<std::int64_t> count(2);
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  JFPX_CUDA_TRY(cudaStreamBeginCapture(stream.get(), cudaStreamCaptureModeThreadLocal));
  collider.enqueue(arrays.arrays(), ArrayResult::pairs, stream.get());
  collider.write_pairs(a.data(), b.data(), capacity, stream.get());
  collider.write_count(count.data(), stream.get());
  JFPX_CUDA_TRY(cudaStreamEndCapture(stream.get(), &graph));
  JFPX_CUDA_TRY(cudaGraphInstantiate(&executable, graph, 0));
  for (int repeat = 0; repeat < 3; ++repeat) {
    JFPX_CUDA_TRY(cudaGraphLaunch(executable, stream.get()));
  }
  const auto size = static_cast<std::int64_t>(expected.size());
  EXPECT_EQ(count.download(), (std::vector<std::int64_t>{size, 1}));
  const auto ha = a.download(), hb = b.download();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(static_cast<SphereIndex>(ha[i]), expected[i].a) << i << ", " << seed_note();
    ASSERT_EQ(static_cast<SphereIndex>(hb[i]), expected[i].b) << i;
  }
  EXPECT_EQ(ha[expected.size()], -1);  // nothing is written beyond
  JFPX_CUDA_TRY(cudaGraphExecDestroy(executable));
  JFPX_CUDA_TRY(cudaGraphDestroy(graph));
}

/// The indices that find_pairs() writes to an array with room for `capacity` pairs, and -1 beyond.
template <class Index>
std::vector<Index> rows_of(ArrayCollider& collider, const SphereArrays& spheres,
                           std::size_t capacity, std::size_t expected, Stream stream) {
  const DeviceArray<Index> indices(2 * capacity);
  EXPECT_EQ(collider.find_pairs(spheres, indices.data(), capacity, stream), expected);
  return indices.download();
}

template <class Index>
std::vector<Index> rows_of(const std::vector<SpherePair>& pairs) {
  std::vector<Index> rows;
  for (const SpherePair& pair : pairs) rows.push_back(static_cast<Index>(pair.a));
  for (const SpherePair& pair : pairs) rows.push_back(static_cast<Index>(pair.b));
  return rows;
}

/// Spheres for each of the searches: fused, all pairs, direct, sorted, in several launches; the
/// last three with rows of any length, too.
std::vector<Spheres> spheres_of_all_searches(Random& random) {
  std::vector<Spheres> all;
  for (const std::size_t n : {0, 1, 300, 3000, 6000, 30000, 300000}) {
    all.push_back(make_gas(n, Real(0.5), 6, random));
  }
  for (const auto& [n, contacts] : {std::pair{10000, 40}, {30000, 40}, {300000, 12}}) {
    all.push_back(
        make_gas(static_cast<std::size_t>(n), Real(0.5), static_cast<Real>(contacts), random));
  }
  for (const std::size_t k : {5, 8, 9}) {
    Spheres clusters = all[k];
    for (std::size_t i = 0; i < 1500; ++i) clusters[17 * i].centre = {1, 2, 3};
    for (std::size_t i = 0; i < 900; ++i) {
      clusters[20 * i + 5].centre = {Real(0.01) * static_cast<Real>(i % 30), 9, 9};
    }
    all.push_back(clusters);
  }
  return all;
}

TEST_F(Cuda, ArraysOfPairsAreWrittenAsRowsOfIndices) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  for (const Spheres& spheres : spheres_of_all_searches(random)) {
    const DeviceSpheres arrays(spheres);
    const ContactSpan contacts = cpu->find_contacts(spheres);
    const std::vector<SpherePair> pairs = pairs_of(contacts);
    const std::size_t size = pairs.size();
    const auto note = "N = " + std::to_string(spheres.size()) + ", " + std::to_string(size) +
                      " pairs, " + seed_note();
    ASSERT_EQ(collider.find(arrays.arrays(), ArrayResult::contacts, false, stream.get()), size);
    EXPECT_TRUE(same_bits(contacts_of<std::int32_t>(collider, size, stream.get()), contacts))
        << note;
    for (int repeat = 0; repeat < 2; ++repeat) {  // memory grows in the first search
      EXPECT_TRUE(rows_of<std::int32_t>(collider, arrays.arrays(), size, size, stream.get()) ==
                  rows_of<std::int32_t>(pairs))
          << note;
    }
    EXPECT_TRUE(rows_of<std::int64_t>(collider, arrays.arrays(), size, size, stream.get()) ==
                rows_of<std::int64_t>(pairs))
        << note;
    auto expected = rows_of<std::int32_t>(pairs);
    expected.resize(2 * (size + 10), -1);  // nothing is written beyond
    EXPECT_TRUE(rows_of<std::int32_t>(collider, arrays.arrays(), size + 10, size, stream.get()) ==
                expected)
        << note;
    if (size == 0) continue;
    const auto few = rows_of<std::int32_t>(collider, arrays.arrays(), size - 1, size, stream.get());
    EXPECT_TRUE(few == std::vector<std::int32_t>(2 * (size - 1), -1)) << note;
  }
}

TEST_F(Cuda, FewArraysOfPairsWaitForEarlierWorkOfTheStream) {
  const OwnedStream stream(0);
  const Spheres spheres(60, {{}, 1});
  const DeviceSpheres arrays(spheres);
  ArrayCollider collider;
  for (int repeat = 0; repeat < 2; ++repeat) {
    JFPX_CUDA_TRY(cudaLaunchHostFunc(
        stream.get(), [](void*) { std::this_thread::sleep_for(std::chrono::milliseconds(20)); },
        nullptr));
    rows_of<std::int32_t>(collider, arrays.arrays(), 60 * 59 / 2, 60 * 59 / 2, stream.get());
  }
}

TEST_F(Cuda, ArraysOfPairsWithABadSphereNameIt) {
  const OwnedStream stream(0);
  ArrayCollider collider;
  for (const std::size_t n : {100, 3000, 6000, 300000}) {
    Random random(base_seed());
    Spheres spheres = make_gas(n, Real(0.5), 6, random);
    spheres[n - 3].centre.y = std::numeric_limits<Real>::quiet_NaN();
    const DeviceSpheres arrays(spheres);
    const DeviceArray<std::int32_t> indices(20);
    try {
      collider.find_pairs(arrays.arrays(), indices.data(), 10, stream.get());
      ADD_FAILURE() << "InvalidArgument was not thrown";
    } catch (const InvalidArgument& e) {
      EXPECT_EQ(std::string(e.what()),
                "sphere " + std::to_string(n - 3) + ": centre.y is nan; it must be finite");
    }
    EXPECT_EQ(indices.download(), std::vector<std::int32_t>(20, -1));
  }
}

TEST_F(Cuda, ArraysBeyondTheReservationHaveTheCountAlone) {
  const OwnedStream stream(0);
  const Spheres spheres(100, {{}, 1});
  const DeviceSpheres arrays(spheres);
  ArrayCollider collider;
  collider.reserve(100, 10);
  const DeviceArray<std::int32_t> a(10), b(10);
  const DeviceArray<std::int64_t> count(2);
  collider.enqueue(arrays.arrays(), ArrayResult::pairs, stream.get());
  collider.write_pairs(a.data(), b.data(), 10, stream.get());
  collider.write_count(count.data(), stream.get());
  EXPECT_EQ(count.download(), (std::vector<std::int64_t>{4950, 0}));
  EXPECT_EQ(a.download(), std::vector<std::int32_t>(10, -1));
  ArrayCollider small;
  small.reserve(100, 10);
  EXPECT_THROW(small.enqueue(DeviceSpheres(Spheres(1000, {{}, 1})).arrays(), ArrayResult::pairs,
                             stream.get()),
               InvalidArgument);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
