/// Time of a picture of many balls and of its parts: items on the host, shadows, ambient occlusion,
/// anti-aliasing; at a large and a small distance.
#include "bench/viewer/screen.hpp"
#include "bench/world/samples.hpp"
#include "src/scenes/scenes.hpp"
#include "src/viewer/colours.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/scene_painter.hpp"
#include "src/viewer/viewer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <time.h>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

using namespace view;

constexpr int kWidth = 1280, kHeight = 720;
constexpr Real kRadius = Real(0.5);

struct Variant {
  const char* name;
  Quality quality;
};

Quality medium_but(void (*change)(Quality&)) {
  Quality quality = kMediumQuality;
  change(quality);
  return quality;
}

std::vector<Variant> variants() {
  return {{"medium", kMediumQuality},
          {"medium_without_shadows", medium_but([](Quality& q) { q.shadow_size = 0; })},
          {"medium_without_occlusion", medium_but([](Quality& q) { q.occlusion_samples = 0; })},
          {"medium_without_both",
           medium_but([](Quality& q) { q.shadow_size = q.occlusion_samples = 0; })},
          {"medium_with_one_sample", medium_but([](Quality& q) { q.samples = 1; })},
          {"low", kLowQuality},
          {"high", kHighQuality}};
}

/// Balls in a wide box, about twelve layers deep, in random order.
std::vector<Vec3> pile(std::size_t count, Real side) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> jitter(-0.2f, 0.2f);
  const Real spacing = 2 * kRadius;
  const auto row = static_cast<std::size_t>(side / spacing);
  std::vector<Vec3> places;
  for (std::size_t i = 0; i < count; ++i) {
    const auto along = [&](std::size_t k) {
      return (static_cast<Real>(k % row) + Real(0.5)) * spacing - side / 2 + jitter(random);
    };
    places.push_back({along(i), kRadius + static_cast<Real>(i / (row * row)) * spacing * Real(0.9),
                      along(i / row)});
  }
  std::shuffle(places.begin(), places.end(), random);
  return places;
}

class Gallery {
 public:
  /// Times pictures of a pile, which is entirely visible for a `closeness` of 1.
  void pictures(benchmark::State& state, const Quality& quality, std::size_t balls, Real closeness,
                int width, int height) {
    const Real side = 2 * std::cbrt(static_cast<Real>(balls));
    Camera camera;
    camera.look_at(Vec3{side * Real(0.9), side * Real(0.75), side * Real(1.35)} * (1 / closeness),
                   {0, side / 10, 0});
    const View view = camera.view({0, side / 10, 0}, side);
    Drawing drawing(view.eye);
    drawing.set_bounds({0, side / 10, 0}, side);
    drawing.set_detail(2 * kRadius);
    drawing.add_ground({0, 1, 0}, 0, 10 * kRadius, kGroundPaint);
    std::uint32_t number = 0;
    for (const Vec3& place : pile(balls, side)) {
      drawing.add_sphere(place, kRadius, {}, ball_paint(number++));
    }
    renderer_.set_quality(quality);
    time(state, [&] {
      renderer_.draw(drawing, view, {0, 0, width, height}, offscreen_.framebuffer());
    });
  }

  /// Times pictures of a scene as in jfpx-view, including the creation of the items.
  void views(benchmark::State& state, const Quality& quality, std::uint32_t balls) {
    ViewOptions options;
    options.run.scene = "gas";
    options.run.spheres = balls;
    const std::unique_ptr<Viewer> viewer = make_viewer(options);
    renderer_.set_quality(quality);
    time(state, [&] {
      viewer->draw(renderer_, {offscreen_.framebuffer(), offscreen_.width(), offscreen_.height()});
    });
  }
  std::string description() const {
    return fmt::format("{} x {} by {}", kWidth, kHeight, window_.driver());
  }

 private:
  template <class Call>
  void time(benchmark::State& state, const Call& draw) {
    const auto picture = [&] {
      draw();
      glFinish();
    };
    picture();  // allocates buffers
    std::vector<double> ms;
    for (auto _ : state) {
      ms.push_back(milliseconds_of(picture));
      state.SetIterationTime(ms.back() * 1e-3);
    }
    state.counters["median_ms"] = median(ms);
  }

  /// Wall time; for software rendering, processor time, which other load affects less.
  template <class Call>
  double milliseconds_of(const Call& call) const {
    const auto now = [this] {
      timespec time{};
      clock_gettime(software_ ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_MONOTONIC, &time);
      return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
    };
    const double start = now();
    call();
    return now() - start;
  }

  Window window_ = Window::hidden();
  bool software_ = draws_in_software(window_);
  Renderer renderer_;
  OffscreenFramebuffer offscreen_{kWidth, kHeight};
};

/// The work of the host for a picture of a run.
void items(benchmark::State& state, std::uint32_t balls) {
  const Scene scene = scenes::make("gas", {.spheres = balls, .seed = 1});
  const ScenePainter painter(scene);
  RunState run_state;
  for (const BodyDef& body : scene.bodies) {
    run_state.states.push_back({body.position, body.orientation, {}, {}});
  }
  run_state.awake.assign(scene.bodies.size(), 1);
  for (auto _ : state) {
    Drawing drawing({0, 0, 100});
    painter.draw(run_state, run_state, Real(0.5), Colouring::bodies, &drawing);
    benchmark::DoNotOptimize(drawing.spheres().data());
  }
}

void register_all(Gallery* gallery) {
  for (const std::uint32_t balls : {10000u, 100000u}) {
    benchmark::RegisterBenchmark(("drawing/items/" + std::to_string(balls)).c_str(),
                                 [=](benchmark::State& state) { items(state, balls); })
        ->Unit(benchmark::kMillisecond);
    if (gallery == nullptr) continue;
    // A tiny picture has few pixels, so its time is the cost per sphere.
    benchmark::RegisterBenchmark(("drawing/stamp/" + std::to_string(balls)).c_str(),
                                 [=](benchmark::State& state) {
                                   gallery->pictures(
                                       state, medium_but([](Quality& q) { q.shadow_size = 0; }),
                                       balls, 1, 32, 18);
                                 })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
    for (const Variant& variant : variants()) {
      benchmark::RegisterBenchmark(
          ("drawing/view/" + std::to_string(balls) + "/" + variant.name).c_str(),
          [=](benchmark::State& state) { gallery->views(state, variant.quality, balls); })
          ->UseManualTime()
          ->Unit(benchmark::kMillisecond);
      for (const auto& [from, closeness] : {std::pair("afar", Real(1)), {"near", Real(4)}}) {
        const std::string name =
            std::string("drawing/") + from + "/" + std::to_string(balls) + "/" + variant.name;
        benchmark::RegisterBenchmark(name.c_str(),
                                     [=](benchmark::State& state) {
                                       gallery->pictures(state, variant.quality, balls, closeness,
                                                         kWidth, kHeight);
                                     })
            ->UseManualTime()
            ->Unit(benchmark::kMillisecond);
      }
    }
  }
}

}  // namespace
}  // namespace bench
}  // namespace JFPX_ABI
}  // namespace jfpx

int main(int argc, char** argv) {
  return jfpx::bench::run_with_screen(argc, argv, jfpx::bench::register_all);
}
