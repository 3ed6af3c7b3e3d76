/// The solids that a body consists of.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {

/// A sphere or a box: the shape of a body, or a part of a compound.
struct SolidPart {
  Real radius = 0;                ///< [m]; 0: a box
  Box box = {};                   ///< unless it is a sphere
  std::uint32_t in_compound = 0;  ///< 1: a part of a compound
  Transform local = {};           ///< pose of a part of a compound, in body axes
};

/// Calls visit(part) for the shape of a body, or for each part of a compound in order. Half-spaces
/// and planes have none.
template <class Visit>
void for_each_solid_part(const Shape& shape, const Visit& visit) {
  if (const auto* sphere = std::get_if<Sphere>(&shape)) {
    visit(SolidPart{.radius = sphere->radius});
  } else if (const auto* box = std::get_if<Box>(&shape)) {
    visit(SolidPart{.box = *box});
  } else if (const auto* compound = std::get_if<Compound>(&shape)) {
    for (const CompoundPart& part : compound->parts) {
      SolidPart solid{.in_compound = 1, .local = make_transform(part.orientation, part.position)};
      if (const auto* ball = std::get_if<Sphere>(&part.shape)) {
        solid.radius = ball->radius;
      } else {
        solid.box = std::get<Box>(part.shape);
      }
      visit(solid);
    }
  }
}

}  // namespace JFPX_ABI
}  // namespace jfpx
