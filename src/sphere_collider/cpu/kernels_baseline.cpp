/// The kernels for vectors of 128 bits, which every processor supports.
#include "src/base/real_lanes.hpp"
#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

struct Simd {
  using Vec = RealLanes;
  static constexpr std::uint32_t kLanes = kRealLanes;
  static Vec load(const Real* p) { return load_lanes(p); }
  static Vec set(Real v) { return set_lanes(v); }
  static void store(Real* p, Vec v) { store_lanes(p, v); }
  static Vec square_root(Vec v) { return cpu::square_root(v); }
  static std::uint32_t not_greater(Vec a, Vec b) { return bits(cpu::not_greater(a, b)); }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    std::uint32_t below = 0;
    for (std::uint32_t k = 0; k < kLanes; ++k) below |= (cell[k] < bound ? 1u : 0u) << k;
    return below;
  }
  static std::uint32_t ids_above(const std::uint32_t* ids, std::uint32_t bound) {
    std::uint32_t above = 0;
    for (std::uint32_t k = 0; k < kLanes; ++k) above |= (ids[k] > bound ? 1u : 0u) << k;
    return above;
  }
  static void copy_ids(const std::uint32_t* from, std::uint32_t* to) {
    __builtin_memcpy(to, from, kLanes * sizeof *to);
  }
  /// Counts set bits with a table of nibbles, because SSE2 and NEON have no such instruction.
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(0x4332322132212110ull >> (4 * mask)) & 7;
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

}  // namespace

constinit const Kernels kBaselineKernels = {search_all<Simd>, search_rows<Simd>,
                                            search_cells<Simd>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
