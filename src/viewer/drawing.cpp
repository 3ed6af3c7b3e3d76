/// Content of a picture: lists of instances in the layout of the GPU buffers.
#include "src/viewer/drawing.hpp"

#include "src/viewer/mesh_geometry.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

void put(float (&out)[3], const Vec3& v) {
  for (int i = 0; i < 3; ++i) out[i] = static_cast<float>(v[i]);
}
void put(float (&out)[4], const Quat& q) {
  out[0] = static_cast<float>(q.x);
  out[1] = static_cast<float>(q.y);
  out[2] = static_cast<float>(q.z);
  out[3] = static_cast<float>(q.w);
}

/// Distance from the eye, which is the origin, to a box.
float distance_to(const BoxItem& item) {
  const Vec3 centre{Real(item.centre[0]), Real(item.centre[1]), Real(item.centre[2])};
  const Quat turn{Real(item.turn[3]), Real(item.turn[0]), Real(item.turn[1]), Real(item.turn[2])};
  const Vec3 eye = transform_transpose(to_matrix(turn), -centre);
  Vec3 outside;
  for (int i = 0; i < 3; ++i) {
    outside[i] = std::max(std::fabs(eye[i]) - Real(item.half_extents[i]), Real(0));
  }
  return static_cast<float>(length(outside));
}

}  // namespace

float Drawing::nearest_surface() const {
  float nearest = HUGE_VALF;
  for (const auto* items : {&boxes_, &glass_}) {
    for (const BoxItem& item : *items) nearest = std::min(nearest, distance_to(item));
  }
  for (const RoundedItem& item : rounded_) nearest = std::min(nearest, distance_to(item.box));
  for (const PlacedMesh& placed : meshes_) nearest = std::min(nearest, placed.distance);
  return nearest;
}

void Drawing::add_sphere(const Vec3& centre, Real radius, const Quat& turn, Paint paint) {
  spheres_.push_back(make_sphere_item(centre - eye_, radius, turn, paint));
}

BoxItem Drawing::box_item(const Vec3& centre, const Vec3& half_extents, const Quat& turn,
                          Paint paint) const {
  BoxItem item;
  put(item.centre, centre - eye_);
  put(item.half_extents, half_extents);
  put(item.turn, turn);
  item.paint = paint;
  return item;
}

void Drawing::add_box(const Vec3& centre, const Vec3& half_extents, const Quat& turn, Paint paint) {
  auto& items = paint.pattern == Pattern::glass ? glass_ : boxes_;
  items.push_back(box_item(centre, half_extents, turn, paint));
}

void Drawing::add_rounded(const Vec3& centre, const Vec3& half_extents, Real radius,
                          const Quat& turn, Paint paint) {
  const Vec3 outer = half_extents + Vec3{radius, radius, radius};
  rounded_.push_back({box_item(centre, outer, turn, paint), static_cast<float>(radius)});
}

void Drawing::add_mesh(const TriangleMesh& mesh, const Vec3& position, const Quat& turn, Real cell,
                       Paint paint) {
  if (!has_surface(mesh)) return;
  const Mat3 basis = to_matrix(turn);
  const Vec3 centre = centre_of(mesh);
  MeshItem item;
  put(item.centre, position - eye_ + basis * centre);
  put(item.turn, turn);
  item.paint = paint;
  for (int i = 0; i < 3; ++i) {
    item.phase[i] = static_cast<float>(std::remainder(centre[i], cell * 100));
  }
  item.cell = static_cast<float>(cell);
  const Vec3 eye = transform_transpose(basis, eye_ - position);
  meshes_.push_back({mesh, item, static_cast<float>(distance_to(mesh, eye))});
}

void Drawing::add_line(const Vec3& from, const Vec3& to, Paint paint, float width,
                       std::uint8_t alpha) {
  LineItem& item = lines_.emplace_back();
  put(item.from, from - eye_);
  put(item.to, to - eye_);
  item.rgba[0] = paint.r;
  item.rgba[1] = paint.g;
  item.rgba[2] = paint.b;
  item.rgba[3] = alpha;
  item.width = width;
}

void Drawing::add_ground(const Vec3& normal, Real offset, Real cell, Paint paint) {
  // The axes of the grid are parallel to those of the world if the plane is horizontal.
  const Vec3 n = normalized(normal);
  const Vec3 hint = std::fabs(n.x) < Real(0.9) ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const Vec3 u = normalized(hint - n * dot(hint, n));
  const Vec3 v = cross(n, u);
  GroundItem& item = grounds_.emplace_back();
  put(item.normal, n);
  item.height = static_cast<float>(dot(n, eye_) - offset);
  put(item.u, u);
  put(item.v, v);
  const Real period = cell * 100;
  item.eye_u = static_cast<float>(std::remainder(dot(u, eye_), period));
  item.eye_v = static_cast<float>(std::remainder(dot(v, eye_), period));
  item.paint = paint;
  item.cell = static_cast<float>(cell);
}

void Drawing::set_bounds(const Vec3& centre, Real radius) {
  bounds_centre_ = centre;
  bounds_radius_ = radius;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
