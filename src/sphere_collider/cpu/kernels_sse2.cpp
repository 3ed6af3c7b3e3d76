/// The kernels for SSE2, which every x86-64 processor supports.
#include "src/sphere_collider/cpu/kernels.inl"

#include <immintrin.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace cpu {
namespace {

#if defined(JFPX_DOUBLE_PRECISION)
struct Reals {
  using Vec = __m128d;
  static Vec load(const Real* p) { return _mm_loadu_pd(p); }
  static Vec set(Real v) { return _mm_set1_pd(v); }
  static void store(Real* p, Vec v) { _mm_storeu_pd(p, v); }
  static Vec square_root(Vec v) { return _mm_sqrt_pd(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm_movemask_pd(_mm_cmpngt_pd(a, b)));
  }
};
#else
struct Reals {
  using Vec = __m128;
  static Vec load(const Real* p) { return _mm_loadu_ps(p); }
  static Vec set(Real v) { return _mm_set1_ps(v); }
  static void store(Real* p, Vec v) { _mm_storeu_ps(p, v); }
  static Vec square_root(Vec v) { return _mm_sqrt_ps(v); }
  static std::uint32_t not_greater(Vec a, Vec b) {
    return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmpngt_ps(a, b)));
  }
};
#endif

struct Simd : Reals {
  static constexpr std::uint32_t kLanes = sizeof(Vec) / sizeof(Real);
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
  /// Looks the number of set bits up in a table of nibbles, because SSE2 has no POPCNT.
  static std::uint32_t count(std::uint32_t mask) {
    return static_cast<std::uint32_t>(0x4332322132212110ull >> (4 * mask)) & 7;
  }
  static std::uint64_t* append(std::uint64_t* out, std::uint32_t id, const std::uint32_t* others,
                               std::uint32_t mask) {
    return append_bits(out, id, others, mask);
  }
};

}  // namespace

constinit const Kernels kSse2Kernels = {search_all<Simd>, search_rows<Simd>, search_cells<Simd>};

}  // namespace cpu
}  // namespace JFPX_ABI
}  // namespace jfpx
