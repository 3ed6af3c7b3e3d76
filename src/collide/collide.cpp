/// Pair tests of jfpx/collide.hpp that are not inline.
#include <jfpx/collide.hpp>

#include "src/collide/shapes.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

constexpr detail::PairMotion kAtRest{{}, 0, 0, {}, {}};

Manifold touches_of(const detail::PairManifold& contact) {
  Manifold manifold;
  manifold.count = static_cast<int>(contact.touch_count);
  if (contact.touch_count > 0) manifold.normal = contact.normal;
  for (std::uint32_t i = 0; i < contact.touch_count; ++i) {
    const auto& [point, distance] = contact.touches[i];
    manifold.points[i] = {point, distance, i};
    if (distance < manifold.distance) manifold.distance = distance;
  }
  return manifold;
}

}  // namespace

Manifold collide(const Box& a, const Transform& pose_a, const Box& b, const Transform& pose_b) {
  return detail::collide_boxes(a, pose_a, b, pose_b);
}

Manifold collide(const SolidShape& a, const Transform& pose_a, const SolidShape& b,
                 const Transform& pose_b) {
  detail::PairManifold contact;
  const auto test = [&](const auto& first, const auto& second) {
    detail::find_contact_of_any(detail::instance(first, pose_a), detail::instance(second, pose_b),
                                kAtRest, &contact);
  };
  std::visit(test, a, b);
  return touches_of(contact);
}

Manifold collide(const SolidShape& solid, const Transform& pose, const HalfSpace& half_space) {
  detail::PairManifold contact;
  const auto test = [&](const auto& shape) {
    find_contact(detail::instance(shape, pose), half_space, kAtRest, &contact);
  };
  std::visit(test, solid);
  return touches_of(contact);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
