/// How the bodies of a scene look, and where they stand: what does not change while it runs.
#pragma once

#include <jfpx/scene.hpp>

#include "src/viewer/bounds.hpp"
#include "src/viewer/drawing.hpp"
#include "src/viewer/moment.hpp"

#include <optional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// What the colour of a body says.
enum class Colouring : std::uint8_t { bodies, speed, sleep, penetration, contacts, islands };
inline constexpr const char* kColouringNames[] = {"bodies",      "speed",    "sleep",
                                                  "penetration", "contacts", "islands"};

class Stage {
 public:
  explicit Stage(Scene scene);

  /// Adds bodies, grounds and walls. `from` and `to` are two moments of the run, and `share` says
  /// how far the picture is between them: 0 to 1.
  void draw(const Moment& from, const Moment& to, Real share, Colouring colouring,
            Drawing* drawing) const;
  /// Adds normals and points of contacts as lines; `red` draws them as faults.
  void draw_contacts(const std::vector<Contact>& contacts, bool red, Drawing* drawing) const;

  /// Adds arrows for what pushed the bodies in the step between two moments.
  void draw_forces(const Moment& before, const Moment& now, Drawing* drawing) const;

  /// Adds a frame around one body where draw() shows it.
  void draw_mark(const Moment& from, const Moment& to, Real share, std::uint32_t body,
                 Drawing* drawing) const;

  /// The movable body that a ray meets first where draw() shows them; the direction is unit.
  std::optional<std::uint32_t> pick(const Moment& from, const Moment& to, Real share,
                                    const Vec3& eye, const Vec3& direction) const;
  /// The colour of a body where bodies are told apart.
  Paint paint(std::uint32_t body) const;
  /// Radius of a typical movable body [m].
  Real body_size() const { return body_size_; }
  /// Radius that nine in ten movable bodies do not exceed [m].
  Real large_size() const { return large_size_; }
  const Scene& scene() const { return scene_; }
  /// Where the movable bodies are.
  Bounds bounds(const std::vector<BodyState>& states) const { return survey_.bounds(states); }

 private:
  /// What a picture needs to know of a body: far less than its definition, which of a hundred
  /// thousand bodies fills no cache.
  struct Look {
    enum class Kind : std::uint8_t { hidden, still, moving, moving_ball } kind;
    Paint paint;
    Real radius = 0;  ///< of a moving ball
  };

  /// A large upright box that the crowd is before: the side of a room.
  struct Wall {
    std::uint32_t body;
    int axis;        ///< across it
    bool low;        ///< the room lies above it on the axis
    Real face;       ///< where the room ends
    Real thickness;  ///< that is drawn; of a pane 0
  };

  void find_room();
  std::optional<Wall> wall_of(std::uint32_t body, const Bounds& bounds) const;
  void draw_wall(const Wall& wall, Drawing* drawing) const;
  Look look_of(std::uint32_t body) const;
  void draw_shape(const Shape& shape, const BodyState& at, Paint paint, Drawing* drawing) const;
  void draw_still(const Bounds& bounds, Drawing* drawing) const;

  Scene scene_;
  Survey survey_;
  std::vector<Look> looks_;  ///< of each body
  Real body_size_ = Real(0.5);
  Real large_size_ = Real(0.5);
  std::vector<std::uint32_t> obstacles_;  ///< immovable bodies that are drawn as they are
  std::vector<Wall> walls_;               ///< at most one on each side of the room
  Aabb room_;                             ///< inside of the walls; endless where there is none
  Real lowest_ = 0;                       ///< of what stands still: the ground lies below it
  bool falls_ = false;                    ///< something has a weight
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
