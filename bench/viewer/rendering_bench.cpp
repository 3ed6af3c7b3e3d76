/// The thesis' figure 5.3: contact detection of a frame of boxes-and-balls while every frame is
/// drawn, and while none is.
#include "bench/viewer/screen.hpp"
#include "bench/world/samples.hpp"
#include "src/scenes/scenes.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/run.hpp"
#include "src/viewer/stage.hpp"
#include "src/viewer/timing.hpp"

#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bench {
namespace {

constexpr std::uint32_t kSizes[] = {2, 4, 8, 16, 32, 64, 128, 256, 448};
constexpr int kFrames = 1000;

/// A picture as large as the thesis' window, or a stamp where a processor has to draw it.
class Screen {
 public:
  Screen()
      : canvas_(draws_in_software(window_) ? 160 : 800, draws_in_software(window_) ? 120 : 600) {
    camera_.look_at({0, 10, 50}, {0, 10, 0});
    camera_.fov_y = kPi / 4;
  }

  void draw(const view::Stage& stage, const view::Moment& before, const view::Moment& now) {
    const view::Bounds bounds = stage.bounds(now.states);
    const view::View view = camera_.view(bounds.centre, bounds.radius);
    view::Drawing drawing(view.eye);
    stage.draw(before, now, 1, view::Colouring::bodies, &drawing);
    renderer_.draw(drawing, view, {0, 0, canvas_.width(), canvas_.height()}, canvas_.framebuffer());
    glFinish();
  }
  std::string description() const {
    return fmt::format("{} x {} by {}", canvas_.width(), canvas_.height(), window_.driver());
  }

 private:
  view::Window window_ = view::Window::hidden();
  view::Renderer renderer_{view::kLowQuality};
  view::Canvas canvas_;
  view::Camera camera_;
};

/// The first frame is reported apart: it makes buffers and, on a GPU, starts the device.
void frames(benchmark::State& state, Backend backend, std::uint32_t spheres, Screen* screen) {
  const Scene scene = scenes::make("boxes-and-balls", {.spheres = spheres, .seed = 1});
  const auto run = view::make_run(scene, {.backend = backend});
  const view::Stage stage(scene);
  std::vector<double> detect_ms, picture_ms;
  view::Moment before = run->moment();
  const auto frame = [&] {
    run->step();
    view::Moment now = run->moment();
    const double ms = now.times.detect;
    if (screen != nullptr) {
      view::Stopwatch watch;
      screen->draw(stage, before, now);
      picture_ms.push_back(watch.lap() * 1e3);
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
