/// Spheres, boxes and walls of all bodies, in flat arrays for the pair tests.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/world/body_store.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A sub-shape is the shape of a simple body, or one part of a compound. Sub-shapes are numbered in
/// this order: spheres, movable boxes, boxes of mass 0 (also kinematic ones), half-spaces and
/// planes; within each kind by body, then by part.
class SubShapeTable {
 public:
  using SubShape = std::uint32_t;

  struct PosedBox {
    Box box;
    Transform pose;
  };
  struct Wall {
    HalfSpace solid;  ///< for a plane: its back side
    bool two_sided = false;

    /// The solid half-space for a body whose centre of mass is at `centre`.
    HalfSpace solid_for(const Vec3& centre) const {
      if (!two_sided || !(dot(solid.normal, centre) < solid.offset)) return solid;
      return {-solid.normal, -solid.offset};
    }
  };

  /// Must be called after a body was added or removed, or got another state by set_state().
  void set_bodies(const BodyStore& bodies);
  /// Updates the poses of all sub-shapes from their bodies, except immovable boxes and walls.
  /// @param pool null: in the calling thread
  void update_poses(const BodyStore& bodies, ThreadPool* pool = nullptr);

  std::uint32_t body(SubShape sub_shape) const { return body_[sub_shape]; }
  /// Index of the sub-shape in its compound; 0 in a simple body.
  std::uint32_t part(SubShape sub_shape) const { return number_[sub_shape]; }
  bool is_sphere(SubShape sub_shape) const { return sub_shape < sphere_count_; }
  bool is_wall(SubShape sub_shape) const { return sub_shape >= bounds_.size(); }
  const PosedBox& box(SubShape sub_shape) const { return boxes_[sub_shape - sphere_count_]; }
  const Wall& wall(SubShape sub_shape) const { return walls_[sub_shape - bounds_.size()]; }
  /// The sphere itself, or the bounding sphere of the box.
  const SphereInstance& bounds(SubShape sub_shape) const { return bounds_[sub_shape]; }

  /// Bounding spheres of all spheres and movable boxes.
  std::span<const SphereInstance> bounds() const { return {bounds_.data(), fixed_begin_}; }
  /// Number of spheres and boxes: all sub-shapes but walls.
  SubShape bounded_size() const { return static_cast<SubShape>(bounds_.size()); }
  SubShape size() const { return static_cast<SubShape>(body_.size()); }
  SubShape fixed_begin() const { return fixed_begin_; }  ///< the first box or wall of mass 0

 private:
  void update_pose(const BodyStore& bodies, SubShape sub_shape);

  SubShape sphere_count_ = 0, fixed_begin_ = 0;
  std::vector<std::uint32_t> body_;     ///< by sub-shape
  std::vector<std::uint32_t> number_;   ///< by sub-shape: its index in the compound
  std::vector<SphereInstance> bounds_;  ///< of spheres and boxes
  std::vector<PosedBox> boxes_;
  std::vector<Wall> walls_;
  std::vector<std::uint32_t> part_;  ///< by sphere or box: 0, or 1 + index in local_
  std::vector<Transform> local_;     ///< poses of parts, in body axes
  std::vector<SubShape> kinematic_;  ///< kinematic boxes
};

}  // namespace JFPX_ABI
}  // namespace jfpx
