/// Pictures: positions, colours, occlusion, shadows and lines.
#include "src/viewer/scene_painter.hpp"
#include "tests/support/seed.hpp"
#include "tests/viewer/gl_fixture.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <random>
#include <utility>

namespace jfpx {
namespace {

using namespace view;
using test::mean_difference;
using test::view_of;
using RendererTest = test::GlTest;

constexpr int kWidth = 320, kHeight = 200;
constexpr std::array<Paint, 6> kHues = {
    {{220, 20, 20}, {20, 200, 20}, {20, 20, 220}, {210, 200, 10}, {200, 10, 200}, {10, 190, 200}}};

/// The hue of kHues with the nearest direction in colour space.
std::size_t nearest_hue(const std::uint8_t* pixel) {
  std::size_t best = 0;
  double best_cosine = -1;
  for (std::size_t i = 0; i < kHues.size(); ++i) {
    const double p[] = {double(pixel[0]), double(pixel[1]), double(pixel[2])};
    const double h[] = {double(kHues[i].r), double(kHues[i].g), double(kHues[i].b)};
    // Without the grey component, which sky and sun add.
    const double grey_p = std::min({p[0], p[1], p[2]}), grey_h = std::min({h[0], h[1], h[2]});
    double pp = 0, hh = 0, ph = 0;
    for (int k = 0; k < 3; ++k) {
      const double a = p[k] - grey_p, b = h[k] - grey_h;
      pp += a * a, hh += b * b, ph += a * b;
    }
    const double cosine = ph / std::sqrt(pp * hh + 1e-9);
    if (cosine > best_cosine) best_cosine = cosine, best = i;
  }
  return best;
}

std::size_t hue_at(const Image& image, const View& view, const Vec3& point) {
  const auto pixel = project(view, point, image.width, image.height);
  return nearest_hue(image.at(static_cast<int>(pixel->x), static_cast<int>(pixel->y)));
}

TEST_F(RendererTest, EveryBodysProjectedCentreHasItsColour) {
  const test::Seed seed;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> jitter(-0.35f, 0.35f), angle(-1, 1);
  const Vec3 eye{-6, Real(2.5), 15};  // the sun is behind it, to the left
  const View view = view_of(eye, {}, 12);
  Drawing drawing(eye);
  drawing.set_bounds({}, 12);
  struct Body {
    Vec3 at;
    std::size_t hue;
    std::string text;
  };
  std::vector<Body> bodies;
  // A smooth face that reflects the sun into the eye has the colour of the sun.
  const Vec3 sun = normalized(Vec3{Real(-0.52), Real(0.80), Real(0.34)});
  const auto reflects_sun = [&](const Quat& turn, const Vec3& at) {
    const Vec3 half_way = normalized(sun + normalized(eye - at));
    const Vec3 local = transform_transpose(to_matrix(turn), half_way);
    return std::max({absolute(local.x), absolute(local.y), absolute(local.z)}) > Real(0.97);
  };
  // Rows and columns of the picture, so that no body hides the centre of another. Neighbours are at
  // least 2 - 2 * 0.35 m apart across the picture; perspective subtracts 0.7 m in depth * 6.35 /
  // 16, and the slant of the ray divides by sqrt(1 + (6.35 / 16)^2), which leaves 0.95 m. The half
  // diagonal of a box is sqrt(0.5^2 + 0.4^2 + 0.6^2) = 0.88 m.
  for (int x = -3; x <= 3; ++x) {
    for (int y = -2; y <= 2; ++y) {
      const Vec3 at = view.right * (Real(x) * 2 + jitter(random)) +
                      view.up * (Real(y) * 2 + jitter(random)) + view.forward * jitter(random);
      const std::size_t hue = random() % kHues.size();
      const bool sphere = random() % 2 == 0;
      Quat turn;
      do {
        turn = normalized(Quat{angle(random), angle(random), angle(random), angle(random)});
      } while (!sphere && reflects_sun(turn, at));
      if (sphere) {
        drawing.add_sphere(at, Real(0.6), turn, kHues[hue]);
      } else {
        drawing.add_box(at, {Real(0.5), Real(0.4), Real(0.6)}, turn, kHues[hue]);
      }
      bodies.push_back({at, hue, (sphere ? "sphere " : "box ") + std::to_string(bodies.size())});
    }
  }
  const Image image = picture(drawing, view, kWidth, kHeight);
  for (const Body& body : bodies) {
    EXPECT_EQ(hue_at(image, view, body.at), body.hue) << body.text;
  }
}

TEST_F(RendererTest, DepthOfSpheresIsExactOffTheAxis) {
  // A small ball at the surface of a sphere far from the middle of the picture: visible in front of
  // the surface, hidden behind it.
  const Vec3 eye{0, 0, 10};
  const View view = view_of(eye, {}, 8);
  const Vec3 centre{Real(-3.6), 2, 0};
  const Vec3 to_eye = normalized(eye - centre);
  for (const Real depth : {Real(0.96), Real(1.04)}) {
    Drawing drawing(eye);
    drawing.set_bounds({}, 8);
    drawing.add_sphere(centre, 1, {}, kHues[2]);
    drawing.add_sphere(centre + to_eye * depth - to_eye * Real(0.01), Real(0.01) + Real(0.02), {},
                       kHues[3]);
    const Image image = picture(drawing, view, 640, 400);
    EXPECT_EQ(hue_at(image, view, centre), depth > 1 ? 3u : 2u) << depth;
  }
}

TEST_F(RendererTest, ABallIsVisibleAtAnyDistance) {
  // Below the resolution of the depth buffer: 2e-5 of the far plane is 0.2 m.
  const Vec3 eye{0, 0, 0};
  View view = view_of(eye, {0, 0, -1000}, 200);
  view.far_plane = 10000;
  for (const Real aside : {Real(0), Real(0.5)}) {
    Drawing drawing(eye);
    drawing.set_bounds({0, 0, -5}, 6);
    const Vec3 ball{aside * Real(0.12), 0, Real(-0.12)};
    drawing.add_sphere(ball, Real(0.04), {}, kHues[1]);
    drawing.add_box({0, 0, -5}, {4, 4, 1}, {}, kHues[0]);
    const Image image = picture(drawing, view, kWidth, kHeight);
    EXPECT_EQ(hue_at(image, view, ball), 1u) << aside;
    EXPECT_EQ(hue_at(image, view, {Real(-1.6), Real(1.2), -4}), 0u);
  }
}

TEST_F(RendererTest, WorldsFarFromTheOriginLookTheSame) {
  const auto at_offset = [](const Vec3& offset) {
    const Vec3 eye = offset + Vec3{2, 1, 8};
    Drawing drawing(eye);
    drawing.set_bounds(offset, 4);
    drawing.add_sphere(offset, 1, {}, {230, 180, 40, Pattern::solid_ball});
    drawing.add_box(offset + Vec3{2, 0, 0}, {Real(0.5), 1, Real(0.5)}, {},
                    {200, 150, 90, Pattern::crate});
    return picture(drawing, view_of(eye, offset, 4), kWidth, kHeight);
  };
  // Offsets and positions are exact in both precisions.
  EXPECT_LT(mean_difference(at_offset({}), at_offset({65536, 0, -32768})), 0.2);
}

TEST_F(RendererTest, SpinShowsOnBallsButNotOnPlainSpheres) {
  const Vec3 eye{0, 0, 5};
  const View view = view_of(eye, {}, 2);
  const auto turned = [&](Pattern pattern, const Quat& turn) {
    Drawing drawing(eye);
    drawing.set_bounds({}, 2);
    drawing.add_sphere({}, 1, turn, {200, 40, 40, pattern});
    return picture(drawing, view, kWidth, kHeight);
  };
  const Quat quarter{Real(0.70710678), Real(0.70710678), 0, 0};
  for (const Pattern pattern : {Pattern::solid_ball, Pattern::striped_ball}) {
    EXPECT_GT(mean_difference(turned(pattern, {}), turned(pattern, quarter)), 1.0);
  }
  EXPECT_EQ(turned(Pattern::plain, {}).rgb, turned(Pattern::plain, quarter).rgb);
}

TEST_F(RendererTest, WidthsOfLinesAreInUnitsAtAnyResolution) {
  const Vec3 eye{0, 0, 5};
  const View view = view_of(eye, {}, 2);
  constexpr int kUnits = 60;
  const auto rows = [&](float width, int unit, int supersample) {
    Drawing drawing(eye);
    drawing.set_bounds({}, 2);
    if (width > 0) drawing.add_line({-3, 0, 0}, {3, 0, 0}, {255, 0, 0}, width);
    Renderer renderer({.supersample = supersample, .samples = 1});
    const OffscreenFramebuffer offscreen(kUnits * unit, kUnits * unit);
    renderer.draw(drawing, view, {0, 0, offscreen.width(), offscreen.height(), float(unit)},
                  offscreen.framebuffer());
    const Image image = offscreen.read();
    int red = 0;
    for (int y = 0; y < image.height; ++y) {
      const std::uint8_t* pixel = image.at(image.width / 2, y);
      red += pixel[0] > 2 * pixel[2];
    }
    return red;
  };
  for (const int supersample : {1, 2}) {
    for (const int unit : {1, 3}) {
      EXPECT_EQ(rows(8, unit, supersample), 8 * unit) << supersample;
      EXPECT_EQ(rows(2, unit, supersample), 2 * unit) << supersample;
    }
  }
  EXPECT_EQ(rows(0, 1, 1), 0);
}

TEST_F(RendererTest, APictureOfAnotherSizeEqualsThatOfANewRenderer) {
  const Vec3 eye{0, 1, 6};
  const View view = view_of(eye, {}, 2);
  Drawing drawing(eye);
  drawing.set_bounds({}, 2);
  drawing.add_sphere({}, 1, {}, {200, 40, 40, Pattern::striped_ball});
  Renderer renderer(kMediumQuality);
  for (const auto& [width, height] : {std::pair(120, 80), {48, 90}, {0, 0}, {0, 10}, {120, 80}}) {
    const OffscreenFramebuffer offscreen(std::max(width, 1), std::max(height, 1));
    renderer.draw(drawing, view, {0, 0, width, height}, offscreen.framebuffer());
    if (width == 0) continue;  // a minimised window
    EXPECT_EQ(offscreen.read().rgb, picture(drawing, view, width, height, kMediumQuality).rgb);
  }
}

TEST_F(RendererTest, RejectedShadersAndFramebuffersMakeOpenGlUnusable) {
  constexpr std::string_view kVertex = "void main() { gl_Position = vec4(0.0); }";
  EXPECT_THROW(GlProgram(kVertex, "this is no shader"), BackendUnavailable);
  EXPECT_THROW(GlProgram(kVertex, "void main() { undefined_function(); }"), BackendUnavailable);
  EXPECT_THROW(make_framebuffer(make_texture(GL_DEPTH_COMPONENT32F, 4, 4).name(), 0),
               BackendUnavailable);
}

GLenum guilty() { return GL_GUILTY_CONTEXT_RESET; }

TEST_F(RendererTest, ALostContextThrows) {
  window().check_context();
  if (!window().reports_resets()) GTEST_SKIP() << window().driver() << " can't report resets";
  const auto driver = std::exchange(epoxy_glGetGraphicsResetStatus, guilty);
  EXPECT_THROW(window().check_context(), BackendUnavailable);
  EXPECT_THROW(window().swap(), BackendUnavailable);
  epoxy_glGetGraphicsResetStatus = driver;
  window().check_context();
}

TEST_F(RendererTest, EqualsItsReference) {
  Scene scene;
  const auto add = [&scene](Shape shape, const Vec3& at, Real mass) {
    BodyDef body;
    body.shape = shape;
    body.position = at;
    body.mass = mass;
    body.orientation = normalized(Quat{1, Real(0.2) * at.x, Real(0.3), Real(0.1) * at.z});
    scene.bodies.push_back(body);
  };
  for (int i = 0; i < 9; ++i) {
    const Vec3 at{Real(i % 3) * 2 - 2, 1 + Real(i % 2), Real(i / 3) * 2 - 2};
    if (i % 3 == 1) {
      add(Box{{Real(0.7), Real(0.6), Real(0.8)}}, at, 1);
    } else {
      add(Sphere{Real(0.9)}, at, 1);
    }
  }
  add(HalfSpace{}, {}, 0);
  RunState run_state;
  for (const BodyDef& body : scene.bodies) {
    run_state.states.push_back({body.position, body.orientation, {}, {}});
  }
  run_state.awake.assign(scene.bodies.size(), 1);
  run_state.awake[2] = 0;
  const Vec3 eye{5, 4, 9};
  Drawing drawing(eye);
  ScenePainter(scene).draw(run_state, run_state, 1, Colouring::bodies, &drawing);
  const Image image = picture(drawing, view_of(eye, {0, 1, 0}, 5), 240, 150, kHighQuality);
  const std::string path = JFPX_REFERENCE_FOLDER "/scene.png";
  if (std::getenv("JFPX_WRITE_REFERENCES") != nullptr) write_png(image, path);
  const Image reference = read_png(path);
  ASSERT_EQ(reference.rgb.size(), image.rgb.size());
  EXPECT_LT(mean_difference(image, reference), 1.5) << "JFPX_WRITE_REFERENCES=1 rewrites it";
}

}  // namespace
}  // namespace jfpx
