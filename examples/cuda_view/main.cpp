/// Shows a simulation that stays on the GPU: CUDA moves and collides balls and writes the buffer
/// that OpenGL draws.
#include <jfpx/error.hpp>

#include "examples/cuda_view/shared_buffer.hpp"
#include "examples/cuda_view/simulation.hpp"
#include "src/viewer/controls.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/step_clock.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/window.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace {

using namespace jfpx;
using cuda_view::Simulation;

struct Options {
  std::uint32_t balls = 100000;
  int frames = 0;  // 0: until closed
  std::string screenshot;
  bool headless = false, by_host = false;
  view::Quality quality;
  std::vector<Real> eye, target;  // empty: above a corner
};

constexpr int kWidth = 1280, kHeight = 720, kStepsAFrame = 2;
constexpr double kStep = static_cast<double>(Simulation::kStep);  // [s]
constexpr double kLongestFrame = 0.25;  // [s]; limits the steps after a stall

class Viewer {
 public:
  explicit Viewer(const Options& options)
      : options_(options),
        window_(options.headless ? view::Window::hidden()
                                 : view::Window::open("cuda_view", kWidth, kHeight)),
        offscreen_(kWidth, kHeight),
        simulation_(options.balls),
        buffer_(renderer_.resident_spheres(simulation_.size()),
                simulation_.size() * sizeof(view::SphereItem), options.by_host) {
    const Real side = simulation_.side();
    Vec3 eye{side * Real(0.9), side * Real(0.75), side * Real(1.35)}, target{0, side / 5, 0};
    if (!options.eye.empty()) eye = {options.eye[0], options.eye[1], options.eye[2]};
    if (!options.target.empty()) target = {options.target[0], options.target[1], options.target[2]};
    if (length(target - eye) <= kEpsilon) {
      throw InvalidArgument("--eye and --target are the same point");
    }
    camera_.look_at(eye, target);
  }

  void run() {
    const int frames = options_.frames > 0 || !options_.headless ? options_.frames : 240;
    view::Stopwatch clock;
    for (int n = 0; !quit_ && (frames == 0 || n < frames); ++n) {
      const double seconds = std::min(clock.lap(), kLongestFrame);
      read_events(seconds);
      // Without a window every run has the same pictures.
      advance(options_.headless ? kStepsAFrame * kStep : seconds);
      view::Stopwatch watch;
      draw();
      glFinish();
      picture_ms_.push_back(watch.lap() * 1e3);
      window_.check_context();
      if (quit_ || n + 1 == frames) write_screenshot();
      if (!options_.headless) window_.swap();
    }
    const std::string& reason = buffer_.host_copy_reason();
    fmt::print("{} balls, {} contacts; {:.3f} ms per step, {:.3f} ms per picture (medians), {}\n",
               simulation_.size(), simulation_.contacts(), view::median(step_ms_),
               view::median(picture_ms_),
               reason.empty() ? "without the host" : "through the host: " + reason);
  }

 private:
  void advance(double seconds) {
    view::Stopwatch watch;
    std::uint64_t steps = 0;
    steps_.advance(seconds, kStep, std::numeric_limits<std::uint64_t>::max(), [&] {
      simulation_.step();
      ++steps;
    });
    if (steps > 0) step_ms_.push_back(watch.lap() * 1e3 / static_cast<double>(steps));
  }

  /// Must be called before the swap, which may leave the back buffer undefined.
  void write_screenshot() const {
    if (options_.screenshot.empty()) return;
    const view::Image image = options_.headless
                                  ? offscreen_.read()
                                  : view::OffscreenFramebuffer::read_pixels(
                                        0, window_.pixel_width(), window_.pixel_height());
    window_.check_context();
    view::write_png(image, options_.screenshot);
  }

  void read_events(double seconds) {
    SDL_Event event;
    while (SDL_PollEvent(&event) != 0) controls_.handle(event);
    for (const view::Command command : controls_.take_commands()) {
      quit_ = quit_ || command == view::Command::quit;
    }
    controls_.move(&camera_, seconds, Simulation::kRadius);
  }

  void draw() {
    const Real side = simulation_.side();
    const view::View view = camera_.view({0, side / 3, 0}, side);
    simulation_.write_items(static_cast<view::SphereItem*>(buffer_.map(simulation_.stream())),
                            view.eye);
    buffer_.unmap(simulation_.stream());
    view::Drawing drawing(view.eye);
    drawing.set_bounds({0, side / 3, 0}, side);
    drawing.set_detail(2 * Simulation::kRadius);
    drawing.add_ground({0, 1, 0}, 0, 10 * Simulation::kRadius, view::kGroundPaint);
    const bool shown = !options_.headless;
    renderer_.draw(
        drawing, view,
        {0, 0, shown ? window_.pixel_width() : kWidth, shown ? window_.pixel_height() : kHeight},
        shown ? 0 : offscreen_.framebuffer());
  }

  Options options_;
  view::Window window_;
  view::Renderer renderer_{options_.quality};
  view::OffscreenFramebuffer offscreen_;
  view::Camera camera_;
  view::Controls controls_;
  view::StepClock steps_;
  Simulation simulation_;
  cuda_view::SharedBuffer buffer_;
  std::vector<double> step_ms_, picture_ms_;
  bool quit_ = false;
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("cuda_view: shows balls that are simulated and drawn on the GPU.", "cuda_view");
  Options options;
  app.add_option("--balls", options.balls, "Number of balls")->check(CLI::Range(1, 50'000'000));
  app.add_option("--frames", options.frames,
                 "Number of pictures [default: headless: 240; window: until closed]")
      ->check(CLI::Range(1, 1'000'000));
  app.add_option("--screenshot", options.screenshot, "Write the last picture to this PNG file");
  app.add_flag_callback(
      "--high", [&] { options.quality = view::kHighQuality; }, "High quality instead of medium");
  app.add_option("--eye", options.eye, "Position of the camera: X,Y,Z [m]")
      ->expected(3)
      ->delimiter(',');
  app.add_option("--target", options.target, "Point that the camera looks at: X,Y,Z [m]")
      ->expected(3)
      ->delimiter(',');
  app.add_flag("--headless", options.headless, "Render without a window and a display");
  app.add_flag("--by-host", options.by_host, "Copy through the host, for comparison");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    Viewer(options).run();
    return 0;
  } catch (const BackendUnavailable& error) {
    fmt::print(stderr, "cuda_view: {}\n", error.what());
    return 3;
  } catch (const DeviceError& error) {
    fmt::print(stderr, "cuda_view: {}\n", error.what());
    return 3;
  } catch (const std::exception& error) {
    fmt::print(stderr, "cuda_view: {}\n", error.what());
    return 2;
  }
}
