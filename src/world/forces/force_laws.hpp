/// Force laws as functions of plain numbers (thesis 4.4.3).
#pragma once

#include <jfpx/math.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Drag at `velocity` relative to a medium.
JFPX_HD inline Vec3 drag_force(const Vec3& velocity, Real linear, Real quadratic) {
  return velocity * -(linear + quadratic * length(velocity));
}

/// Force of a spring on its end a; end b receives the opposite. A spring pulls if it is longer than
/// its rest length and pushes if it is shorter (erratum E21). A slack spring never pushes.
/// @param span     from end b to end a
/// @param velocity of end a relative to end b
JFPX_HD inline Vec3 spring_force(const Vec3& span, const Vec3& velocity, Real stiffness,
                                 Real damping, Real rest_length, bool slack) {
  const Real now = length(span);
  if (!(now > kEpsilon)) return {};
  const Vec3 axis = span * (Real(1) / now);
  const Real stretch = now - rest_length;
  if (slack && !(stretch > 0)) return {};
  const Real pull = stiffness * stretch + damping * dot(velocity, axis);
  if (slack && !(pull > 0)) return {};
  return axis * -pull;
}

/// Fraction of an explosion's peak force at a distance from its centre, `age` after its start.
JFPX_HD inline Real blast(Real distance, Real age, Real speed, Real thickness, Real duration) {
  if (!(age >= 0 && age < duration)) return 0;
  const Real from_middle = absolute(distance - speed * age) / (thickness / 2);
  if (!(from_middle < 1)) return 0;
  return (1 - from_middle) * (1 - age / duration);
}

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
