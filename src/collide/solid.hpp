/// A bounded solid of any kind as one plain record, for arrays in host memory and on devices.
#pragma once

#include <jfpx/shape.hpp>

#include <cstdint>
#include <type_traits>
#include <variant>

namespace jfpx {
inline namespace JFPX_ABI {
namespace detail {

/// Name of a shape in the field "type" of the JSON of scenes. Specialized in each shape's header.
template <class S>
inline constexpr const char* kShapeName = nullptr;

/// Dimensions of a solid. The core is a point, a segment along the y axis or a box; the solid
/// consists of all points within `radius` of the core. A hull, a cylinder or a cone is inside its
/// core.
struct Solid {
  Vec3 half_extents;               ///< [m], of the core
  Real radius = 0;                 ///< [m]
  const HullView* hull = nullptr;  ///< of a hull, in the memory where the solid is
  friend bool operator==(const Solid&, const Solid&) = default;
};

template <class Variant>
struct KindsOf;
template <class... S>
struct KindsOf<std::variant<S...>> {
  static constexpr std::uint32_t kCount = sizeof...(S);
  /// Index of a kind.
  template <class Kind>
  static constexpr std::uint32_t index_of() {
    std::uint32_t index = 0, found = kCount;
    ((std::is_same_v<S, Kind> ? found = index++ : index++), ...);
    return found;
  }
  /// Calls f(std::type_identity<S>) for the kind with an index.
  template <class F>
  JFPX_HD static void visit(std::uint32_t kind, const F& f) {
    std::uint32_t index = 0;
    ((kind == index++ ? f(std::type_identity<S>()) : void()), ...);
  }
};

/// Kinds of solids, in the order of SolidShape. The sphere is the first.
using SolidKinds = KindsOf<SolidShape>;
template <class S>
inline constexpr std::uint32_t kSolidKind = SolidKinds::template index_of<S>();
static_assert(kSolidKind<Sphere> == 0);

/// Calls visit(shape, part, number) for the shape of a body, or for each part of a compound in
/// order. For a body that is not a compound, `part` is null and `number` is 0.
template <class Visit>
void for_each_part(const Shape& shape, const Visit& visit) {
  const auto visit_parts = [&](const auto& whole) {
    if constexpr (std::is_same_v<std::decay_t<decltype(whole)>, Compound>) {
      for (std::uint32_t i = 0; i < whole.parts.size(); ++i) {
        const CompoundPart& part = whole.parts[i];
        std::visit([&](const auto& solid) { visit(solid, &part, i); }, part.shape);
      }
    } else {
      visit(whole, static_cast<const CompoundPart*>(nullptr), 0u);
    }
  };
  std::visit(visit_parts, shape);
}

/// Whether a solid has flat faces. Contacts of flat faces of two such solids are recycled.
template <class S>
inline constexpr bool kHasFlatFaces = false;

/// Whether S is a solid, as opposed to a half-space, a plane or a mesh.
template <class S>
inline constexpr bool kIsSolid = kSolidKind<S> < SolidKinds::kCount;

/// Whether S is a surface of triangles, whose bodies have mass 0.
template <class S>
inline constexpr bool kIsMesh = std::is_same_v<S, TriangleMesh> || std::is_same_v<S, Heightfield>;
/// Whether S is infinite and ignores the pose of its body.
template <class S>
inline constexpr bool kIsWall = std::is_same_v<S, HalfSpace> || std::is_same_v<S, Plane>;

}  // namespace detail
}  // namespace JFPX_ABI
}  // namespace jfpx
