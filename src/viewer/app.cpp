/// The program's three ways to run.
#include "src/viewer/app.hpp"

#include <jfpx/error.hpp>

#include "src/viewer/recorder.hpp"
#include "src/viewer/show.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/ui.hpp"

#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr std::uint64_t kHeadlessFrames = 120;

std::unique_ptr<Show> start(const ViewOptions& options) {
  auto show = make_show(options);
  if (!options.recording.empty()) show->record_to(options.recording);
  return show;
}

int run_without_rendering(const ViewOptions& options) {
  const auto show = start(options);
  Timing timing;
  const std::uint64_t frames = options.frames.value_or(kHeadlessFrames);
  for (std::uint64_t i = 0; i < frames && !show->at_end(); ++i) {
    show->step();
    timing.add_step(show->engine_ms());
  }
  finish(*show, timing, options);
  return show->status();
}

int run_headless(const ViewOptions& options) {
  const auto show = start(options);
  Window window = Window::hidden();
  Renderer renderer(options.quality);
  const Canvas canvas(options.size.width, options.size.height);
  Ui ui(canvas);
  Recorder recorder(options.record);
  Timing timing;
  const auto draw = [&] {
    Stopwatch watch;
    ui.begin(kRecordedFrame);
    show->draw(renderer, {canvas.framebuffer(), canvas.width(), canvas.height()});
    if (options.panel) show->panel();
    ui.end(canvas.framebuffer(), canvas.width(), canvas.height());
    glFinish();
    window.check_context();
    timing.add_picture(watch.lap() * 1e3);
  };
  const auto picture = [&] {
    Image image = canvas.read();
    window.check_context();  // what a lost context leaves is no picture
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
  // SDL makes an event of SIGINT and SIGTERM, which somebody must ask for.
  for (std::uint64_t i = 0; i < frames && !show->at_end() && !SDL_QuitRequested(); ++i) {
    show->step();
    timing.add_step(show->engine_ms());
    if (!recorder.on()) continue;
    draw();
    if (!write([&] { recorder.add(picture()); })) break;
  }
  if (!recorder.on()) show->home();  // else the last picture is that of the film
  if (options.panel) {               // windows learn their size from a first, invisible frame
    ui.begin(kRecordedFrame);
    show->panel();
    ui.end(canvas.framebuffer(), canvas.width(), canvas.height());
  }
  draw();
  if (!options.screenshot.empty()) write([&] { write_png(picture(), options.screenshot); });
  finish(*show, timing, options, failure);
  return show->status();
}

}  // namespace

void finish(Show& show, const Timing& timing, const ViewOptions& options,
            std::exception_ptr failure) {
  try {
    show.finish_recording();
  } catch (const Error&) {
    if (!failure) failure = std::current_exception();
  }
  fmt::print("{}\n{}\n", show.summary(), timing.text(options.render));
  if (failure) std::rethrow_exception(failure);
}

int run_app(const ViewOptions& options) {
  if (!options.screenshot.empty()) require_writable(options.screenshot);
  if (!options.render) return run_without_rendering(options);
  if (options.headless) return run_headless(options);
  return run_interactive(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
