/// The three modes of the program.
#include "src/viewer/app.hpp"

#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/tool/interrupts.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/ui.hpp"
#include "src/viewer/viewer.hpp"

#include <fmt/format.h>

#include <csignal>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr std::uint64_t kHeadlessFrames = 120;

std::unique_ptr<Viewer> start(const ViewOptions& options) {
  auto viewer = make_viewer(options);
  if (!options.recording.empty()) viewer->record_to(options.recording);
  return viewer;
}

/// Makes SIGHUP end a run like SIGINT and SIGTERM, which SDL converts to events.
void handle_hang_up() {
  struct sigaction action {};
  sigaction(SIGHUP, nullptr, &action);
  if (action.sa_handler != SIG_DFL) return;  // ignored by nohup
  action.sa_handler = [](int) { std::raise(SIGTERM); };
  sigaction(SIGHUP, &action, nullptr);
}

int run_without_rendering(const ViewOptions& options) {
  const tool::Interrupts interrupts;
  const auto viewer = start(options);
  Timing timing;
  const std::uint64_t frames = options.frames.value_or(kHeadlessFrames);
  for (std::uint64_t i = 0; i < frames && !viewer->at_end() && !tool::Interrupts::requested();
       ++i) {
    viewer->step();
    timing.add_step(viewer->engine_ms());
  }
  finish(*viewer, timing, options);
  return viewer->status();
}

int run_headless(const ViewOptions& options) {
  const auto viewer = start(options);
  Window window = Window::hidden();
  Renderer renderer(options.quality);
  const OffscreenFramebuffer offscreen(options.size.width, options.size.height);
  Ui ui(offscreen);
  ImageSequenceWriter image_sequence(options.pictures);
  Timing timing;
  const auto draw = [&] {
    Stopwatch watch;
    ui.begin(kRecordedFrame);
    viewer->draw(renderer, {offscreen.framebuffer(), offscreen.width(), offscreen.height()});
    if (options.panel) viewer->panel();
    ui.end(offscreen.framebuffer(), offscreen.width(), offscreen.height());
    glFinish();
    window.check_context();
    timing.add_picture(watch.lap_ms());
  };
  const auto picture = [&] {
    Image image = offscreen.read();
    window.check_context();  // pixels read after a lost context are invalid
    return image;
  };
  std::exception_ptr failure;
  const auto write = [&failure](const auto& picture_file) {
    try {
      picture_file();
    } catch (const FileError&) {
      failure = std::current_exception();
    }
    return failure == nullptr;
  };
  const std::uint64_t frames = options.frames.value_or(kHeadlessFrames);
  // SDL converts SIGINT and SIGTERM to events, which the loop must poll.
  for (std::uint64_t i = 0; i < frames && !viewer->at_end() && !SDL_QuitRequested(); ++i) {
    viewer->step();
    timing.add_step(viewer->engine_ms());
    if (!image_sequence.on()) continue;
    draw();
    if (!write([&] { image_sequence.add(picture()); })) break;
  }
  if (!image_sequence.on()) viewer->home();  // otherwise the last picture is that of the sequence
  if (options.panel) {                       // Dear ImGui sizes windows in a first, invisible frame
    ui.begin(kRecordedFrame);
    viewer->panel();
    ui.end(offscreen.framebuffer(), offscreen.width(), offscreen.height());
  }
  draw();
  if (!options.screenshot.empty()) write([&] { write_png(picture(), options.screenshot); });
  finish(*viewer, timing, options, failure);
  return viewer->status();
}

}  // namespace

void finish(Viewer& viewer, const Timing& timing, const ViewOptions& options,
            std::exception_ptr failure) {
  try {
    viewer.finish_recording();
  } catch (const Error&) {
    if (!failure) failure = std::current_exception();
  }
  fmt::print("{}\n{}\n", viewer.summary(), timing.text(options.render));
  if (failure) std::rethrow_exception(failure);
}

int run_app(const ViewOptions& options) {
  if (!options.screenshot.empty()) require_writable(options.screenshot);
  if (!options.render) return run_without_rendering(options);
  handle_hang_up();
  if (options.headless) return run_headless(options);
  return run_interactive(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
