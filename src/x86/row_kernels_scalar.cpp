/// The kernels of the row solver for any processor: blocks of one row.
#include "src/x86/row_kernels.hpp"

namespace jfpx::inline JFPX_ABI::x86 {
namespace {

struct Simd {
  static constexpr int kLanes = 1;
  using Vec = Real;
  using Mask = bool;
  static Vec set(Real v) { return v; }
  static Vec load(const Real* p) { return *p; }
  static void store(Real* p, Vec v) { *p = v; }
  static Vec negate(Vec v) { return -v; }
  static Vec absolute(Vec v) { return static_cast<Real>(__builtin_fabs(v)); }
  static Vec square_root(Vec v) {
    return sizeof(Real) == 4 ? static_cast<Real>(__builtin_sqrtf(static_cast<float>(v)))
                             : static_cast<Real>(__builtin_sqrt(v));
  }
  static Vec select(Mask m, Vec a, Vec b) { return m ? a : b; }
  static Vec keep(Mask m, Vec v) { return m ? v : Real(0); }
  static Mask less(Vec a, Vec b) { return a < b; }
  static Mask less_equal(Vec a, Vec b) { return a <= b; }
  static Mask differs(Vec a, Vec b) { return a != b; }
  static Mask unordered(Vec v) { return v != v; }
  static Mask both(Mask a, Mask b) { return a && b; }
  static Mask either(Mask a, Mask b) { return a || b; }
  static Mask negate_mask(Mask m) { return !m; }
  static Mask always() { return true; }
  static Mask never() { return false; }
  static bool any(Mask m) { return m; }
  static unsigned bits(Mask m) { return m ? 1 : 0; }
  static Mask is_real(const std::int32_t* ids) { return *ids != rows::kFixedBody; }
  static Vec residual(Vec impulse, Vec inverse) {
    return static_cast<Real>(impulse * (1. / inverse));
  }
  static void gather4(const Real* base, const std::int32_t* ids, int stride, Vec* out) {
    const Real* p = base + std::ptrdiff_t{*ids ^ (*ids >> 31)} * stride;
    for (int k = 0; k < 4; ++k) out[k] = p[k];
  }
  static void scatter8(Real* base, const std::int32_t* ids, int stride, const Vec* u,
                       const Vec* w) {
    if (*ids < 0) return;
    Real* p = base + std::ptrdiff_t{*ids} * stride;
    for (int k = 0; k < 4; ++k) {
      p[k] = u[k];
      p[4 + k] = w[k];
    }
  }
};

}  // namespace
}  // namespace jfpx::inline JFPX_ABI::x86

#include "src/x86/row_kernels.inl"

namespace jfpx::inline JFPX_ABI::x86 {
const RowKernels kScalarRowKernels = kKernels;
}  // namespace jfpx::inline JFPX_ABI::x86
