/// Sub-shapes of all bodies, in flat arrays for the pair tests.
#pragma once

#include "src/base/thread_pool.hpp"
#include "src/world/bodies/body_store.hpp"
#include "src/world/bodies/sub_shape_view.hpp"

#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A sub-shape is the shape of a simple body, or one part of a compound. Sub-shapes are numbered by
/// the ranges of SubShapeRanges, and within each range by body, then by part.
class SubShapeTable {
 public:
  using SubShape = std::uint32_t;

  /// Must be called after a body was added or removed, or got another state by set_state().
  void set_bodies(const BodyStore& bodies) { set_bodies(bodies, bodies.ids()); }
  /// Builds the table from a subset of the bodies. @param ids sorted by index
  void set_bodies(const BodyStore& bodies, std::span<const BodyId> ids);
  /// Updates the poses of all sub-shapes from their bodies, except immovable solids and walls.
  /// @param pool null: in the calling thread
  JFPX_API void update_poses(const BodyStore& bodies, ThreadPool* pool = nullptr);
  /// The same for some of the sub-shapes before SubShapeRanges::fixed_begin().
  void update_poses(const BodyStore& bodies, std::span<const SubShape> sub_shapes,
                    ThreadPool* pool);

  /// Valid until set_bodies().
  JFPX_API SubShapeView view();
  const SubShapeRanges& ranges() const { return ranges_; }
  /// Bounding spheres of all spheres and of the other solids of movable bodies.
  std::span<const SphereInstance> bounds() const { return {bounds_.data(), ranges_.fixed_begin()}; }
  /// Solids of kinematic bodies other than spheres, ascending.
  std::span<const SubShape> kinematic() const { return kinematic_; }
  std::span<const detail::MeshView> meshes() const { return meshes_; }
  /// Number of parts of compounds.
  std::size_t part_count() const { return local_.size(); }

 private:
  SubShapeRanges ranges_;
  std::vector<std::uint32_t> body_;     ///< by sub-shape
  std::vector<std::uint32_t> number_;   ///< by sub-shape: its index in the compound
  std::vector<SphereInstance> bounds_;  ///< of solids and meshes
  std::vector<PosedSolid> solids_;      ///< of solids other than spheres, and boxes around meshes
  std::vector<detail::MeshView> meshes_;
  std::vector<Wall> walls_;
  std::vector<std::uint32_t> part_;  ///< by solid: 0, or 1 + index in local_
  std::vector<Transform> local_;     ///< poses of parts, in body axes
  std::vector<SubShape> kinematic_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
