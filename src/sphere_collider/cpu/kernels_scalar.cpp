/// The kernels without vectors: what is compared against, and for any x86-64.
#include "src/sphere_collider/cpu/kernels.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint64_t* append_bits(std::uint64_t*, std::uint32_t, const std::uint32_t*, std::uint32_t);

struct Simd {
  static constexpr std::uint32_t kLanes = 1;
  static constexpr std::uint32_t kAll = 1;
  using Vec = Real;
  static Vec load(const Real* p) { return *p; }
  static Vec set(Real v) { return v; }
  static Vec add(Vec a, Vec b) { return a + b; }
  static Vec sub(Vec a, Vec b) { return a - b; }
  static Vec mul(Vec a, Vec b) { return a * b; }
  static std::uint32_t not_greater(Vec a, Vec b) { return a > b ? 0 : 1; }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return *cell < bound ? 1 : 0;
  }
  static std::uint32_t count(std::uint32_t mask) { return mask; }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

using RowSimd = Simd;

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
constinit const Kernels kScalarKernels = {search_all, search_rows};
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
