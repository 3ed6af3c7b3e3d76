/// The program in a window.
#include "src/viewer/interactive.hpp"

#include <jfpx/error.hpp>

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

constexpr double kLongestFrame = 0.25;  // [s]; after a stall the clock does not catch up
constexpr double kNoticeTime = 4;       // [s]

void add_help(const KeyHelp& line) {
  for (const std::string_view text : {line.keys, line.what}) {
    ImGui::TableNextColumn();
    widget::text(std::string(text));
  }
}

}  // namespace

App::App(const ViewOptions& options)
    : options_(options),
      show_(make_show(options)),
      window_(
          Window::open("jfpx-view: " + options.run.scene, options.size.width, options.size.height)),
      renderer_(options.quality),
      ui_(window_),
      recorder_(options.record),
      seen_{0, options.size.width, options.size.height, 1} {
  if (options.fullscreen) window_.set_fullscreen(true);
  show_->paused = options.paused;
  meet_show();
}

bool App::frame(double seconds) {
  read_events();
  controls_.move(&show_->camera, seconds, show_->body_size());
  const std::uint64_t before = show_->steps();
  const std::uint64_t last = options_.frames.value_or(std::numeric_limits<std::uint64_t>::max());
  try {
    show_->advance(recorder_.on() ? kRecordedFrame : seconds, last > before ? last - before : 0);
  } catch (const FileError& error) {
    fail_or_tell(error, false);
  }
  if (show_->steps() > before) {
    timing_.add_step(show_->engine_ms(), show_->steps() - before);
  }
  quit_ = quit_ || (options_.frames && (show_->steps() >= last || show_->at_end()));
  if (quit_) wanted_picture_ = options_.screenshot;
  draw(seconds);
  return !quit_;
}

int App::finish() {
  view::finish(*show_, timing_, options_, failure_);
  return std::max(status_, show_->status());
}

void App::read_events() {
  SDL_Event event;
  while (SDL_PollEvent(&event) != 0) {
    if (event.type == SDL_DROPFILE) open_file(event.drop.file);
    ui_.handle(event);
    controls_.handle(event, !ui_.wants_keyboard(), !ui_.wants_mouse());
  }
  window_.capture_mouse(controls_.looking());
  for (const DemoKey& key : controls_.take_demo_keys()) show_->demo_key(key);
  for (const Command command : controls_.take_commands()) try_to_obey(command);
  for (const Click& click : controls_.take_clicks()) {  // in the middle of its unit
    show_->pick(static_cast<Real>(click.x) + Real(0.5), static_cast<Real>(click.y) + Real(0.5),
                window_.width(), window_.height());
  }
}

/// Tells the controls what the show that is new wants of them, and records it if that was asked
/// for.
void App::meet_show() {
  controls_.set_demo_keys(show_->demo_keys());
  controls_.orbit = !show_->walks();
  if (!options_.recording.empty()) show_->record_to(options_.recording);
}

/// What the panel asked for while it was drawn.
void App::grant_wishes() {
  for (const Command command : std::exchange(show_->commands, {})) try_to_obey(command);
  if (!show_->next) return;
  try {
    open(*std::exchange(show_->next, std::nullopt));
  } catch (const Error& error) {
    show_->message = error.what();
  }
}

/// A scene or a recording that was dropped on the window; the path is SDL's to be freed.
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
    tell(error.what());
  }
}

/// Shows something else, as what is shown is. @throws what loading and engines throw; nothing has
/// changed then.
void App::open(const ViewOptions& next) {
  check(next);
  std::unique_ptr<Show> fresh = make_show(next);
  fresh->paused = show_->paused;
  fresh->speed = show_->speed;
  fresh->colouring = show_->colouring;
  fresh->contacts = show_->contacts;
  fresh->forces = show_->forces;
  status_ = std::max(status_, show_->status());
  show_ = std::move(fresh);
  meet_show();
  window_.set_title("jfpx-view: " + next.run.scene);
}

/// What can't be done now is told and changes nothing.
void App::try_to_obey(Command command) {
  try {
    obey(command);
  } catch (const Error& error) {
    tell(error.what());
  }
}

void App::obey(Command command) {
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
    case Command::forces:
      show_->forces = !show_->forces;
      break;
    case Command::colouring:
      show_->colouring = static_cast<Colouring>((static_cast<std::size_t>(show_->colouring) + 1) %
                                                std::size(kColouringNames));
      break;
    case Command::screenshot:
      wanted_picture_ = free_name("jfpx-view", ".png");
      break;
    case Command::record:
      toggle_recorder();
      break;
    case Command::save:
      save_recording();
      break;
    case Command::fullscreen:
      window_.set_fullscreen(!window_.fullscreen());
      break;
  }
}

void App::toggle_recorder() {
  if (recorder_.on()) {
    recorder_ = Recorder("");
    tell("no more pictures are recorded");
    return;
  }
  const std::string folder = free_name("jfpx-view-frames", "");
  recorder_ = Recorder(folder);
  tell("pictures go to " + folder);
}

void App::save_recording() {
  const std::string name = free_name("jfpx-view", ".rec");
  show_->save_recording(name);
  tell("wrote " + name);
}

void App::write_pictures(const Target& target) {
  const bool picture_by_key = wanted_picture_ != options_.screenshot;
  try {
    if (!wanted_picture_.empty()) save_picture(target);
  } catch (const FileError& error) {
    fail_or_tell(error, picture_by_key);
  }
  if (!recorder_.on()) return;
  const bool film_by_key = recorder_.folder() != options_.record;
  try {
    recorder_.add(picture(target));
  } catch (const FileError& error) {
    recorder_ = Recorder("");
    fail_or_tell(error, film_by_key);
  }
}

/// What the command line asked for must be written, or the program ends; a key's wish is told to
/// have failed. Called while the error is handled.
void App::fail_or_tell(const Error& error, bool by_key) {
  if (by_key) {
    tell(error.what());
    return;
  }
  if (!failure_) failure_ = std::current_exception();
  quit_ = true;
}

void App::save_picture(const Target& target) {
  const std::string name = std::exchange(wanted_picture_, {});
  write_png(picture(target), name);
  tell("wrote " + name);
}

void App::tell(const std::string& what) {
  notice_ = what;
  notice_left_ = kNoticeTime;
}

void App::draw(double seconds) {
  if (window_.minimised()) {
    draw_unseen(seconds);
  } else {
    seen_ = {0, window_.pixel_width(), window_.pixel_height(), window_.pixel_ratio()};
    draw_to(seen_, seconds);
    window_.swap();
  }
  grant_wishes();
}

/// A window that is minimised has no pixels to read. A picture that is wanted is drawn as large as
/// the window was.
void App::draw_unseen(double seconds) {
  if (wanted_picture_.empty() && !recorder_.on()) {
    SDL_Delay(20);
    return;
  }
  const Canvas canvas(seen_.width, seen_.height);
  Target target = seen_;
  target.framebuffer = canvas.framebuffer();
  draw_to(target, seconds);
}

void App::draw_to(const Target& target, double seconds) {
  Stopwatch watch;
  ui_.begin(seconds);
  show_->draw(renderer_, target);
  if (panel_) show_->panel();
  if (help_) show_help();
  show_notice(seconds);
  ui_.end(target.framebuffer, target.width, target.height);
  timing_.add_picture(watch.lap() * 1e3);
  write_pictures(target);
}

/// What was drawn last. Taken before the swap, which may leave the back buffer undefined. What a
/// lost context leaves is no picture.
Image App::picture(const Target& target) const {
  Image image = Canvas::read_pixels(target.framebuffer, target.width, target.height);
  window_.check_context();
  return image;
}

void App::show_help() {
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x / 2, ImGui::GetIO().DisplaySize.y / 2},
                          ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::Begin("Keys", &help_, ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse);
  if (ImGui::BeginTable("keys", 2)) {
    for (const KeyHelp& line : show_->demo_help()) add_help(line);
    for (const KeyHelp& line : key_help()) {
      if (show_->has(line.of)) add_help(line);
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
