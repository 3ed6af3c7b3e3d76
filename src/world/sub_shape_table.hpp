/// Spheres, boxes and walls of all bodies, in flat arrays for the pair tests.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/world/body_store.hpp"
#include "src/world/sub_shape_view.hpp"

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

  /// Must be called after a body was added or removed, or got another state by set_state().
  void set_bodies(const BodyStore& bodies) { set_bodies(bodies, bodies.ids()); }
  /// Makes the table of some of the bodies. @param ids sorted by index
  void set_bodies(const BodyStore& bodies, std::span<const BodyId> ids);
  /// Updates the poses of all sub-shapes from their bodies, except immovable boxes and walls.
  /// @param pool null: in the calling thread
  void update_poses(const BodyStore& bodies, ThreadPool* pool = nullptr);

  /// Valid until set_bodies().
  SubShapeView view();
  /// Bounding spheres of all spheres and movable boxes.
  std::span<const SphereInstance> bounds() const { return {bounds_.data(), fixed_begin_}; }
  /// Number of spheres and boxes: all sub-shapes but walls.
  SubShape bounded_size() const { return static_cast<SubShape>(bounds_.size()); }
  SubShape size() const { return static_cast<SubShape>(body_.size()); }
  SubShape fixed_begin() const { return fixed_begin_; }  ///< the first box or wall of mass 0
  /// Number of parts of compounds.
  std::size_t part_count() const { return local_.size(); }

 private:
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
