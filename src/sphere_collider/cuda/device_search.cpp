/// Selects the kernels of a search on the device and owns their memory.
#include "src/sphere_collider/cuda/device_search.hpp"

#include <jfpx/error.hpp>

#include "src/base/cuda/probe.hpp"
#include "src/sphere_collider/cuda/all_pairs.hpp"
#include "src/sphere_collider/cuda/scan.hpp"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {
namespace {

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

}  // namespace

int usable_device(int device) {
  const BackendStatus status = probe(device);
  if (!status.usable) throw BackendUnavailable("cuda: " + status.reason);
  return device;
}

DeviceSearch::DeviceSearch(cudaStream_t stream, int device, SphereAlgorithm algorithm)
    : device_(usable_device(device)), stream_(stream), algorithm_(algorithm), pool_(device) {
  const DeviceGuard guard(device_);
  has_fused_ = fused_search_supported();
  limits_ = grid_limits(device);
  reserve(0, 0);
}

std::uint32_t* DeviceSearch::counts() const { return counters_.data() + kStateWords; }

bool DeviceSearch::uses_grid(std::size_t n) const {
  return algorithm_ == SphereAlgorithm::grid ||
         (algorithm_ == SphereAlgorithm::automatic && n > kMaxForAllPairs);
}

bool DeviceSearch::is_one_launch(std::size_t n) const {
  if (uses_grid(n) && n > 0) return is_in_one_launch(n);
  return has_fused_ && n <= kFusedSpheres;
}

void DeviceSearch::reserve(std::size_t n, std::size_t contacts, bool needs_grid) {
  check_number_of_spheres(n);
  const DeviceGuard guard(device_);
  const std::size_t max_spheres = std::max(n, spheres_reserved_);
  const bool with_grid = has_grid_ || needs_grid || uses_grid(max_spheres);
  // A search of all pairs needs no memory for contacts. A later reserve() of more spheres may
  // select the grid, which then needs memory for all contacts requested so far.
  contacts = std::max(contacts, contacts_requested_);
  if (with_grid) {
    const std::size_t bytes = grid_scratch_bytes(max_spheres, contacts);
    scratch_.reserve(pool_, stream_, bytes, "scratch memory");
  }
  if (n > spheres_reserved_ || counters_.capacity() == 0 || with_grid != has_grid_) {
    reserve_spheres(max_spheres, with_grid);
    spheres_reserved_ = max_spheres;
    has_grid_ = with_grid;
  }
  if (with_grid && contacts > contacts_reserved_) {
    overflow_.reserve(pool_, stream_, contacts, "pairs of long rows");
    long_rows_.reserve(pool_, stream_, contacts / kSlots + 1, "long rows");
    very_long_rows_.reserve(pool_, stream_, contacts / kMaxLongRow + 1, "very long rows");
    long_row_neighbors_.reserve(pool_, stream_, contacts, "neighbors of long rows");
    contacts_reserved_ = contacts;
  }
  contacts_requested_ = contacts;
}

void DeviceSearch::reserve_spheres(std::size_t n, bool with_grid) {
  const std::size_t table_size = with_grid ? table_size_for(n) : 0;
  counters_.reserve(pool_, stream_, kStateWords + n + 4, "contact counts");
  offsets_.reserve(pool_, stream_, n + 1, "contact offsets");
  if (algorithm_ != SphereAlgorithm::grid) {
    const bool all = algorithm_ == SphereAlgorithm::all_pairs;
    const std::size_t max_spheres = all ? n : std::min(n, kMaxForAllPairs);
    masks_.reserve(pool_, stream_, mask_words(max_spheres), "pair masks");
    scan_scratch_.reserve(pool_, stream_, scan_scratch_bytes(max_spheres + 1), "scan scratch");
  }
  if (with_grid) {
    table_.reserve(pool_, stream_, table_size + 4, "cell table");
    block_sums_.reserve(pool_, stream_, limits_.max_blocks() + grid_sums(n, limits_) + n / kBin + 3,
                        "sums of blocks");
    plan_.reserve(pool_, stream_, grid_plan_bytes(), "plan of the cells");
    ranks_.reserve(pool_, stream_, n, "ranks in the cell table");
    positions_.reserve(pool_, stream_, n, "positions in the cell table");
    sorted_.reserve(pool_, stream_, n + kReadBeyond, "sorted spheres");
    ids_.reserve(pool_, stream_, n, "sorted indices");
    coarse_.reserve(pool_, stream_, 1, "coarse buckets");
    states_.reserve(pool_, stream_, 1, "states of searches");
    JFPX_CUDA_TRY(cudaMemsetAsync(states_.data(), 0, sizeof(AlternatingStates), stream_));
  }
}

void DeviceSearch::require_reserved(std::size_t n) const {
  if (fits(n)) return;
  throw InvalidArgument("number of spheres is " + std::to_string(n) + "; " +
                        std::to_string(spheres_reserved_) + " were reserved");
}

void DeviceSearch::find(const SphereInput& input, const SearchOutput& output, cudaStream_t stream) {
  require_words(output.contacts, "contacts");
  require_words(output.pairs, "pairs");
  const DeviceGuard guard(device_);
  if ((uses_grid(input.n) || input.is_periodic()) && input.n > 0) {
    find_in_grid(input, output, stream);
  } else if (has_fused_ && input.n <= kFusedSpheres) {
    launch_fused_search({input, output}, stream);
  } else {
    find_among_all_pairs(input, output, stream);
  }
}

void DeviceSearch::find_among_all_pairs(const SphereInput& input, const SearchOutput& output,
                                        cudaStream_t stream) {
  const std::uint32_t n = input.n;
  JFPX_CUDA_TRY(
      cudaMemsetAsync(counters_.data(), 0, (kStateWords + n + 1) * sizeof(std::uint32_t), stream));
  const std::size_t stride = std::max(mask_stride(n), 1u);
  const auto band = static_cast<std::uint32_t>(
      std::min<std::size_t>(masks_.capacity() / stride / kTile * kTile, n));
  AllPairsArgs search{input.spheres, n, 0, band, masks_.data(), counts(), true, state()};
  MaskEmitArgs emit{input.spheres, n, 0, band, masks_.data(), offsets_.data(), state(), output};
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
    exclusive_scan(counts(), offsets_.data(), std::size_t{n} + 1, scan_scratch_.data(),
                   scan_scratch_.capacity(), stream);
  } else {
    JFPX_CUDA_TRY(cudaMemsetAsync(offsets_.data(), 0, sizeof(unsigned long long), stream));
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

void DeviceSearch::find_in_grid(const SphereInput& input, const SearchOutput& output,
                                cudaStream_t stream) {
  const std::uint32_t n = input.n;
  unsigned long long* const count_sums = block_sums_.data() + limits_.max_blocks();
  const GridArgs grid{.input = input,
                      .table = {.size = table_size_for(n),
                                .starts = table_.data(),
                                .positions = positions_.data(),
                                .ranks = ranks_.data(),
                                .sorted = sorted_.data(),
                                .ids = ids_.data(),
                                .sums = block_sums_.data(),
                                .coarse = coarse_.data()},
                      .rows = {.counts = counts(),
                               .sums = count_sums,
                               .bin_sums = count_sums + grid_sums(n, limits_),
                               .offsets = offsets_.data(),
                               .capacity = contacts_reserved_,
                               .overflow = overflow_.data(),
                               .long_rows = long_rows_.data(),
                               .very_long_rows = very_long_rows_.data(),
                               .long_row_neighbors = long_row_neighbors_.data()},
                      .scratch = grid_scratch(n, scratch_.data()),
                      .state = state(),
                      .states = states_.data(),
                      .plan = reinterpret_cast<GridPlan*>(plan_.data())};
  launch_grid_search(grid, output, limits_, stream);
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
