/// Selects the kernels of a search on the device and owns their memory.
#include <jfpx/cuda/sphere_collider.hpp>
#include <jfpx/error.hpp>

#include "src/base/cuda/device_buffer.hpp"
#include "src/base/cuda/probe.hpp"
#include "src/sphere_collider/cuda/all_pairs.hpp"
#include "src/sphere_collider/cuda/fused_search.hpp"
#include "src/sphere_collider/cuda/grid.hpp"
#include "src/sphere_collider/cuda/pair_list.hpp"
#include "src/sphere_collider/cuda/scan.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

/// Largest number of spheres for which the test of all pairs is faster than the grid (measured on
/// an H200: bench/results).
constexpr std::size_t kMaxForAllPairs = 4500;
/// Largest size of the bit matrix of all pairs. Larger searches process bands of rows, in two
/// passes: one counts the contacts, one writes them.
constexpr std::size_t kMaskBytes = std::size_t{256} << 20;

constexpr std::size_t kMaskWords = kMaskBytes / sizeof(std::uint32_t);
constexpr std::size_t kStateWords = sizeof(SearchState) / sizeof(std::uint32_t);
static_assert(sizeof(SearchState) % 16 == 0);

/// Number of words of the bit matrix, or of a band of it, for up to `n` spheres.
std::size_t mask_words(std::size_t n) {
  const std::size_t stride = mask_stride(static_cast<std::uint32_t>(n));
  const std::size_t all = (n + kTile - 1) / kTile * kTile * stride;
  return std::min(all, std::max(kMaskWords, kTile * stride));
}

std::uint32_t table_size_for(std::size_t n) {
  return static_cast<std::uint32_t>(
      std::min(std::bit_ceil(std::max<std::size_t>(2 * n, 1024)), std::size_t{1} << 31));
}

/// Kernels copy 8 bytes at a time, so the address must be a multiple of 8.
void require_words(const void* output, const char* name) {
  if (std::bit_cast<std::uintptr_t>(output) % 8 == 0) return;
  throw InvalidArgument(std::string("the address of the ") + name + " is not a multiple of 8");
}

int usable_device(int device) {
  const BackendStatus status = probe(device);
  if (!status.usable) throw BackendUnavailable("cuda: " + status.reason);
  return device;
}

}  // namespace

struct DeviceSphereCollider::Impl {
  Impl(Stream stream_of_user, int device_to_use, SphereAlgorithm algorithm_to_use)
      : device(usable_device(device_to_use)),
        stream(stream_of_user),
        algorithm(algorithm_to_use),
        pool(device) {
    const DeviceGuard guard(device);
    has_fused = fused_search_supported();
    limits = grid_limits(device);
    reserve(0, 0);
  }

  bool uses_grid(std::size_t n) const {
    return algorithm == SphereAlgorithm::sorted_tiles ||
           (algorithm == SphereAlgorithm::automatic && n > kMaxForAllPairs);
  }
  void reserve(std::size_t n, std::size_t contacts);
  void reserve_spheres(std::size_t n);
  void find(const SphereInstance* d_spheres, std::size_t n, const SearchOutput& output);
  void find_among_all_pairs(const SphereInstance* d_spheres, std::uint32_t n,
                            const SearchOutput& output);
  void find_in_grid(const SphereInstance* d_spheres, std::uint32_t n, const SearchOutput& output);

  SearchState* state() const { return reinterpret_cast<SearchState*>(counters.data()); }
  std::uint32_t* counts() const { return counters.data() + kStateWords; }
  void scan_counts(std::uint32_t n) {
    exclusive_scan(counts(), offsets.data(), std::size_t{n} + 1, scan_scratch.data(),
                   scan_scratch.capacity(), stream);
  }

  int device;
  cudaStream_t stream;
  SphereAlgorithm algorithm;
  MemoryPool pool;
  bool has_fused = false;
  GridLimits limits{};
  std::size_t spheres_reserved = 0, contacts_asked = 0, contacts_reserved = 0;

  DeviceBuffer<std::uint32_t> counters;  // SearchState, then the number of contacts of each sphere
  DeviceBuffer<unsigned long long> offsets;
  DeviceBuffer<unsigned char> scan_scratch;
  DeviceBuffer<std::uint32_t> masks;

  DeviceBuffer<std::uint32_t> table;
  DeviceBuffer<unsigned long long> block_sums;
  DeviceBuffer<std::uint32_t> positions, ranks;
  DeviceBuffer<unsigned char> plan;
  DeviceBuffer<SphereInstance> sorted;
  DeviceBuffer<std::uint32_t> ids;
  DeviceBuffer<AlternatingStates> states;
  DeviceBuffer<CoarseBuckets> coarse;
  DeviceBuffer<unsigned char> scratch;

  DeviceBuffer<OverflowPair> overflow;
  DeviceBuffer<std::uint32_t> long_rows, very_long_rows, long_row_neighbors;
};

void DeviceSphereCollider::Impl::reserve(std::size_t n, std::size_t contacts) {
  check_number_of_spheres(n);
  const DeviceGuard guard(device);
  const std::size_t max_spheres = std::max(n, spheres_reserved);
  // A search of all pairs needs no memory for contacts, but a later reserve() of more spheres may
  // select the grid, which must then have memory for all contacts requested so far.
  contacts = std::max(contacts, contacts_asked);
  if (uses_grid(max_spheres)) {
    const std::size_t bytes = grid_scratch_bytes(max_spheres, contacts);
    scratch.reserve(pool, stream, bytes, "scratch memory");
  }
  if (n > spheres_reserved || counters.capacity() == 0) {
    reserve_spheres(n);
    spheres_reserved = n;
  }
  if (uses_grid(spheres_reserved) && contacts > contacts_reserved) {
    overflow.reserve(pool, stream, contacts, "pairs of long rows");
    long_rows.reserve(pool, stream, contacts / kSlots + 1, "long rows");
    very_long_rows.reserve(pool, stream, contacts / kMaxLongRow + 1, "very long rows");
    long_row_neighbors.reserve(pool, stream, contacts, "neighbors of long rows");
    contacts_reserved = contacts;
  }
  contacts_asked = contacts;
}

void DeviceSphereCollider::Impl::reserve_spheres(std::size_t n) {
  const std::size_t table_size = uses_grid(n) ? table_size_for(n) : 0;
  counters.reserve(pool, stream, kStateWords + n + 4, "contact counts");
  offsets.reserve(pool, stream, n + 1, "contact offsets");
  if (algorithm != SphereAlgorithm::sorted_tiles) {
    const bool all = algorithm == SphereAlgorithm::all_pairs;
    const std::size_t max_spheres = all ? n : std::min(n, kMaxForAllPairs);
    masks.reserve(pool, stream, mask_words(max_spheres), "pair masks");
    scan_scratch.reserve(pool, stream, scan_scratch_bytes(max_spheres + 1), "scan scratch");
  }
  if (uses_grid(n)) {
    table.reserve(pool, stream, table_size + 4, "cell table");
    block_sums.reserve(pool, stream, limits.max_blocks() + grid_sums(n, limits) + n / kBin + 3,
                       "sums of blocks");
    plan.reserve(pool, stream, grid_plan_bytes(), "plan of the cells");
    ranks.reserve(pool, stream, n, "ranks in the cell table");
    positions.reserve(pool, stream, n, "positions in the cell table");
    sorted.reserve(pool, stream, n + kReadBeyond, "sorted spheres");
    ids.reserve(pool, stream, n, "sorted indices");
    coarse.reserve(pool, stream, 1, "coarse buckets");
    states.reserve(pool, stream, 1, "states of searches");
    JFPX_CUDA_TRY(cudaMemsetAsync(states.data(), 0, sizeof(AlternatingStates), stream));
  }
}

void DeviceSphereCollider::Impl::find(const SphereInstance* d_spheres, std::size_t n,
                                      const SearchOutput& output) {
  if (n > spheres_reserved) {
    throw InvalidArgument("number of spheres is " + std::to_string(n) + "; " +
                          std::to_string(spheres_reserved) + " were reserved");
  }
  require_words(output.contacts, "contacts");
  require_words(output.pairs, "pairs");
  const DeviceGuard guard(device);
  const auto n32 = static_cast<std::uint32_t>(n);
  if (uses_grid(n) && n > 0) {
    find_in_grid(d_spheres, n32, output);
  } else if (has_fused && n <= kFusedSpheres) {
    launch_fused_search({d_spheres, n32, output}, stream);
  } else {
    find_among_all_pairs(d_spheres, n32, output);
  }
}

void DeviceSphereCollider::Impl::find_among_all_pairs(const SphereInstance* d_spheres,
                                                      std::uint32_t n, const SearchOutput& output) {
  JFPX_CUDA_TRY(
      cudaMemsetAsync(counters.data(), 0, (kStateWords + n + 1) * sizeof(std::uint32_t), stream));
  const std::size_t stride = std::max(mask_stride(n), 1u);
  const auto band = static_cast<std::uint32_t>(
      std::min<std::size_t>(masks.capacity() / stride / kTile * kTile, n));
  AllPairsArgs search{d_spheres, n, 0, band, masks.data(), counts(), true, state()};
  MaskEmitArgs emit{d_spheres, n, 0, band, masks.data(), offsets.data(), state(), output};
  const auto for_each_band = [&](auto&& work) {
    for (std::uint64_t first = 0; first < n; first += band) {
      search.first_row = emit.first_row = static_cast<std::uint32_t>(first);
      search.rows = emit.rows =
          static_cast<std::uint32_t>(std::min<std::uint64_t>(band, n - first));
      work();
    }
  };
  for_each_band([&] { launch_all_pairs(search, stream); });
  if (n > 0) {
    scan_counts(n);
  } else {
    JFPX_CUDA_TRY(cudaMemsetAsync(offsets.data(), 0, sizeof(unsigned long long), stream));
  }
  if (band >= n) {
    launch_mask_emit(emit, stream);
    return;
  }
  search.count = false;
  for_each_band([&] {
    launch_all_pairs(search, stream);
    launch_mask_emit(emit, stream);
  });
}

void DeviceSphereCollider::Impl::find_in_grid(const SphereInstance* d_spheres, std::uint32_t n,
                                              const SearchOutput& output) {
  unsigned long long* const count_sums = block_sums.data() + limits.max_blocks();
  const GridArgs grid{.input = {.spheres = d_spheres, .n = n},
                      .table = {.size = table_size_for(n),
                                .starts = table.data(),
                                .positions = positions.data(),
                                .ranks = ranks.data(),
                                .sorted = sorted.data(),
                                .ids = ids.data(),
                                .sums = block_sums.data(),
                                .coarse = coarse.data()},
                      .rows = {.counts = counts(),
                               .sums = count_sums,
                               .bin_sums = count_sums + grid_sums(n, limits),
                               .offsets = offsets.data(),
                               .capacity = contacts_reserved,
                               .overflow = overflow.data(),
                               .long_rows = long_rows.data(),
                               .very_long_rows = very_long_rows.data(),
                               .long_row_neighbors = long_row_neighbors.data()},
                      .scratch = grid_scratch(n, scratch.data()),
                      .state = state(),
                      .states = states.data(),
                      .plan = reinterpret_cast<GridPlan*>(plan.data())};
  launch_grid_search(grid, output, limits, stream);
}

DeviceSphereCollider::DeviceSphereCollider(Stream stream, int device, SphereAlgorithm algorithm)
    : impl_(std::make_unique<Impl>(stream, device, algorithm)) {}
DeviceSphereCollider::~DeviceSphereCollider() {
  if (impl_ == nullptr) return;
  try {
    const DeviceGuard guard(impl_->device);  // stream 0 is that of the current device
    impl_.reset();
  } catch (const DeviceError&) {
    impl_.reset();  // the device is lost
  }
}
DeviceSphereCollider::DeviceSphereCollider(DeviceSphereCollider&&) noexcept = default;
DeviceSphereCollider& DeviceSphereCollider::operator=(DeviceSphereCollider&& other) noexcept {
  std::swap(impl_, other.impl_);
  return *this;
}

void DeviceSphereCollider::reserve(std::size_t spheres, std::size_t contacts) {
  impl_->reserve(spheres, contacts);
}

void DeviceSphereCollider::find_contacts(const SphereInstance* d_spheres, std::size_t n,
                                         SphereContact* d_contacts, std::size_t capacity,
                                         ContactCount* d_count) {
  impl_->find(d_spheres, n, {d_contacts, nullptr, capacity, d_count});
}

void DeviceSphereCollider::find_pairs(const SphereInstance* d_spheres, std::size_t n,
                                      SpherePair* d_pairs, std::size_t capacity,
                                      ContactCount* d_count) {
  impl_->find(d_spheres, n, {nullptr, d_pairs, capacity, d_count});
}

void DeviceSphereCollider::test_pairs(const SphereInstance* d_spheres, const SpherePair* d_pairs,
                                      std::size_t m, PairResult* d_results) {
  const DeviceGuard guard(impl_->device);
  launch_test_pairs(d_spheres, d_pairs, m, d_results, impl_->stream);
}

SphereAlgorithm DeviceSphereCollider::algorithm_for(std::size_t n) const noexcept {
  return impl_->uses_grid(n) ? SphereAlgorithm::sorted_tiles : SphereAlgorithm::all_pairs;
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
