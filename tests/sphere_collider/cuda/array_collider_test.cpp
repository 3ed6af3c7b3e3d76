/// Searches on arrays in device memory against the functions on the host.
#include <jfpx/contact_list.hpp>
#include <jfpx/cuda/array_collider.hpp>
#include <jfpx/error.hpp>
#include <jfpx/periodic.hpp>

#include "tests/sphere_collider/cuda/cuda_fixture.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

/// An array in device memory.
template <class T>
class DeviceArray {
 public:
  explicit DeviceArray(std::size_t n) : size_(n) {
    void* data = nullptr;
    JFPX_CUDA_TRY(cudaMalloc(&data, (n + 1) * sizeof(T)));
    data_ = static_cast<T*>(data);
    JFPX_CUDA_TRY(cudaMemset(data, 0xff, (n + 1) * sizeof(T)));
  }
  explicit DeviceArray(const std::vector<T>& from) : DeviceArray(from.size()) {
    JFPX_CUDA_TRY(cudaMemcpy(data_, from.data(), size_ * sizeof(T), cudaMemcpyHostToDevice));
  }
  ~DeviceArray() { static_cast<void>(cudaFree(data_)); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;
  T* data() const { return data_; }
  std::vector<T> download() const {
    std::vector<T> to(size_);
    JFPX_CUDA_TRY(cudaDeviceSynchronize());
    JFPX_CUDA_TRY(cudaMemcpy(to.data(), data_, size_ * sizeof(T), cudaMemcpyDeviceToHost));
    return to;
  }

 private:
  T* data_ = nullptr;
  std::size_t size_;
};

/// Spheres as arrays with five values between two positions and two between two radii.
class DeviceSpheres {
 public:
  explicit DeviceSpheres(const Spheres& from)
      : positions_(positions_of(from)), radii_(radii_of(from)), count_(from.size()) {}
  SphereArrays arrays() const {
    return {.count = count_,
            .positions = positions_.data(),
            .row_stride = 5,
            .radii = radii_.data(),
            .radius_stride = 2};
  }

 private:
  static std::vector<Real> positions_of(const Spheres& from) {
    std::vector<Real> to(5 * from.size());
    for (std::size_t i = 0; i < from.size(); ++i) {
      for (int k = 0; k < 3; ++k) to[5 * i + static_cast<std::size_t>(k)] = from[i].centre[k];
    }
    return to;
  }
  static std::vector<Real> radii_of(const Spheres& from) {
    std::vector<Real> to(2 * from.size());
    for (std::size_t i = 0; i < from.size(); ++i) to[2 * i] = from[i].radius;
    return to;
  }

  DeviceArray<Real> positions_, radii_;
  std::size_t count_;
};

/// The result of the last search, of `n` contacts, from its four arrays.
template <class Index>
std::vector<SphereContact> contacts_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const DeviceArray<Index> a(n), b(n);
  const DeviceArray<Real> normals(3 * n), distances(n);
  collider.write_pairs(a.data(), b.data(), n, stream);
  collider.write_contacts(normals.data(), distances.data(), n, stream);
  const auto ha = a.download(), hb = b.download();
  const auto hn = normals.download(), hd = distances.download();
  std::vector<SphereContact> contacts(n);
  for (std::size_t i = 0; i < n; ++i) {
    contacts[i] = {.a = static_cast<SphereIndex>(ha[i]),
                   .b = static_cast<SphereIndex>(hb[i]),
                   .normal = {hn[3 * i], hn[3 * i + 1], hn[3 * i + 2]},
                   .distance = hd[i]};
  }
  return contacts;
}

std::vector<SpherePair> pairs_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const DeviceArray<std::int64_t> a(n), b(n);
  collider.write_pairs(a.data(), b.data(), n, stream);
  const auto ha = a.download(), hb = b.download();
  std::vector<SpherePair> pairs(n);
  for (std::size_t i = 0; i < n; ++i) {
    pairs[i] = {static_cast<SphereIndex>(ha[i]), static_cast<SphereIndex>(hb[i])};
  }
  return pairs;
}

std::vector<SpherePair> pairs_of(ContactSpan contacts) {
  std::vector<SpherePair> pairs;
  for (const SphereContact& c : contacts) pairs.push_back({c.a, c.b});
  return pairs;
}

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
}

/// The result of the last search in a periodic cell, of `n` contacts.
std::vector<PeriodicContact> periodic_of(ArrayCollider& collider, std::size_t n, Stream stream) {
  const auto contacts = contacts_of<std::int32_t>(collider, n, stream);
  const DeviceArray<std::int32_t> shifts(3 * n);
  collider.write_shifts(shifts.data(), n, stream);
  const auto host = shifts.download();
  std::vector<PeriodicContact> result;
  for (std::size_t i = 0; i < n; ++i) {
    result.push_back({contacts[i], {host[3 * i], host[3 * i + 1], host[3 * i + 2]}});
  }
  return result;
}

/// The same of a search for pairs.
std::vector<std::pair<SpherePair, ImageShift>> periodic_pairs_of(ArrayCollider& collider,
                                                                 std::size_t n, Stream stream) {
  const auto pairs = pairs_of(collider, n, stream);
  const DeviceArray<std::int32_t> shifts(3 * n);
  collider.write_shifts(shifts.data(), n, stream);
  const auto host = shifts.download();
  std::vector<std::pair<SpherePair, ImageShift>> result;
  for (std::size_t i = 0; i < n; ++i) {
    result.push_back({pairs[i], {host[3 * i], host[3 * i + 1], host[3 * i + 2]}});
  }
  return result;
}
std::vector<std::pair<SpherePair, ImageShift>> pairs_of(
    const std::vector<PeriodicContact>& contacts) {
  std::vector<std::pair<SpherePair, ImageShift>> result;
  for (const PeriodicContact& c : contacts) {
    result.push_back({{c.contact.a, c.contact.b}, c.shift});
  }
  return result;
}

/// Spheres of a cell, some of which have left it by up to three lengths; a quarter is on a lattice
/// of half lengths, where pairs touch through two images.
Spheres gas_in(const PeriodicCell& cell, std::size_t n, Real largest_radius, Random& random) {
  Spheres spheres(n);
  for (SphereInstance& s : spheres) {
    const bool on_lattice = random.below(4) == 0;
    for (int k = 0; k < 3; ++k) {
      const Real cells = static_cast<Real>(random.below(7)) - 3;
      const Real x = on_lattice ? static_cast<Real>(random.below(2)) / 2 : random.uniform(0, 1);
      s.centre[k] = (x + cells) * cell.lengths[k];
    }
    s.radius = on_lattice ? largest_radius : random.uniform(largest_radius / 3, largest_radius);
  }
  return spheres;
}

TEST_F(Cuda, FewArraysInAPeriodicCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  for (unsigned axes = 0; axes < 8; ++axes) {
    const PeriodicCell cell{{8, 9, Real(7.5)}, {(axes & 1) != 0, (axes & 2) != 0, (axes & 4) != 0}};
    for (const auto& [n, radius] : {std::pair<std::size_t, Real>{0, 1},
                                    {1, 1},
                                    {2, 1},
                                    {200, Real(7.5) / 4},
                                    {1500, Real(0.5)}}) {
      const Spheres spheres = gas_in(cell, n, radius, random);
      const DeviceSpheres arrays(spheres);
      const auto half = find_periodic_contacts(*cpu, spheres, cell);
      for (const bool both : {false, true}) {
        const auto expected = both ? in_both_orders(half, n) : half;
        ASSERT_EQ(collider.find_periodic(arrays.arrays(), cell, ArrayResult::contacts, both,
                                         stream.get()),
                  expected.size())
            << "axes " << axes << ", N = " << n << ", " << seed_note();
        EXPECT_EQ(periodic_of(collider, expected.size(), stream.get()), expected) << seed_note();
        ASSERT_EQ(
            collider.find_periodic(arrays.arrays(), cell, ArrayResult::pairs, both, stream.get()),
            expected.size());
        EXPECT_EQ(periodic_pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
      }
    }
  }
}

TEST_F(Cuda, ArraysInAPeriodicCellUseTheGridWithTheSameBits) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  for (const Real length : {Real(60), Real(300)}) {  // many and few contacts
    const PeriodicCell cell{{length, length, length}};
    Spheres spheres = gas_in(cell, 60'000, 1, random);
    for (SphereInstance& s : spheres) {
      for (int k = 0; k < 3; ++k) s.centre[k] += random.uniform(0, 40);  // off the lattice
    }
    const DeviceSpheres arrays(spheres);
    const auto expected = find_periodic_contacts(*cpu, spheres, cell);
    ASSERT_EQ(
        collider.find_periodic(arrays.arrays(), cell, ArrayResult::contacts, false, stream.get()),
        expected.size())
        << seed_note();
    EXPECT_TRUE(periodic_of(collider, expected.size(), stream.get()) == expected) << seed_note();
  }
}

TEST_F(Cuda, FewArraysOfTwoSetsInAPeriodicCellHaveTheContactsOfTheHost) {
  Random random(base_seed());
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const PeriodicCell cell{{8, 9, 7}, {true, true, false}};
  for (const auto& [queries, points] : {std::pair{0, 7}, {7, 0}, {1, 900}, {700, 800}}) {
    const Spheres first = gas_in(cell, static_cast<std::size_t>(queries), 1, random);
    const Spheres second = gas_in(cell, static_cast<std::size_t>(points), Real(0.5), random);
    const auto expected = find_periodic_contacts_between(*cpu, first, second, cell);
    const DeviceSpheres d_first(first), d_second(second);
    ASSERT_EQ(collider.find_periodic_between(d_first.arrays(), d_second.arrays(), cell,
                                             ArrayResult::contacts, stream.get()),
              expected.size())
        << seed_note();
    EXPECT_EQ(periodic_of(collider, expected.size(), stream.get()), expected) << seed_note();
    ASSERT_EQ(collider.find_periodic_between(d_first.arrays(), d_second.arrays(), cell,
                                             ArrayResult::pairs, stream.get()),
              expected.size());
    EXPECT_EQ(periodic_pairs_of(collider, expected.size(), stream.get()), pairs_of(expected));
  }
}

TEST_F(Cuda, ArraysInAPeriodicCellAreCheckedAsOnTheHost) {
  const OwnedStream stream(0);
  ArrayCollider collider;
  const auto cpu = make_sphere_collider({.backend = Backend::cpu});
  const auto message_of = [](const auto& search) -> std::string {
    try {
      search();
    } catch (const InvalidArgument& e) {
      return e.what();
    }
    return "no exception";
  };
  const auto check = [&](const PeriodicCell& cell, const Spheres& spheres) {
    const std::string expected = message_of([&] { find_periodic_contacts(*cpu, spheres, cell); });
    EXPECT_NE(expected, "no exception");
    const DeviceSpheres arrays(spheres);
    EXPECT_EQ(message_of([&] {
                collider.find_periodic(arrays.arrays(), cell, ArrayResult::pairs, false,
                                       stream.get());
              }),
              expected);
  };
  const Real inf = std::numeric_limits<Real>::infinity();
  const Spheres good(40, {{}, 1});
  Spheres invalid = good, far = good, both = good, large = good;
  invalid[31].radius = -2;
  far[17].centre.y = Real(1e8);
  both[12].centre.x = Real(-1e8);
  both[20].centre.z = inf;
  large[39].radius = 3;
  check({{9, 0, 9}}, good);
  check({{9, 9, inf}}, good);
  check({{9, 9, 9}}, invalid);
  check({{9, 9, 9}}, far);
  check({{9, 9, 9}}, both);
  check({{9, Real(3.9), 9}}, good);
  check({{9, 9, 9}}, large);
  const Real max = std::numeric_limits<Real>::max();
  check({{max, 9, 9}}, Spheres(40, {{4 * kEpsilon * max, 0, 0}, 1}));  // an image overflows
  const DeviceSpheres arrays(far);
  EXPECT_EQ(collider.find_periodic(arrays.arrays(), {{9, 9, 9}, {true, false, true}},
                                   ArrayResult::pairs, false, stream.get()),
            39u * 38 / 2);
  collider.find(arrays.arrays(), ArrayResult::pairs, false, stream.get());
  EXPECT_THROW(collider.write_shifts(nullptr, 0, stream.get()), InvalidArgument);
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
