/// Pictures of triangle meshes: silhouettes, depth, light, motion, and uploads.
#include "src/viewer/mesh_models.hpp"
#include "src/viewer/scene_painter.hpp"
#include "tests/viewer/gl_fixture.hpp"
#include "tests/viewer/meshes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

namespace jfpx {
namespace {

using namespace view;
using test::mean_difference;
using test::view_of;

class MeshPictureTest : public test::GlTest {
 protected:
  static constexpr int kWidth = 240, kHeight = 160;
  static constexpr Paint kGrey{130, 130, 130};

  static Real flat(Real, Real) { return 0; }

  static int difference(const Image& a, const Image& b, int x, int y) {
    int sum = 0;
    for (int k = 0; k < 3; ++k) sum += std::abs(int{a.at(x, y)[k]} - int{b.at(x, y)[k]});
    return sum;
  }

  /// Sum of the colours of the pixel at a point.
  static int brightness(const Image& image, const View& view, const Vec3& point) {
    const Pixel pixel = project(view, point, image.width, image.height).value();
    const std::uint8_t* rgb = image.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
    return rgb[0] + rgb[1] + rgb[2];
  }

  /// Distance in pixels from the border of a polygon whose corners are in clockwise order on the
  /// screen; negative outside.
  static Real inside(const std::vector<Pixel>& polygon, Real x, Real y) {
    Real least = kMaxReal;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Pixel &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const Real dx = b.x - a.x, dy = b.y - a.y;
      least = std::min(least, (dx * (y - a.y) - dy * (x - a.x)) / std::sqrt(dx * dx + dy * dy));
    }
    return least;
  }

  /// Expects that the picture differs from that without the mesh exactly inside the outline.
  static void expect_outline(const Image& image, const Image& without, const View& view,
                             const std::vector<Vec3>& outline) {
    std::vector<Pixel> polygon;
    for (const Vec3& p : outline) polygon.push_back(project(view, p, kWidth, kHeight).value());
    int covered = 0, wrong = 0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const Real depth = inside(polygon, Real(x) + Real(0.5), Real(y) + Real(0.5));
        if (std::fabs(depth) < Real(1.5)) continue;  // anti-aliased
        const bool differs = difference(image, without, x, y) > 8;
        wrong += differs != (depth > 0) ? 1 : 0;
        covered += differs ? 1 : 0;
      }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_GT(covered, 500);
  }
};

TEST_F(MeshPictureTest, AKinematicMeshCoversItsSilhouetteWhileItMoves) {
  const std::vector<Vec3> square = {{-1, 1, 0}, {1, 1, 0}, {1, -1, 0}, {-1, -1, 0}};
  Scene scene;
  scene.bodies.resize(2);
  scene.bodies[0].acceleration = {0, -10, 0};  // a ground would be in the picture
  scene.bodies[1].shape = TriangleMesh(square, {{0, 2, 1}, {0, 3, 2}});
  scene.bodies[1].mass = 0;
  scene.bodies[1].kinematic = true;
  const BodyState behind{{0, 0, 30}, {}, {}, {}};
  RunState from, to, without;
  from.states = {behind, {{-2, 0, 0}, {}, {}, {}}};
  to.states = {behind, {{2, 1, 0}, {Real(0.70710678), 0, 0, Real(0.70710678)}, {}, {}}};
  without.states = {behind, behind};
  from.awake = to.awake = without.awake = {1, 1};
  const View view = view_of({1, 2, 12}, {}, 6);
  const ScenePainter painter(scene);
  const auto draw = [&](const RunState& a, const RunState& b, Real share) {
    Drawing drawing(view.eye);
    painter.draw(a, b, share, Colouring::bodies, &drawing);
    return picture(drawing, view, kWidth, kHeight);
  };
  const Image sky = draw(without, without, 0);
  for (const Real share : {Real(0), Real(0.5), Real(1)}) {
    std::vector<Vec3> outline;
    for (const Vec3& corner : square) {
      outline.push_back(to_world_point(interpolate(from.states[1], to.states[1], share), corner));
    }
    expect_outline(draw(from, to, share), sky, view, outline);
  }
}

TEST_F(MeshPictureTest, BallsAreVisibleInFrontOfAMeshAndHiddenBehindIt) {
  // Off the axis of the camera, and nearer than the near plane of a view without surfaces.
  const Vec3 normal = normalized(Vec3{0, 2, 1});
  const auto slope = [](Real, Real z) { return z / -2; };
  for (const Real away : {Real(1), Real(0.004)}) {
    const Vec3 eye = Vec3{1, 5, 6} * away;
    View view = view_of(eye, {Real(0.5) * away, 0, 0}, 4);
    view.near_plane = 1;
    for (const Real side : {Real(1), Real(-1)}) {
      Drawing drawing(eye);
      drawing.set_bounds({}, 8 * away);
      drawing.add_mesh(test::terrain(6, 1, slope), {}, {}, 1, kGrey);
      const Vec3 ball = Vec3{Real(-0.5), 0, 0} * away + normal * (side * Real(0.08) * away);
      drawing.add_sphere(ball, Real(0.07) * away, {}, {255, 0, 0});
      const Image image = picture(drawing, view, kWidth, kHeight);
      const Pixel pixel = project(view, ball, kWidth, kHeight).value();
      const std::uint8_t* rgb = image.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
      EXPECT_EQ(rgb[0] > 2 * rgb[2], side > 0) << away << ' ' << side;
    }
  }
}

TEST_F(MeshPictureTest, AMeshIsVisibleAtAnyDistance) {
  for (const Real height : {Real(0.05), Real(3)}) {
    View view = view_of({0, height, 0}, {0, 0, -height}, 200);
    view.near_plane = 10;
    Drawing drawing(view.eye);
    const Image sky = picture(drawing, view, kWidth, kHeight);
    drawing.add_mesh(test::terrain(50, 2, flat), {}, {}, 1, {200, 0, 0});
    const Image image = picture(drawing, view, kWidth, kHeight);
    for (const Real y : {Real(0.5), Real(0.99)}) {
      const int row = static_cast<int>(y * kHeight);
      EXPECT_GT(difference(image, sky, kWidth / 2, row), 60) << height << ' ' << y;
    }
  }
}

TEST_F(MeshPictureTest, SlopesTowardsTheSunAreBrighter) {
  const View view = view_of({0, 8, 8}, {}, 4);
  Drawing drawing(view.eye);
  drawing.set_bounds({}, 6);
  const auto roof = [](Real x, Real) { return std::fabs(x) / -2; };
  drawing.add_mesh(test::terrain(8, 1, roof), {}, {}, 100, kGrey);
  const Image image = picture(drawing, view, kWidth, kHeight);
  // The sun is on the left. The ridge is sharp.
  const auto at = [&](Real x) { return brightness(image, view, {x, std::fabs(x) / -2, 0}); };
  EXPECT_GT(at(-2), at(2) + 60);
  EXPECT_GT(at(Real(-0.2)), at(Real(0.2)) + 60);
}

TEST_F(MeshPictureTest, BacksAreDrawnAndThoseOfOneSidedMeshesAreDarker) {
  const View view = view_of({0, -6, 6}, {}, 4);
  const auto back = [&](bool two_sided) {
    Drawing drawing(view.eye);
    drawing.set_bounds({}, 6);
    drawing.add_mesh(test::terrain(4, 1, flat, {}, two_sided), {}, {}, 100, {255, 255, 255});
    return brightness(picture(drawing, view, kWidth, kHeight), view, {});
  };
  const int sky = brightness(picture(Drawing(view.eye), view, kWidth, kHeight), view, {});
  EXPECT_LT(back(false), back(true) - 40);
  EXPECT_LT(back(true), sky - 40);
}

TEST_F(MeshPictureTest, MeshesCastAndReceiveShadows) {
  const View view = view_of({0, 8, 8}, {}, 4);
  const Vec3 sun = normalized(Vec3{Real(-0.52), Real(0.80), Real(0.34)});
  const auto floor = [&](bool shaded, bool of_mesh) {
    Drawing drawing(view.eye);
    drawing.set_bounds({}, 6);
    if (of_mesh) {
      drawing.add_mesh(test::terrain(8, 1, flat), {}, {}, 100, kGrey);
      if (shaded) drawing.add_sphere(sun * 3, Real(0.5), {}, {});
    } else {
      drawing.add_ground({0, 1, 0}, 0, 100, kGrey);
      if (shaded) drawing.add_mesh(test::cube_mesh(Real(0.5), sun * 3), {}, {}, 100, kGrey);
    }
    return brightness(picture(drawing, view, kWidth, kHeight), view, {Real(0.1), 0, 0});
  };
  for (const bool of_mesh : {false, true}) {
    EXPECT_LT(floor(true, of_mesh), floor(false, of_mesh) * 2 / 3) << of_mesh;
  }
}

TEST_F(MeshPictureTest, AmbientOcclusionDarkensAValley) {
  const View view = view_of({0, 8, 6}, {}, 4);
  const auto valley = [](Real x, Real) { return std::fabs(x); };
  const auto at_bottom = [&](int samples) {
    Drawing drawing(view.eye);
    drawing.set_bounds({}, 6);
    drawing.add_mesh(test::terrain(8, 1, valley), {}, {}, 100, kGrey);
    const Quality quality{.shadow_size = 0, .occlusion_samples = samples};
    return brightness(picture(drawing, view, kWidth, kHeight, quality), view,
                      {Real(-0.1), Real(0.1), 0});
  };
  EXPECT_LT(at_bottom(12), at_bottom(0) - 15);
}

TEST_F(MeshPictureTest, WorldsFarFromTheOriginLookTheSame) {
  const auto waves = [](Real x, Real z) { return std::sin(x * 2) * std::cos(z * 2) / 4; };
  const auto at_offset = [&](const Vec3& in_world, const Vec3& in_mesh) {
    const Vec3 offset = in_world + in_mesh;
    const Vec3 eye = offset + Vec3{2, 3, 8};
    Drawing drawing(eye);
    drawing.set_bounds(offset, 4);
    drawing.add_mesh(test::terrain(24, Real(0.25), waves, in_mesh), in_world, {}, 1,
                     {130, 130, 130, Pattern::wall});
    return picture(drawing, view_of(eye, offset, 4), kWidth, kHeight);
  };
  const Image near = at_offset({}, {});
  EXPECT_LT(mean_difference(near, at_offset({65536, 0, -32768}, {})), 0.2);
  EXPECT_LT(mean_difference(near, at_offset({}, {65500, 0, -32700})), 0.2);
}

std::size_t uploaded_bytes = 0;
PFNGLBUFFERDATAPROC buffer_data = nullptr;
void count_buffer_data(GLenum target, GLsizeiptr size, const void* data, GLenum usage) {
  uploaded_bytes += static_cast<std::size_t>(size);
  buffer_data(target, size, data, usage);
}

TEST_F(MeshPictureTest, AMeshIsUploadedOnceForAllBodiesAndPictures) {
  auto mesh = std::make_unique<TriangleMesh>(test::terrain(40, 1, flat));
  MeshModels models;
  // The first call of a function resolves its pointer, so it must precede the exchange.
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_ARRAY_BUFFER, buffer);
  glBufferData(GL_ARRAY_BUFFER, 4, nullptr, GL_STATIC_DRAW);
  glDeleteBuffers(1, &buffer);
  const auto upload = [&](int bodies) {
    Drawing drawing({0, 10, 0});
    for (int i = 0; i < bodies; ++i) drawing.add_mesh(*mesh, {Real(i), 0, 0}, {}, 1, kGrey);
    buffer_data = std::exchange(epoxy_glBufferData, count_buffer_data);
    uploaded_bytes = 0;
    models.upload(drawing.meshes());
    epoxy_glBufferData = buffer_data;
    return uploaded_bytes;
  };
  EXPECT_GT(upload(2), 40000u);  // 1681 vertices and 9600 indices
  EXPECT_LT(upload(3), 400u);
  EXPECT_EQ(models.count(), 1u);
  upload(0);
  EXPECT_EQ(models.count(), 1u);
  mesh.reset();
  models.upload({});
  EXPECT_EQ(models.count(), 0u);
}

}  // namespace
}  // namespace jfpx
