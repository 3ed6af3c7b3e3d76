/// Overlaps of a solid with bodies, by the pair tests of contacts.
#pragma once

#include "src/world/bodies/body_store.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// The deepest contact of a solid with a body; of equally deep ones, that of the first sub-shape
/// and of the triangle with the lowest number.
struct DeepestContact {
  bool touches = false;
  Vec3 point;              ///< [m], world, middle of the overlap
  Vec3 normal;             ///< unit, from the body to the solid
  Real distance = 0;       ///< [m], <= 0
  std::uint32_t part = 0;  ///< as in ShapeHit
};

/// A solid of a query.
struct QuerySolid {
  SolidShape shape;
  Transform pose;
  Vec3 half_extents;  ///< [m], of its bounds about the origin of the pose

  QuerySolid(const SolidShape& solid, const Transform& at);
  /// Whether the solid touches a body.
  bool touches(const BodyStore& bodies, std::uint32_t body) const;
  /// Only for sub-shapes whose bounds overlap those of the solid.
  DeepestContact deepest_contact(const BodyStore& bodies, std::uint32_t body) const;
  /// The same for a mesh or a heightfield.
  template <class S>
  DeepestContact deepest_contact(const S& mesh, const Transform& at) const;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
