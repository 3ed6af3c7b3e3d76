/// Transfer of impulses from a contact of the last step to the same contact of this step.
#pragma once

#include "src/contact_solver/soft_step/contact_set.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// The impulse at the start of the next step. RowSetup projects its friction onto the new tangent
/// plane, so that the impulses of contacts without a row (of sleeping bodies) do not change.
JFPX_HD inline KeptImpulse at_start_of_step(const KeptImpulse& kept) {
  return {kept.friction, kept.normal > 0 ? kept.normal : Real(0)};
}

/// Adds the impulses of a manifold of the last step to those of the same manifold of this step.
/// Each point gets the impulse of the point with the same feature. The impulse of an old point
/// without a matching feature is added to the nearest new point. Rounding decides the features
/// where edges of two boxes coincide, and a stack that occasionally lost impulses would not come to
/// rest.
/// @param m,before indices of the manifolds
JFPX_HD inline void match_points(const ContactView& now, std::uint32_t m, const ContactView& last,
                                 std::uint32_t before) {
  constexpr Real kSameDirection = Real(0.9);
  const ManifoldInput& contact = now.manifolds[m];
  const ManifoldInput& old_contact = last.manifolds[before];
  const bool is_same_side = dot(contact.normal, old_contact.normal) > kSameDirection;
  const std::uint32_t end = contact.first + contact.count;
  for (std::uint32_t q = old_contact.first; q < old_contact.first + old_contact.count; ++q) {
    const PointInput& old = last.points[q];
    std::uint32_t next = contact.first;
    while (next < end && now.points[next].feature != old.feature) ++next;
    if (next == end && is_same_side) {
      Real nearest = kMaxReal;
      for (std::uint32_t p = contact.first; p < end; ++p) {
        const Real distance2 = length_squared(now.points[p].arm_a - old.arm_a);
        if (distance2 < nearest) nearest = distance2, next = p;
      }
    }
    if (next == end) continue;
    const KeptImpulse kept = at_start_of_step(last.impulses[last.sphere_count + q]);
    KeptImpulse& impulse = now.impulses[now.sphere_count + next];
    impulse.friction += kept.friction;
    impulse.normal += kept.normal;
  }
}

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
