/// The loops of neighbor lists for any processor.
#include "src/sphere_collider/cpu/neighbor_kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint32_t search_neighbors(const NeighborColumns& columns, const NeighborQuery& query,
                               std::uint32_t begin, std::uint32_t end, std::uint32_t* found,
                               bool* unsure) {
  std::uint32_t count = 0;
  bool any_unsure = false;
  for (std::uint32_t k = begin; k < end; ++k) {
    const double dx = columns.x[k] - query.x;
    const double dy = columns.y[k] - query.y;
    const double dz = columns.z[k] - query.z;
    const double square = dx * dx + dy * dy + dz * dz;
    const bool kept = (square <= query.outer) & (square >= query.lowest);
    const bool sure = (square <= query.inner) & (square >= query.least);
    any_unsure |= kept & !sure;
    found[count] = columns.index[k];
    count += (kept & (columns.index[k] >= query.least_index)) ? 1 : 0;
  }
  *unsure = *unsure || any_unsure;
  return count;
}

void rank_neighbors(const std::uint32_t* numbers, std::uint32_t count, std::uint32_t* ranks) {
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t number = numbers[i];
    std::uint32_t rank = 0;
    for (std::uint32_t k = 0; k < count; ++k) rank += numbers[k] < number ? 1 : 0;
    ranks[i] = rank;
  }
}

}  // namespace

constinit const NeighborKernels kBaselineNeighborKernels = {search_neighbors, rank_neighbors};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
