/// The program in a window: the loop of events, steps and pictures.
#include "src/viewer/interactive.hpp"

#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/viewer/widgets.hpp"

#include <algorithm>
#include <imgui.h>
#include <iterator>
#include <limits>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr double kLongestFrame = 0.25;  // [s]; limits the steps after a stall
constexpr double kNoticeTime = 4;       // [s]

void add_help(const KeyHelp& line) {
  for (const std::string_view text : {line.keys, line.action}) {
    ImGui::TableNextColumn();
    widget::text(std::string(text));
  }
}

}  // namespace

App::App(const ViewOptions& options)
    : options_(options),
      viewer_(make_viewer(options)),
      window_(
          Window::open("jfpx-view: " + options.run.scene, options.size.width, options.size.height)),
      renderer_(options.quality),
      ui_(window_),
      image_sequence_(options.pictures),
      last_target_{0, options.size.width, options.size.height, 1} {
  if (options.fullscreen) window_.set_fullscreen(true);
  viewer_->paused = options.paused;
  attach_viewer();
}

bool App::frame(double seconds) {
  read_events();
  controls_.move(&viewer_->camera, seconds, viewer_->body_size());
  const std::uint64_t before = viewer_->steps();
  const std::uint64_t last = options_.frames.value_or(std::numeric_limits<std::uint64_t>::max());
  try {
    viewer_->advance(image_sequence_.on() ? kRecordedFrame : seconds,
                     last > before ? last - before : 0);
  } catch (const FileError& error) {
    fail_or_notify(error, false);
  }
  if (viewer_->steps() > before) {
    timing_.add_step(viewer_->engine_ms(), viewer_->steps() - before);
  }
  quit_ = quit_ || (options_.frames && (viewer_->steps() >= last || viewer_->at_end()));
  if (quit_) requested_picture_ = options_.screenshot;
  draw(seconds);
  return !quit_;
}

int App::finish() {
  view::finish(*viewer_, timing_, options_, failure_);
  return std::max(status_, viewer_->status());
}

void App::read_events() {
  SDL_Event event;
  while (SDL_PollEvent(&event) != 0) {
    if (event.type == SDL_DROPFILE) open_file(event.drop.file);
    ui_.handle(event);
    controls_.handle(event, !ui_.wants_keyboard(), !ui_.wants_mouse());
  }
  window_.capture_mouse(controls_.looking());
  for (const DemoKey& key : controls_.take_demo_keys()) viewer_->demo_key(key);
  for (const Command command : controls_.take_commands()) try_to_execute(command);
  for (const Click& click : controls_.take_clicks()) {  // at the centre of the unit
    viewer_->pick(static_cast<Real>(click.x) + Real(0.5), static_cast<Real>(click.y) + Real(0.5),
                  window_.width(), window_.height());
  }
}

/// Configures the controls for a new viewer, and starts its recording if requested by the options.
void App::attach_viewer() {
  controls_.set_demo_keys(viewer_->demo_keys());
  controls_.orbit = !viewer_->walks();
  if (!options_.recording.empty()) viewer_->record_to(options_.recording);
}

/// Executes the commands that the panel issued while it was drawn.
void App::apply_panel_requests() {
  for (const Command command : std::exchange(viewer_->commands, {})) try_to_execute(command);
  if (!viewer_->next) return;
  try {
    open(*std::exchange(viewer_->next, std::nullopt));
  } catch (const Error& error) {
    viewer_->message = error.what();
  }
}

/// Opens a scene or a recording that was dropped on the window. Frees the path, which SDL
/// allocated.
void App::open_file(char* path) {
  const std::unique_ptr<char, void (*)(void*)> owner(path, SDL_free);
  ViewOptions next = options_;
  next.run = {};
  next.run.scene = path;
  next.input.clear();
  next.eye = next.target = std::nullopt;
  if (is_recording(path)) {
    next.choice = {};
    next.side_by_side = false;
  }
  try {
    open(next);
  } catch (const Error& error) {
    notify(error.what());
  }
}

/// Replaces the viewer and keeps its display settings.
/// @throws exceptions of scene loading and engines; nothing has changed then
void App::open(const ViewOptions& next) {
  check(next);
  std::unique_ptr<Viewer> fresh = make_viewer(next);
  fresh->paused = viewer_->paused;
  fresh->speed = viewer_->speed;
  fresh->colouring = viewer_->colouring;
  fresh->contacts = viewer_->contacts;
  fresh->forces = viewer_->forces;
  status_ = std::max(status_, viewer_->status());
  viewer_ = std::move(fresh);
  attach_viewer();
  window_.set_title("jfpx-view: " + next.run.scene);
}

/// Executes a command. A command that fails is reported in the window and has no effect.
void App::try_to_execute(Command command) {
  try {
    execute(command);
  } catch (const Error& error) {
    notify(error.what());
  }
}

void App::execute(Command command) {
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
      viewer_->paused = !viewer_->paused;
      break;
    case Command::step:
      viewer_->paused = true;
      viewer_->step();
      break;
    case Command::step_back:
      viewer_->paused = true;
      viewer_->step_back();
      break;
    case Command::slower:
      viewer_->speed = std::max(viewer_->speed / 2, 1.0 / 64);
      break;
    case Command::faster:
      viewer_->speed = std::min(viewer_->speed * 2, 16.0);
      break;
    case Command::restart:
      viewer_->restart();
      break;
    case Command::orbit:
      controls_.orbit = !controls_.orbit;
      break;
    case Command::home:
      viewer_->home();
      break;
    case Command::contacts:
      viewer_->contacts = !viewer_->contacts;
      break;
    case Command::forces:
      viewer_->forces = !viewer_->forces;
      break;
    case Command::colouring:
      viewer_->colouring = static_cast<Colouring>(
          (static_cast<std::size_t>(viewer_->colouring) + 1) % std::size(kColouringNames));
      break;
    case Command::screenshot:
      requested_picture_ = free_name("jfpx-view", ".png");
      break;
    case Command::record:
      toggle_image_sequence();
      break;
    case Command::save:
      save_recording();
      break;
    case Command::fullscreen:
      window_.set_fullscreen(!window_.fullscreen());
      break;
  }
}

void App::toggle_image_sequence() {
  if (image_sequence_.on()) {
    image_sequence_ = ImageSequenceWriter("");
    notify("stopped writing pictures");
    return;
  }
  const std::string folder = free_name("jfpx-view-frames", "");
  image_sequence_ = ImageSequenceWriter(folder);
  notify("writing pictures to " + folder);
}

void App::save_recording() {
  const std::string name = free_name("jfpx-view", ".rec");
  viewer_->save_recording(name);
  notify("wrote " + name);
}

void App::write_pictures(const Target& target) {
  const bool picture_by_key = requested_picture_ != options_.screenshot;
  try {
    if (!requested_picture_.empty()) save_picture(target);
  } catch (const FileError& error) {
    fail_or_notify(error, picture_by_key);
  }
  if (!image_sequence_.on()) return;
  const bool film_by_key = image_sequence_.folder() != options_.pictures;
  try {
    image_sequence_.add(picture(target));
  } catch (const FileError& error) {
    image_sequence_ = ImageSequenceWriter("");
    fail_or_notify(error, film_by_key);
  }
}

/// Ends the program if a file given on the command line can't be written; reports the failure of a
/// command in the window. Called while the exception is handled.
void App::fail_or_notify(const Error& error, bool by_key) {
  if (by_key) {
    notify(error.what());
    return;
  }
  if (!failure_) failure_ = std::current_exception();
  quit_ = true;
}

void App::save_picture(const Target& target) {
  const std::string name = std::exchange(requested_picture_, {});
  write_png(picture(target), name);
  notify("wrote " + name);
}

void App::notify(const std::string& text) {
  notice_ = text;
  notice_left_ = kNoticeTime;
}

void App::draw(double seconds) {
  if (window_.minimised()) {
    draw_minimised(seconds);
  } else {
    last_target_ = {0, window_.pixel_width(), window_.pixel_height(), window_.pixel_ratio()};
    draw_to(last_target_, seconds);
    window_.swap();
  }
  apply_panel_requests();
}

/// Draws requested pictures offscreen in the last window size, because a minimised window has no
/// pixels.
void App::draw_minimised(double seconds) {
  if (requested_picture_.empty() && !image_sequence_.on()) {
    SDL_Delay(20);
    return;
  }
  const OffscreenFramebuffer offscreen(last_target_.width, last_target_.height);
  Target target = last_target_;
  target.framebuffer = offscreen.framebuffer();
  draw_to(target, seconds);
}

void App::draw_to(const Target& target, double seconds) {
  Stopwatch watch;
  ui_.begin(seconds);
  viewer_->draw(renderer_, target);
  if (panel_) viewer_->panel();
  if (help_) show_help();
  show_notice(seconds);
  ui_.end(target.framebuffer, target.width, target.height);
  timing_.add_picture(watch.lap_ms());
  write_pictures(target);
}

/// Reads the last picture. Must be called before the swap, which may leave the back buffer
/// undefined. Pixels read after a lost context are invalid.
Image App::picture(const Target& target) const {
  Image image = OffscreenFramebuffer::read_pixels(target.framebuffer, target.width, target.height);
  window_.check_context();
  return image;
}

void App::show_help() {
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x / 2, ImGui::GetIO().DisplaySize.y / 2},
                          ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::Begin("Keys", &help_, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
  if (ImGui::BeginTable("keys", 2)) {
    for (const KeyHelp& line : viewer_->demo_help()) add_help(line);
    for (const KeyHelp& line : key_help()) {
      if (viewer_->has(line.of)) add_help(line);
    }
    ImGui::EndTable();
  }
  ImGui::End();
}

void App::show_notice(double seconds) {
  if (notice_left_ <= 0) return;
  notice_left_ -= seconds;
  const ImVec2 size = ImGui::CalcTextSize(notice_.c_str());
  const ImVec2 screen = ImGui::GetIO().DisplaySize;
  const ImVec2 at{(screen.x - size.x) / 2, screen.y - size.y - 24};
  ImDrawList* list = ImGui::GetForegroundDrawList();
  list->AddRectFilled({at.x - 12, at.y - 8}, {at.x + size.x + 12, at.y + size.y + 8},
                      IM_COL32(12, 16, 22, 210), 6);
  list->AddText(at, IM_COL32_WHITE, notice_.c_str());
}

int run_interactive(const ViewOptions& options) {
  App app(options);
  Stopwatch clock;
  while (app.frame(std::min(clock.lap(), kLongestFrame))) {
  }
  return app.finish();
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
