/// Content of a picture: lists of instances in the layout of the GPU buffers.
#pragma once

#include <jfpx/triangle_mesh.hpp>

#include "src/collide/shapes.hpp"
#include "src/viewer/surface_mesh.hpp"

#include <cstdint>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Appearance of a surface; the shaders use the numeric values.
enum class Pattern : std::uint8_t {
  plain,
  solid_ball,    ///< coloured, with an 8 at two poles
  striped_ball,  ///< coloured, with an 8 at two poles and white caps
  crate,
  wall,
  glass,
};

/// sRGB colour and pattern.
struct Paint {
  std::uint8_t r = 255, g = 255, b = 255;
  Pattern pattern = Pattern::plain;
  friend bool operator==(const Paint&, const Paint&) = default;
};

inline constexpr Paint kGroundPaint{124, 130, 138};

struct SphereItem {
  float centre[3], radius;
  float turn[4];  ///< x, y, z, w
  Paint paint;
};
/// @param centre relative to the eye
JFPX_HD inline SphereItem make_sphere_item(const Vec3& centre, Real radius, const Quat& turn,
                                           Paint paint) {
  return {
      {static_cast<float>(centre.x), static_cast<float>(centre.y), static_cast<float>(centre.z)},
      static_cast<float>(radius),
      {static_cast<float>(turn.x), static_cast<float>(turn.y), static_cast<float>(turn.z),
       static_cast<float>(turn.w)},
      paint};
}

struct BoxItem {
  float centre[3], half_extents[3];
  float turn[4];
  Paint paint;
};
/// A rounded box; `half_extents` include the radius.
struct RoundedItem {
  BoxItem box;
  float radius;
};
/// A placed triangle mesh.
struct MeshItem {
  float centre[3];  ///< of the bounds of the mesh
  float turn[4];
  Paint paint;
  float phase[3];  ///< coordinates of the centre in body axes, modulo 100 cells
  float cell;      ///< distance of the lines of Pattern::wall [m]
};
struct LineItem {
  float from[3], to[3];
  std::uint8_t rgba[4];
  float width;  ///< [Viewport::unit]
};
struct GroundItem {
  float normal[3], height;  ///< height of the eye above the plane
  float u[3], eye_u;        ///< an axis of the grid, and the coordinate of the eye on it
  float v[3], eye_v;
  Paint paint;
  float cell;  ///< [m]
};

struct PlacedMesh {
  TriangleMesh mesh;
  MeshItem item;
  float distance;  ///< of its nearest triangle from the eye [m]
};

class ResidentSpheres;

/// Content of one picture. Positions are given in world coordinates and stored relative to the eye,
/// to preserve precision far from the origin.
class Drawing {
 public:
  explicit Drawing(const Vec3& eye) : eye_(eye) {}

  /// Reserves memory for `count` spheres.
  void reserve_spheres(std::size_t count) { spheres_.reserve(count); }
  void add_sphere(const Vec3& centre, Real radius, const Quat& turn, Paint paint);
  /// Adds a box whose edges are rounded by `radius`: a capsule if only one half extent is not 0.
  void add_rounded(const Vec3& centre, const Vec3& half_extents, Real radius, const Quat& turn,
                   Paint paint);
  /// Adds a solid of any kind.
  template <class S>
  void add_solid(const S& solid, const Vec3& centre, const Quat& turn, Paint paint) {
    if constexpr (std::is_same_v<S, Sphere>) {
      add_sphere(centre, solid.radius, turn, paint);
    } else if constexpr (std::is_same_v<S, Box>) {
      add_box(centre, solid.half_extents, turn, paint);
    } else if constexpr (std::is_same_v<S, Hull>) {
      add_mesh(mesh_of(solid), centre, turn, 2 * solid.data().view.outer_radius, paint);
    } else if constexpr (jfpx::detail::Round<S>) {
      const jfpx::detail::Frustum frustum = jfpx::detail::to_frustum(solid);
      add_mesh(mesh_of(frustum), centre, turn, 2 * frustum.outer_radius(), paint);
    } else {
      const jfpx::detail::Solid rounded = jfpx::detail::to_solid(solid);
      add_rounded(centre, rounded.half_extents, rounded.radius, turn, paint);
    }
  }
  void add_box(const Vec3& centre, const Vec3& half_extents, const Quat& turn, Paint paint);
  /// Adds a triangle mesh. The drawing shares its data.
  /// @param cell distance of lines on its surface [m]
  void add_mesh(const TriangleMesh& mesh, const Vec3& position, const Quat& turn, Real cell,
                Paint paint);
  void add_line(const Vec3& from, const Vec3& to, Paint paint, float width,
                std::uint8_t alpha = 255);
  /// Adds the plane dot(normal, p) = offset with a grid; it is invisible from below.
  void add_ground(const Vec3& normal, Real offset, Real cell, Paint paint);
  /// Sets additional spheres; null for none. They are neither sorted nor clipped by distance.
  void set_resident(ResidentSpheres* spheres) { resident_ = spheres; }
  /// Sets a bounding sphere of all shadow casters.
  void set_bounds(const Vec3& centre, Real radius);
  /// Sets the typical size of a body, which is the radius of ambient occlusion [m].
  void set_detail(Real metres) { detail_ = static_cast<float>(metres); }

  const Vec3& eye() const { return eye_; }
  const std::vector<SphereItem>& spheres() const { return spheres_; }
  const std::vector<BoxItem>& boxes() const { return boxes_; }
  const std::vector<BoxItem>& glass() const { return glass_; }
  const std::vector<RoundedItem>& rounded() const { return rounded_; }
  /// Meshes that have a surface.
  const std::vector<PlacedMesh>& meshes() const { return meshes_; }
  /// Distance of the nearest box or triangle, including glass and rounded boxes, from the eye [m];
  /// infinite without any.
  float nearest_surface() const;
  const std::vector<LineItem>& lines() const { return lines_; }
  const std::vector<GroundItem>& grounds() const { return grounds_; }
  ResidentSpheres* resident() const { return resident_; }
  const Vec3& bounds_centre() const { return bounds_centre_; }
  Real bounds_radius() const { return bounds_radius_; }
  float detail() const { return detail_; }

 private:
  BoxItem box_item(const Vec3& centre, const Vec3& half_extents, const Quat& turn,
                   Paint paint) const;

  Vec3 eye_;
  std::vector<SphereItem> spheres_;
  std::vector<BoxItem> boxes_, glass_;
  std::vector<RoundedItem> rounded_;
  std::vector<PlacedMesh> meshes_;
  std::vector<LineItem> lines_;
  std::vector<GroundItem> grounds_;
  ResidentSpheres* resident_ = nullptr;
  Vec3 bounds_centre_;
  Real bounds_radius_ = 1;
  float detail_ = 1;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
