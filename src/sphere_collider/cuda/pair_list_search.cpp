/// Search for the touching pairs of a list by count, scan and emit, which keeps the order of the
/// list.
#include "src/sphere_collider/cuda/pair_list_search.hpp"

#include "src/sphere_collider/cuda/pair_list.hpp"
#include "src/sphere_collider/cuda/scan.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cuda {

std::span<const PairContact> PairListSearch::find(const MemoryPool& pool, cudaStream_t stream,
                                                  std::span<const SphereInstance> spheres,
                                                  std::span<const SpherePair> pairs) {
  transferred_ = {};
  if (pairs.empty()) return {};
  transferred_.to_device = spheres_.update(pool, stream, spheres, "spheres") +
                           pairs_.update(pool, stream, pairs, "pairs");
  const std::size_t sums = touching_blocks(pairs.size()) + 1;
  counts_.reserve_geometric(pool, stream, sums, "counts of touching pairs");
  sums_.reserve_geometric(pool, stream, sums, "sums of touching pairs");
  scratch_.reserve_geometric(pool, stream, scan_scratch_bytes(sums), "scan scratch");
  touching_.reserve_geometric(pairs.size(), "touching pairs on the host");
  total_.reserve(1, "number of touching pairs");

  const TouchingArgs args{.spheres = spheres_.data(),
                          .pairs = pairs_.data(),
                          .m = pairs.size(),
                          .counts = counts_.data(),
                          .sums = sums_.data(),
                          .touching = touching_.data(),
                          .total = total_.data()};
  launch_count_touching(args, stream);
  exclusive_scan(counts_.data(), sums_.data(), sums, scratch_.data(), scratch_.capacity(), stream);
  launch_emit_touching(args, stream);
  JFPX_CUDA_TRY(cudaStreamSynchronize(stream));
  const std::size_t total = *total_.data();
  transferred_.from_device = total * sizeof(PairContact) + sizeof(unsigned long long);
  return {touching_.data(), total};
}

}  // namespace cuda
}  // namespace JFPX_ABI
}  // namespace jfpx
