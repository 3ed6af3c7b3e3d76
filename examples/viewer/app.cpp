/// The program's three ways to run.
#include "examples/viewer/app.hpp"

#include <jfpx/error.hpp>

#include "examples/viewer/demo_show.hpp"
#include "examples/viewer/recorder.hpp"
#include "examples/viewer/show.hpp"
#include "examples/viewer/timing.hpp"
#include "examples/viewer/ui.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <imgui.h>

namespace jfpx::inline JFPX_ABI::view {
namespace {

constexpr std::uint64_t kHeadlessFrames = 120;
constexpr double kLongestFrame = 0.25;         // [s]; after a stall the clock does not catch up
constexpr double kRecordedFrame = 1.0 / 60.0;  // [s]

std::unique_ptr<Show> make_show(const ViewOptions& options) {
  if (options.side_by_side) return make_side_by_side(options);
  return is_playable(options.run.scene) ? make_demo_show(options) : make_scene_show(options);
}

int finish(const Show& show, const Timing& timing, const ViewOptions& options) {
  fmt::print("{}\n{}\n", show.summary(), timing.text(options.render));
  return show.status();
}

int run_without_rendering(const ViewOptions& options) {
  const auto show = make_show(options);
  Timing timing;
  for (std::uint64_t i = 0; i < options.frames.value_or(kHeadlessFrames); ++i) {
    show->step();
    timing.add_step(show->engine_ms());
  }
  return finish(*show, timing, options);
}

int run_headless(const ViewOptions& options) {
  const auto show = make_show(options);
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
    timing.add_picture(watch.lap() * 1e3);
  };
  for (std::uint64_t i = 0; i < options.frames.value_or(kHeadlessFrames); ++i) {
    show->step();
    timing.add_step(show->engine_ms());
    if (!recorder.on()) continue;
    draw();
    recorder.add(canvas.read());
  }
  show->home();
  if (options.panel) {  // windows learn their size from a first, invisible frame
    ui.begin(kRecordedFrame);
    show->panel();
    ui.end(canvas.framebuffer(), canvas.width(), canvas.height());
  }
  draw();
  if (!options.screenshot.empty()) write_png(canvas.read(), options.screenshot);
  return finish(*show, timing, options);
}

/// The window and what happens in it.
class App {
 public:
  explicit App(const ViewOptions& options)
      : options_(options),
        show_(make_show(options)),
        window_(Window::open("jfpx-view: " + options.run.scene, options.size.width,
                             options.size.height)),
        renderer_(options.quality),
        ui_(window_),
        recorder_(options.record) {
    if (options.fullscreen) window_.set_fullscreen(true);
    controls_.set_demo_keys(show_->demo_keys());
  }

  int run() {
    Stopwatch clock;
    while (!quit_) {
      read_events();
      const double seconds = std::min(clock.lap(), kLongestFrame);
      controls_.move(&show_->camera, seconds, show_->body_size());
      const std::uint64_t before = show_->steps();
      show_->advance(recorder_.on() ? kRecordedFrame : seconds);
      if (show_->steps() > before) {
        timing_.add_step(show_->engine_ms(), show_->steps() - before);
      }
      quit_ = quit_ || (options_.frames && show_->steps() >= *options_.frames);
      if (quit_) wanted_picture_ = options_.screenshot;
      draw(seconds);
    }
    return finish(*show_, timing_, options_);
  }

 private:
  void read_events() {
    SDL_Event event;
    while (SDL_PollEvent(&event) != 0) {
      ui_.handle(event);
      controls_.handle(event, !ui_.wants_keyboard(), !ui_.wants_mouse());
    }
    window_.capture_mouse(controls_.looking());
    for (const DemoKey& key : controls_.take_demo_keys()) show_->demo_key(key);
    for (const Command command : controls_.take_commands()) obey(command);
    const float ratio = window_.pixel_ratio();
    for (const Click& click : controls_.take_clicks()) {
      show_->pick(static_cast<int>(static_cast<float>(click.x) * ratio),
                  static_cast<int>(static_cast<float>(click.y) * ratio), window_.pixel_width(),
                  window_.pixel_height());
    }
  }

  void obey(Command command) {
    switch (command) {
      case Command::quit:
        quit_ = true;
        break;
      case Command::help:
        help_ = !help_;
        break;
      case Command::panel:
        panel_ = !panel_;
        break;
      case Command::pause:
        show_->paused = !show_->paused;
        break;
      case Command::step:
        show_->paused = true;
        show_->step();
        break;
      case Command::step_back:
        show_->paused = true;
        show_->step_back();
        break;
      case Command::slower:
        show_->speed = std::max(show_->speed / 2, 1.0 / 64);
        break;
      case Command::faster:
        show_->speed = std::min(show_->speed * 2, 16.0);
        break;
      case Command::restart:
        show_->restart();
        break;
      case Command::orbit:
        controls_.orbit = !controls_.orbit;
        break;
      case Command::home:
        show_->home();
        break;
      case Command::contacts:
        show_->contacts = !show_->contacts;
        break;
      case Command::colouring:
        show_->colouring = static_cast<Colouring>((static_cast<int>(show_->colouring) + 1) % 5);
        break;
      case Command::screenshot:
        wanted_picture_ = free_name("jfpx-view", ".png");
        break;
      case Command::record:
        recorder_ = Recorder(recorder_.on() ? "" : free_name("jfpx-view-frames", ""));
        break;
      case Command::fullscreen:
        window_.set_fullscreen(!window_.fullscreen());
        break;
    }
  }

  void draw(double seconds) {
    const int width = window_.pixel_width(), height = window_.pixel_height();
    if (width == 0 || height == 0) {  // minimised
      SDL_Delay(20);
      return;
    }
    Stopwatch watch;
    ui_.begin(seconds);
    show_->draw(renderer_, {0, width, height});
    if (panel_) show_->panel();
    if (help_) show_help();
    ui_.end(0, width, height);
    timing_.add_picture(watch.lap() * 1e3);
    if (recorder_.on()) recorder_.add(picture());
    if (!wanted_picture_.empty()) write_png(picture(), std::exchange(wanted_picture_, {}));
    window_.swap();
  }

  /// What was drawn last. Taken before the swap, which may leave the back buffer undefined.
  Image picture() const {
    return Canvas::read_pixels(0, window_.pixel_width(), window_.pixel_height());
  }

  void show_help() {
    ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x / 2, ImGui::GetIO().DisplaySize.y / 2},
                            ImGuiCond_Always, {0.5f, 0.5f});
    ImGui::Begin("Keys", &help_, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
    if (ImGui::BeginTable("keys", 2)) {
      for (const KeyHelp& line : key_help()) {
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(line.keys.data());
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(line.what.data());
      }
      ImGui::EndTable();
    }
    ImGui::End();
  }

  ViewOptions options_;
  std::unique_ptr<Show> show_;
  Window window_;
  Renderer renderer_;
  Ui ui_;
  Controls controls_;
  Recorder recorder_;
  Timing timing_;
  std::string wanted_picture_;  ///< file for the next one
  bool quit_ = false, help_ = false, panel_ = true;
};

}  // namespace

int run_app(const ViewOptions& options) {
  if (!options.render) return run_without_rendering(options);
  if (options.headless) return run_headless(options);
  return App(options).run();
}

}  // namespace jfpx::inline JFPX_ABI::view
