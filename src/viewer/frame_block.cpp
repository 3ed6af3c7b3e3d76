/// The uniform block shared by all shaders.
#include "src/viewer/frame_block.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Vec3 kTowardsSun{Real(-0.52), Real(0.80), Real(0.34)};
constexpr Real kGoldenAngle = Real(2.39996323);
constexpr Real kSunBlur =
    Real(0.045);  // tangent of the angular radius, several times that of the sun

void put(float (&out)[4], const Vec3& v, Real w) {
  out[0] = static_cast<float>(v.x);
  out[1] = static_cast<float>(v.y);
  out[2] = static_cast<float>(v.z);
  out[3] = static_cast<float>(w);
}

void put(float (&out)[16], const Mat4& m) {
  Real columns[16];
  fill_column_major(m, columns);
  std::transform(columns, columns + 16, out, [](Real x) { return static_cast<float>(x); });
}

Mat4 rows(const Vec3& x, Real ox, const Vec3& y, Real oy, const Vec3& z, Real oz) {
  return {{{x.x, x.y, x.z, ox}, {y.x, y.y, y.z, oy}, {z.x, z.y, z.z, oz}, {0, 0, 0, 1}}};
}

Mat4 projection(const View& view, Real aspect) {
  const Real n = view.near_plane, f = view.far_plane;
  const Real scale = 1 / std::tan(view.fov_y / 2);
  Mat4 p;
  p.m[0][0] = scale / aspect;
  p.m[1][1] = scale;
  p.m[2][2] = -(f + n) / (f - n);
  p.m[2][3] = -2 * f * n / (f - n);
  p.m[3][2] = -1;
  p.m[3][3] = 0;
  return p;
}

}  // namespace

FrameBlock make_frame_block(const Drawing& drawing, const View& view, const Quality& quality,
                            const Viewport& viewport) {
  FrameBlock block;
  // cppcheck-suppress memsetClassFloat  // also clears the padding, which the GPU receives
  std::memset(&block, 0, sizeof block);
  const Real width = static_cast<Real>(viewport.width * quality.supersample);
  const Real height = static_cast<Real>(viewport.height * quality.supersample);
  const Real aspect = width / height;
  const Mat4 turned = rows(view.right, 0, view.up, 0, -view.forward, 0);
  put(block.view_projection, projection(view, aspect) * turned);
  const Real tangent = std::tan(view.fov_y / 2);
  put(block.ray_x, view.right * (tangent * aspect), 2 * tangent / height);
  put(block.ray_y, view.up * tangent, 0);
  put(block.ray_z, view.forward, view.near_plane);

  const Vec3 sun = normalized(kTowardsSun);
  put(block.sun, sun, kSunBlur);
  put(block.viewport, {width, height, view.far_plane},
      static_cast<Real>(viewport.unit) * static_cast<Real>(quality.supersample));

  // The shadow map covers all casters, or the surroundings of the eye if the scene is much larger.
  const Vec3 towards = drawing.bounds_centre() - view.eye;
  const Real radius = std::min(drawing.bounds_radius() * Real(1.02),
                               3 * length(towards) + static_cast<Real>(drawing.detail()));
  const Vec3 side = normalized(cross(sun, Vec3{0, 1, 0}));
  const Vec3 up = cross(side, sun);
  const Real k = 1 / (2 * radius);
  const Real half = Real(0.5);
  put(block.light, rows(side * k, half - dot(side, towards) * k, up * k,
                        half - dot(up, towards) * k, sun * -k, half + dot(sun, towards) * k));
  for (int i = 0; i < kMaxTaps; ++i) {
    const Real angle = static_cast<Real>(i) * kGoldenAngle;
    put(block.taps[i], {std::cos(angle), std::sin(angle), std::sqrt(static_cast<Real>(i) + half)},
        0);
  }
  const Real across = 2 * radius;
  if (quality.shadow_size > 0) {
    put(block.shadow, {across / static_cast<Real>(quality.shadow_size), across, across},
        static_cast<Real>(std::min(quality.shadow_taps, kMaxTaps)));
  }
  put(block.occlusion,
      {static_cast<Real>(drawing.detail()),
       static_cast<Real>(std::min(quality.occlusion_samples, kMaxTaps)),
       view.far_plane * Real(0.6)},
      0);
  return block;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
