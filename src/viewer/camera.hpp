/// Where the picture is taken from, and how the camera moves.
#pragma once

#include <jfpx/math.hpp>

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// An eye with axes: what the renderer needs.
struct View {
  Vec3 eye;
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< unit, orthogonal
  Real fov_y = Real(0.8);                               ///< [rad], whole vertical angle
  /// [m]; the renderer takes the near one back where what it draws is nearer.
  Real near_plane = Real(0.1), far_plane = 1000;
};

/// The near plane stays as far out as this share of the far one: depth has so many digits.
inline constexpr Real kLeastNear = Real(2e-5);

/// Where a point appears, in pixels from the upper left corner; nothing if it is behind the eye.
struct Pixel {
  Real x = 0, y = 0;
};
std::optional<Pixel> project(const View& view, const Vec3& point, int width, int height);
/// The direction of the ray through a pixel, unit.
Vec3 ray_through(const View& view, Real x, Real y, int width, int height);

/// A camera that walks, looks around, and circles a focus. Angles in radians.
class Camera {
 public:
  /// Pitch is kept within this, so that up stays up (erratum E41).
  static constexpr Real kMaxPitch = Real(89) * kPi / 180;

  void look_at(const Vec3& eye, const Vec3& target);
  /// Adds to both angles; positive yaw turns left, positive pitch up.
  void turn(Real yaw, Real pitch);
  /// Moves along its own axes [m].
  void move(Real right, Real up, Real forward);
  /// Circles the focus by the angles; the focus stays in the middle. None moves no bit.
  void orbit(Real yaw, Real pitch);
  /// Multiplies the distance to the focus; 1 moves no bit.
  void zoom(Real factor);

  const Vec3& eye() const { return eye_; }
  Vec3 focus() const { return eye_ + forward() * distance_; }
  Real yaw() const { return yaw_; }
  Real pitch() const { return pitch_; }
  Real distance() const { return distance_; }
  Vec3 forward() const;
  /// The clip planes enclose a ball around `centre`, and the ground some way beyond it.
  View view(const Vec3& centre, Real radius) const;

  friend bool operator==(const Camera&, const Camera&) = default;

  Real fov_y = Real(0.72);

 private:
  Vec3 eye_{0, 2, 8};
  Real yaw_ = 0, pitch_ = 0;
  Real distance_ = 8;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
