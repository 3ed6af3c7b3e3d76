/// Camera: view for the renderer, projection, and motion.
#include "src/viewer/camera.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

std::optional<Pixel> project(const View& view, const Vec3& point, int width, int height) {
  const Vec3 p = point - view.eye;
  const Real depth = dot(p, view.forward);
  if (!(depth > 0)) return std::nullopt;
  const Real scale = static_cast<Real>(height) / 2 / (std::tan(view.fov_y / 2) * depth);
  return Pixel{static_cast<Real>(width) / 2 + dot(p, view.right) * scale,
               static_cast<Real>(height) / 2 - dot(p, view.up) * scale};
}

Vec3 ray_through(const View& view, Real x, Real y, int width, int height) {
  const Real scale = std::tan(view.fov_y / 2) * 2 / static_cast<Real>(height);
  return normalized(view.forward + view.right * ((x - static_cast<Real>(width) / 2) * scale) +
                    view.up * ((static_cast<Real>(height) / 2 - y) * scale));
}

Vec3 Camera::forward() const {
  const Real level = std::cos(pitch_);
  return {-std::sin(yaw_) * level, std::sin(pitch_), -std::cos(yaw_) * level};
}

void Camera::look_at(const Vec3& eye, const Vec3& target) {
  eye_ = eye;
  distance_ = std::max(length(target - eye), Real(1e-3));
  const Vec3 d = (target - eye) * (1 / distance_);
  yaw_ = std::atan2(-d.x, -d.z);
  pitch_ = std::clamp(std::asin(std::clamp(d.y, Real(-1), Real(1))), -kMaxPitch, kMaxPitch);
}

void Camera::turn(Real yaw, Real pitch) {
  yaw_ = std::remainder(yaw_ + yaw, 2 * kPi);
  pitch_ = std::clamp(pitch_ + pitch, -kMaxPitch, kMaxPitch);
}

void Camera::move(Real right, Real up, Real forward_distance) {
  const Vec3 to_right{std::cos(yaw_), 0, -std::sin(yaw_)};
  eye_ += to_right * right + forward() * forward_distance;
  eye_.y += up;
}

// A camera at rest must return early to keep its bits: computing the eye from the focus rounds.
void Camera::orbit(Real yaw, Real pitch) {
  if (yaw == 0 && pitch == 0) return;
  const Vec3 centre = focus();
  turn(yaw, pitch);
  eye_ = centre - forward() * distance_;
}

void Camera::zoom(Real factor) {
  if (factor == 1) return;
  const Vec3 centre = focus();
  distance_ = std::clamp(distance_ * factor, Real(1e-3), kMaxReal / 4);
  eye_ = centre - forward() * distance_;
}

View Camera::view(const Vec3& centre, Real radius) const {
  View view;
  view.eye = eye_;
  view.forward = forward();
  view.right = {std::cos(yaw_), 0, -std::sin(yaw_)};
  view.up = cross(view.right, view.forward);
  view.fov_y = fov_y;
  const Real away = length(centre - eye_);
  view.far_plane = std::max((away + radius) * 8, Real(10));
  // Half of the depth values lie within twice the near distance, which is therefore maximized.
  view.near_plane = std::max((away - radius) * Real(0.5), view.far_plane * kLeastNear);
  return view;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
