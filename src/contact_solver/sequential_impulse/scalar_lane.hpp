/// Scalar arithmetic for contact_rows.hpp: one row at a time.
#pragma once

#include <jfpx/math.hpp>

#include "src/contact_solver/sequential_impulse/row_layout.hpp"

#include <cstddef>

namespace jfpx {
inline namespace JFPX_ABI {
namespace rows {

/// One lane. Bodies are stored in arrays and addressed by their ids.
struct OneLane {
  static constexpr int kLanes = 1;
  using Vec = Real;
  using Mask = bool;
  using Id = std::int32_t;
  JFPX_HD static Vec set(Real v) { return v; }
  JFPX_HD static Vec load(const Real* p) { return *p; }
  JFPX_HD static void store(Real* p, Vec v) { *p = v; }
  JFPX_HD static Vec negate(Vec v) { return -v; }
  JFPX_HD static Vec absolute(Vec v) { return jfpx::absolute(v); }
  JFPX_HD static Vec square_root(Vec v) { return jfpx::square_root(v); }
  JFPX_HD static Vec select(Mask m, Vec a, Vec b) { return m ? a : b; }
  JFPX_HD static Vec keep(Mask m, Vec v) { return m ? v : Real(0); }
  JFPX_HD static Mask less(Vec a, Vec b) { return a < b; }
  JFPX_HD static Mask less_equal(Vec a, Vec b) { return a <= b; }
  JFPX_HD static Mask differs(Vec a, Vec b) { return a != b; }
  JFPX_HD static Mask unordered(Vec v) { return v != v; }
  JFPX_HD static Mask both(Mask a, Mask b) { return a && b; }
  JFPX_HD static Mask either(Mask a, Mask b) { return a || b; }
  JFPX_HD static Mask negate_mask(Mask m) { return !m; }
  JFPX_HD static Mask always() { return true; }
  JFPX_HD static Mask never() { return false; }
  JFPX_HD static bool any(Mask m) { return m; }
  JFPX_HD static unsigned bits(Mask m) { return m ? 1 : 0; }
  JFPX_HD static Mask is_real(const Id* ids) { return *ids != kFixedBody; }
  /// Computed in double and rounded once, as Bullet does.
  JFPX_HD static Vec residual(Vec impulse, Vec inverse) {
    return static_cast<Real>(static_cast<double>(impulse) * (1. / static_cast<double>(inverse)));
  }
  JFPX_HD static void gather4(const Real* base, const Id* ids, int stride, Vec* out) {
    const Real* p = base + std::ptrdiff_t{*ids ^ (*ids >> 31)} * stride;
    for (int k = 0; k < 4; ++k) out[k] = p[k];
  }
  JFPX_HD static void scatter8(Real* base, const Id* ids, int stride, const Vec* u, const Vec* w) {
    if (*ids < 0) return;
    Real* p = base + std::ptrdiff_t{*ids} * stride;
    for (int k = 0; k < 4; ++k) {
      p[k] = u[k];
      p[4 + k] = w[k];
    }
  }
};

}  // namespace rows
}  // namespace JFPX_ABI
}  // namespace jfpx
