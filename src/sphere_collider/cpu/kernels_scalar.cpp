/// The kernels without vector instructions: the reference for all other kernels.
#include <jfpx/math.hpp>

#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

struct Simd {
  using Vec = Real;
  static constexpr std::uint32_t kLanes = 1;
  static Vec load(const Real* p) { return *p; }
  static Vec set(Real v) { return v; }
  static void store(Real* p, Vec v) { *p = v; }
  static Vec square_root(Vec v) { return jfpx::square_root(v); }
  static std::uint32_t not_greater(Vec a, Vec b) { return a > b ? 0 : 1; }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return *cell < bound ? 1 : 0;
  }
  static std::uint32_t ids_above(const std::uint32_t* ids, std::uint32_t bound) {
    return *ids > bound ? 1 : 0;
  }
  static void copy_ids(const std::uint32_t* from, std::uint32_t* to) { *to = *from; }
  static std::uint32_t count(std::uint32_t mask) { return mask; }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

}  // namespace

constinit const Kernels kScalarKernels = {search_all<Simd>, search_rows<Simd>, search_cells<Simd>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
