/// Drawing and picking of the bodies of a scene.
#pragma once

#include <jfpx/scene.hpp>

#include "src/viewer/bounds.hpp"
#include "src/viewer/colouring.hpp"
#include "src/viewer/drawing.hpp"
#include "src/viewer/run_state.hpp"

#include <optional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Adds the bodies of a scene to a drawing. Stores the properties that are constant during a run.
class ScenePainter {
 public:
  explicit ScenePainter(Scene scene);

  /// Adds bodies, grounds and walls, interpolated between two states of the run.
  /// @param share position of the picture between the states of a run, in [0, 1]
  void draw(const RunState& from, const RunState& to, Real share, Colouring colouring,
            Drawing* drawing) const;
  /// Adds grounds, walls and immovable bodies only. @param bounds of the movable bodies
  void draw_immovable(const Bounds& bounds, Drawing* drawing) const;
  /// Adds the normals and points of contacts as lines. @param red draws them as errors
  void draw_contacts(const std::vector<Contact>& contacts, bool red, Drawing* drawing) const;

  /// Adds arrows for the forces on the bodies in the step between two states of a run.
  void draw_forces(const RunState& before, const RunState& now, Drawing* drawing) const;

  /// Adds a wireframe box around one body at its drawn position.
  void draw_mark(const RunState& from, const RunState& to, Real share, std::uint32_t body,
                 Drawing* drawing) const;

  /// The first movable body that a ray hits at its drawn position. The direction is a unit vector.
  std::optional<std::uint32_t> pick(const RunState& from, const RunState& to, Real share,
                                    const Vec3& eye, const Vec3& direction) const;
  /// The colour of a body for Colouring::bodies.
  Paint paint(std::uint32_t body) const;
  /// Radius of a typical movable body [m].
  Real body_size() const { return body_size_; }
  /// Radius that 90 % of the movable bodies do not exceed [m].
  Real large_size() const { return large_size_; }
  const Scene& scene() const { return scene_; }
  /// Bounds of the movable bodies.
  Bounds bounds(const std::vector<BodyState>& states) const {
    return bounds_estimator_.bounds(states);
  }

 private:
  /// The properties of a body for drawing. Compact, so that those of a hundred thousand bodies fit
  /// into the cache.
  struct Appearance {
    enum class Kind : std::uint8_t { hidden, still, moving, moving_ball } kind;
    Paint paint;
    Real radius = 0;  ///< of a moving ball
  };

  /// A large axis-aligned box beside the movable bodies: a side of a room.
  struct Wall {
    std::uint32_t body;
    int axis;        ///< perpendicular to the wall
    bool low;        ///< the wall is at the lower end of the axis
    Real face;       ///< coordinate of the inner face
    Real thickness;  ///< drawn thickness; 0 for glass
  };

  void find_room();
  void find_terrain(const Bounds& bounds);
  std::optional<Wall> wall_of(std::uint32_t body, const Bounds& bounds) const;
  void draw_wall(const Wall& wall, Drawing* drawing) const;
  Appearance appearance_of(std::uint32_t body) const;
  void draw_shape(const Shape& shape, const BodyState& at, Paint paint, Drawing* drawing) const;
  void draw_still(const Bounds& bounds, Drawing* drawing) const;
  /// Adds a line between the anchors of each joint.
  void draw_joints(const RunState& from, const RunState& to, Real share, Drawing* drawing) const;

  Scene scene_;
  BoundsEstimator bounds_estimator_;
  std::vector<Appearance> appearances_;  ///< of each body
  Real body_size_ = Real(0.5);
  Real large_size_ = Real(0.5);
  std::vector<std::uint32_t> obstacles_;  ///< immovable bodies that are not walls
  std::vector<Wall> walls_;               ///< at most one on each side of the room
  Aabb room_;                             ///< inside of the walls; unbounded without a wall
  Real lowest_ = 0;                       ///< of the immovable bodies; the ground lies below
  Real lowest_mesh_ = kMaxReal;           ///< of the meshes; the ground lies below
  Real mesh_reach_ = 0;                   ///< farthest distance of a mesh from the bounds' centre
  bool falls_ = false;                    ///< a body has weight
  bool has_terrain_ = false;              ///< a mesh extends around the movable bodies
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
