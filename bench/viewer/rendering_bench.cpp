/// Figure 5.3 of the thesis: time of contact detection per frame of boxes-and-balls with and
/// without rendering.
#include "bench/viewer/screen.hpp"
#include "bench/world/samples.hpp"
#include "src/base/stopwatch.hpp"
#include "src/scenes/scenes.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/run.hpp"
#include "src/viewer/scene_painter.hpp"

#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

constexpr std::uint32_t kSizes[] = {2, 4, 8, 16, 32, 64, 128, 256, 448};
constexpr int kFrames = 1000;

/// A picture in the size of the thesis' window, or a small one for software rendering.
class Screen {
 public:
  Screen()
      : offscreen_(draws_in_software(window_) ? 160 : 800, draws_in_software(window_) ? 120 : 600) {
    camera_.look_at({0, 10, 50}, {0, 10, 0});
    camera_.fov_y = kPi / 4;
  }

  void draw(const view::ScenePainter& painter, const view::RunState& before,
            const view::RunState& now) {
    const view::Bounds bounds = painter.bounds(now.states);
    const view::View view = camera_.view(bounds.centre, bounds.radius);
    view::Drawing drawing(view.eye);
    painter.draw(before, now, 1, view::Colouring::bodies, &drawing);
    renderer_.draw(drawing, view, {0, 0, offscreen_.width(), offscreen_.height()},
                   offscreen_.framebuffer());
    glFinish();
  }
  std::string description() const {
    return fmt::format("{} x {} by {}", offscreen_.width(), offscreen_.height(), window_.driver());
  }

 private:
  view::Window window_ = view::Window::hidden();
  view::Renderer renderer_{view::kLowQuality};
  view::OffscreenFramebuffer offscreen_;
  view::Camera camera_;
};

/// The first frame, which allocates buffers and starts a GPU, is reported separately.
void frames(benchmark::State& state, Backend backend, std::uint32_t spheres, Screen* screen) {
  const Scene scene = scenes::make("boxes-and-balls", {.spheres = spheres, .seed = 1});
  const auto run = view::make_run(scene, {.backend = backend});
  const view::ScenePainter painter(scene);
  std::vector<double> detect_ms, picture_ms;
  view::RunState before = run->run_state();
  const auto frame = [&] {
    run->step();
    view::RunState now = run->run_state();
    const double ms = now.times.detect;
    if (screen != nullptr) {
      Stopwatch watch;
      screen->draw(painter, before, now);
      picture_ms.push_back(watch.lap_ms());
    }
    before = std::move(now);
    return ms;
  };
  const double first_ms = frame();
  for (auto _ : state) {
    detect_ms.push_back(frame());
    state.SetIterationTime(detect_ms.back() * 1e-3);
  }
  state.counters["spheres"] = spheres;
  state.counters["first_ms"] = first_ms;
  state.counters["median_ms"] = median(detect_ms);
  if (screen != nullptr) state.counters["picture_ms"] = median(picture_ms);
}

void register_all(Screen* screen) {
  for (const Backend backend : {Backend::cpu, Backend::cuda}) {
    if (backend == Backend::cuda && !cuda_is_usable()) continue;
    for (const std::uint32_t spheres : kSizes) {
      for (Screen* on : {static_cast<Screen*>(nullptr), screen}) {
        const std::string name = std::string("rendering/") + (on != nullptr ? "on/" : "off/") +
                                 std::string(to_string(backend)) + "/" + std::to_string(spheres);
        benchmark::RegisterBenchmark(
            name.c_str(), [=](benchmark::State& state) { frames(state, backend, spheres, on); })
            ->UseManualTime()
            ->Iterations(kFrames)
            ->Unit(benchmark::kMillisecond);
        if (screen == nullptr) break;
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
