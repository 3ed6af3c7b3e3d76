/// The solids that a body consists of, for forces.
#pragma once

#include "src/collide/shapes.hpp"

#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// A solid: the shape of a body, or a part of a compound.
struct SolidPart {
  std::uint32_t kind = 0;  ///< detail::kSolidKind
  detail::Solid solid;
  std::uint32_t in_compound = 0;  ///< 1: a part of a compound
  Transform local = {};           ///< pose of a part of a compound, in body axes

  /// Calls visit(shape).
  template <class Visit>
  JFPX_HD void visit(const Visit& visit) const {
    detail::SolidKinds::visit(kind, [&](auto type) { visit(from_solid(solid, type)); });
  }
};

/// Calls visit(part) for the shape of a body, or for each part of a compound in order. Half-spaces
/// and planes have none.
template <class Visit>
void for_each_solid_part(const Shape& shape, const Visit& visit) {
  detail::for_each_part(shape, [&](const auto& solid, const CompoundPart* part, std::uint32_t) {
    using S = std::decay_t<decltype(solid)>;
    if constexpr (detail::kIsSolid<S>) {
      SolidPart result{.kind = detail::kSolidKind<S>, .solid = detail::to_solid(solid)};
      if (part != nullptr) {
        result.in_compound = 1;
        result.local = make_transform(part->orientation, part->position);
      }
      visit(result);
    }
  });
}

}  // namespace JFPX_ABI
}  // namespace jfpx
