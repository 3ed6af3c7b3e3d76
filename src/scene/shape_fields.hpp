/// Fields of shapes; see field.hpp.
#pragma once

#include <jfpx/shape.hpp>

#include "src/scene/field.hpp"

#include <type_traits>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

void each_field(Is<Sphere> auto& sphere, const auto& visit) {
  auto& [radius] = sphere;
  visit(required_field("radius", kSize), radius);
}
void each_field(Is<Box> auto& box, const auto& visit) {
  auto& [half_extents] = box;
  visit(required_field("half_extents", kSizes), half_extents);
}
void each_field(Is<Capsule> auto& capsule, const auto& visit) {
  auto& [radius, half_height] = capsule;
  visit(required_field("radius", kSize), radius);
  visit(required_field("half_height", kSize), half_height);
}
void each_field(Is<Cylinder> auto& cylinder, const auto& visit) {
  auto& [radius, half_height] = cylinder;
  visit(required_field("radius", kSize), radius);
  visit(required_field("half_height", kSize), half_height);
}
void each_field(Is<Cone> auto& cone, const auto& visit) {
  auto& [radius, half_height] = cone;
  visit(required_field("radius", kSize), radius);
  visit(required_field("half_height", kSize), half_height);
}
void each_field(Is<HalfSpace> auto& half_space, const auto& visit) {
  auto& [normal, offset] = half_space;
  visit(required_field("normal", kUnitVector), normal);
  visit(required_field("offset", kInWorld), offset);
}
void each_field(Is<Plane> auto& plane, const auto& visit) {
  auto& [normal, offset] = plane;
  visit(required_field("normal", kUnitVector), normal);
  visit(required_field("offset", kInWorld), offset);
}
/// Without faces, the hull is that of the vertices. The constructor checks both.
void each_field(Is<Hull> auto& hull, const auto& visit) {
  std::vector<Vec3> vertices(hull.vertices().begin(), hull.vertices().end());
  std::vector<std::vector<std::uint32_t>> faces;
  for (const HullFace& face : hull.faces()) {
    faces.emplace_back(hull.corners(face).begin(), hull.corners(face).end());
  }
  if constexpr (std::is_const_v<std::remove_reference_t<decltype(hull)>>) {
    visit(required_field("vertices"), std::as_const(vertices));
    visit(field("faces"), std::as_const(faces));
  } else {
    faces.clear();
    visit(required_field("vertices"), vertices);
    visit(field("faces"), faces);
    hull = faces.empty() ? Hull(vertices) : Hull(vertices, faces);
  }
}
/// The constructor of the mesh checks the vertices, and the indices of the triangles.
void each_field(Is<TriangleMesh> auto& mesh, const auto& visit) {
  constexpr bool kIsRead = !std::is_const_v<std::remove_reference_t<decltype(mesh)>>;
  std::conditional_t<kIsRead, TriangleMeshDef, const TriangleMeshDef&> def = mesh.def();
  auto& [vertices, triangles, two_sided] = def;
  visit(required_field("vertices"), vertices);
  visit(required_field("triangles", NotEmpty{"at least one triangle"}), triangles);
  visit(field("two_sided"), two_sided);
  if constexpr (kIsRead) mesh = TriangleMesh(std::move(def));
}
/// The constructor of the heightfield checks all fields.
void each_field(Is<Heightfield> auto& heightfield, const auto& visit) {
  constexpr bool kIsRead = !std::is_const_v<std::remove_reference_t<decltype(heightfield)>>;
  std::conditional_t<kIsRead, HeightfieldDef, const HeightfieldDef&> def = heightfield.def();
  auto& [columns, rows, spacing_x, spacing_z, heights, holes, two_sided] = def;
  visit(required_field("columns"), columns);
  visit(required_field("rows"), rows);
  visit(required_field("spacing_x"), spacing_x);
  visit(required_field("spacing_z"), spacing_z);
  visit(required_field("heights", NotEmpty{"at least four heights"}), heights);
  visit(field("holes"), holes);
  visit(field("two_sided"), two_sided);
  if constexpr (kIsRead) heightfield = Heightfield(std::move(def));
}
void each_field(Is<CompoundPart> auto& part, const auto& visit) {
  auto& [shape, position, orientation, density] = part;
  visit(required_field("shape"), shape);
  visit(field("position", kInWorld), position);
  visit(field("orientation", kUnitQuaternion), orientation);
  visit(field("density", kSize), density);
}
void each_field(Is<Compound> auto& compound, const auto& visit) {
  auto& [parts] = compound;
  visit(required_field("parts", NotEmpty{"at least one solid"}), parts);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
