/// The kernels for SSE2, which every x86-64 has.
#include "src/sphere_collider/cpu/kernels.hpp"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

std::uint64_t* append_bits(std::uint64_t*, std::uint32_t, const std::uint32_t*, std::uint32_t);

#if defined(JFPX_DOUBLE_PRECISION)
struct Simd {
  static constexpr std::uint32_t kLanes = 2;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m128d;
  static Vec load(const Real* p) { return _mm_loadu_pd(p); }
  static Vec set(Real v) { return _mm_set1_pd(v); }
  static Vec add(Vec a, Vec b) { return _mm_add_pd(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm_sub_pd(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm_mul_pd(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm_movemask_pd(_mm_cmpngt_pd(a, b)));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return (cell[0] < bound ? 1u : 0u) | (cell[1] < bound ? 2u : 0u);
  }
  /// Without an instruction for it: bits in a number below 16, a nibble each.
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(0x4332322132212110ull >> (4 * mask)) & 7;
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};
#else
struct Simd {
  static constexpr std::uint32_t kLanes = 4;
  static constexpr std::uint32_t kAll = (1u << kLanes) - 1;
  using Vec = __m128;
  static Vec load(const Real* p) { return _mm_loadu_ps(p); }
  static Vec set(Real v) { return _mm_set1_ps(v); }
  static Vec add(Vec a, Vec b) { return _mm_add_ps(a, b); }
  static Vec sub(Vec a, Vec b) { return _mm_sub_ps(a, b); }
  static Vec mul(Vec a, Vec b) { return _mm_mul_ps(a, b); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmpngt_ps(a, b)));
  }
  static std::uint32_t cells_below(const std::int64_t* cell, std::int64_t bound) {
    return (cell[0] < bound ? 1u : 0u) | (cell[1] < bound ? 2u : 0u) | (cell[2] < bound ? 4u : 0u) |
           (cell[3] < bound ? 8u : 0u);
  }
  /// Without an instruction for it: bits in a number below 16, a nibble each.
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(0x4332322132212110ull >> (4 * mask)) & 7;
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};
#endif

using RowSimd = Simd;

}  // namespace
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx

#include "src/sphere_collider/cpu/kernels.inl"

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
constinit const Kernels kSse2Kernels = {search_all, search_rows};
}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
