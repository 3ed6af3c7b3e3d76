/// Camera: view for the renderer, projection, and motion.
#pragma once

#include <jfpx/math.hpp>

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Position, axes, field of view and clip planes of a camera.
struct View {
  Vec3 eye;
  Vec3 right{1, 0, 0}, up{0, 1, 0}, forward{0, 0, -1};  ///< unit, orthogonal
  Real fov_y = Real(0.8);                               ///< full vertical angle [rad]
  /// [m]; the renderer moves the near plane closer if it draws something in front of it.
  Real near_plane = Real(0.1), far_plane = 1000;
};

/// Smallest ratio of the near to the far plane, limited by the resolution of the depth buffer.
inline constexpr Real kLeastNear = Real(2e-5);

/// Position in the picture, in pixels from the upper left corner.
struct Pixel {
  Real x = 0, y = 0;
};
/// Projects a point; empty if it lies behind the eye.
std::optional<Pixel> project(const View& view, const Vec3& point, int width, int height);
/// Unit direction of the ray through a pixel.
Vec3 ray_through(const View& view, Real x, Real y, int width, int height);

/// A camera that walks, turns, and orbits a focus. Angles are in radians.
class Camera {
 public:
  /// Limit of the pitch, which keeps the camera upright (erratum E41).
  static constexpr Real kMaxPitch = Real(89) * kPi / 180;

  void look_at(const Vec3& eye, const Vec3& target);
  /// Adds to both angles. Positive yaw turns left, positive pitch turns up.
  void turn(Real yaw, Real pitch);
  /// Moves along the right axis, the vertical, and the forward axis of the camera [m].
  void move(Real right, Real up, Real forward);
  /// Orbits the focus, which stays at the centre of the picture. Angles of 0 change no bit.
  void orbit(Real yaw, Real pitch);
  /// Multiplies the distance to the focus. A factor of 1 changes no bit.
  void zoom(Real factor);

  const Vec3& eye() const { return eye_; }
  Vec3 focus() const { return eye_ + forward() * distance_; }
  Real yaw() const { return yaw_; }
  Real pitch() const { return pitch_; }
  Real distance() const { return distance_; }
  Vec3 forward() const;
  /// The view, with clip planes around a ball at `centre` and some of the ground behind it.
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
