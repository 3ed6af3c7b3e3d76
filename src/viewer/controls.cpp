/// Conversion of keyboard and mouse events to commands and camera motion.
#include "src/viewer/controls.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Real kRadiansPerPixel = Real(0.0045);
constexpr double kBodiesPerSecond = 12;  // walking speed
constexpr double kFaster = 5;
constexpr int kStill = 2;  // largest motion of the mouse during a click [units]

std::optional<std::size_t> motion_of(SDL_Scancode key) {
  switch (key) {
    case SDL_SCANCODE_A:
      return 0;
    case SDL_SCANCODE_D:
      return 1;
    case SDL_SCANCODE_S:
      return 2;
    case SDL_SCANCODE_W:
      return 3;
    case SDL_SCANCODE_Q:
      return 4;
    case SDL_SCANCODE_E:
      return 5;
    default:
      return std::nullopt;
  }
}

std::optional<Command> command_of(SDL_Keycode key, Uint16 modifiers) {
  switch (key) {
    case SDLK_ESCAPE:
      return Command::quit;
    case SDLK_F1:
      return Command::help;
    case SDLK_F2:
      return Command::panel;
    case SDLK_SPACE:
      return Command::pause;
    case SDLK_PERIOD:
    case SDLK_RIGHT:
      return Command::step;
    case SDLK_COMMA:
    case SDLK_LEFT:
      return Command::step_back;
    case SDLK_MINUS:
    case SDLK_KP_MINUS:
    case SDLK_DOWN:
      return Command::slower;
    case SDLK_PLUS:
    case SDLK_EQUALS:
    case SDLK_KP_PLUS:
    case SDLK_UP:
      return Command::faster;
    case SDLK_F5:
    case SDLK_r:  // the thesis' key
      return Command::restart;
    case SDLK_o:
      return Command::orbit;
    case SDLK_h:
    case SDLK_HOME:
      return Command::home;
    case SDLK_c:
      return Command::contacts;
    case SDLK_f:
      return Command::forces;
    case SDLK_v:
      return Command::colouring;
    case SDLK_F9:
      return Command::save;
    case SDLK_F10:
      return Command::record;
    case SDLK_F12:
      return Command::screenshot;
    case SDLK_F11:
      return Command::fullscreen;
    case SDLK_RETURN:
      if ((modifiers & KMOD_ALT) != 0) return Command::fullscreen;
      return std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::span<const KeyHelp> key_help() {
  static constexpr KeyHelp kHelp[] = {
      {"F1", "this help"},
      {"F2", "panel"},
      {"W A S D", "walk; Q and E: down and up; Shift: faster (positions on a US keyboard)"},
      {"drag", "look around, or orbit the focus"},
      {"wheel", "walking speed, or distance to the focus"},
      {"O", "orbit or walk"},
      {"H or Home", "reset the camera"},
      {"click", "pick a body and list its contacts", Feature::picking},
      {"Space", "pause"},
      {". or Right", "one step"},
      {", or Left", "one step back", Feature::history},
      {"- or Down", "slow motion"},
      {"+ or Up", "faster"},
      {"F5 or R", "restart"},
      {"C", "contact points and normals"},
      {"F", "forces without weight"},
      {"V", "property shown by colours", Feature::colouring},
      {"F9", "save all steps for jfpx replay", Feature::saving},
      {"F10", "write numbered pictures"},
      {"F12", "screenshot"},
      {"F11 or Alt Return", "full screen"},
      {"Esc", "quit"},
  };
  return kHelp;
}

void Controls::set_demo_keys(std::vector<std::string> names) {
  demo_names_ = std::move(names);
  // A pressed key may now be a key of the demo, which would receive its release.
  down_.reset();
  touched_.reset();
}

void Controls::handle(const SDL_Event& event, bool keyboard, bool mouse) {
  switch (event.type) {
    case SDL_QUIT:
      commands_.push_back(Command::quit);
      break;
    case SDL_KEYDOWN:
    case SDL_KEYUP:
      // Releases are processed even while the panel captures the keyboard; otherwise keys would
      // stick.
      if (keyboard || event.type == SDL_KEYUP) key(event.key);
      break;
    case SDL_MOUSEBUTTONDOWN:
    case SDL_MOUSEBUTTONUP:
      if (mouse || event.type == SDL_MOUSEBUTTONUP) button(event.button);
      break;
    case SDL_MOUSEMOTION:
      motion(event.motion);
      break;
    case SDL_MOUSEWHEEL:
      if (mouse) wheel_ += static_cast<float>(event.wheel.y);
      break;
    case SDL_WINDOWEVENT:
      if (event.window.event == SDL_WINDOWEVENT_FOCUS_LOST) {
        down_.reset();
        fast_ = looking_ = false;
        for (const std::string& name : demo_names_) demo_keys_.push_back({name, false});
      }
      break;
    default:
      break;
  }
}

void Controls::key(const SDL_KeyboardEvent& event) {
  const bool down = event.type == SDL_KEYDOWN;
  const SDL_Keycode code = event.keysym.sym;
  if (code == SDLK_LSHIFT || code == SDLK_RSHIFT) fast_ = down;
  if (demo_key(event.keysym.scancode, down)) return;
  if (const auto motion = motion_of(event.keysym.scancode)) {
    press(*motion, down);
  } else if (const auto command = command_of(code, event.keysym.mod); command && down) {
    const bool repeats = *command == Command::step || *command == Command::step_back;
    if (event.repeat == 0 || repeats) commands_.push_back(*command);
  }
}

bool Controls::demo_key(SDL_Scancode code, bool pressed) {
  std::string name = SDL_GetScancodeName(code);
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (std::find(demo_names_.begin(), demo_names_.end(), name) == demo_names_.end()) return false;
  demo_keys_.push_back({name, pressed});
  return true;
}

void Controls::press(std::size_t motion, bool down) {
  down_[motion] = down;
  if (down) touched_[motion] = true;
}

void Controls::button(const SDL_MouseButtonEvent& event) {
  if (event.button != SDL_BUTTON_LEFT && event.button != SDL_BUTTON_RIGHT) return;
  const bool down = event.type == SDL_MOUSEBUTTONDOWN;
  const bool fires =
      std::find(demo_names_.begin(), demo_names_.end(), "mouse") != demo_names_.end();
  if (fires && event.button == SDL_BUTTON_LEFT) {
    demo_keys_.push_back({"mouse", down});
    return;
  }
  if (!down && looking_ && !dragged_ && event.button == SDL_BUTTON_LEFT) {
    clicks_.push_back({event.x, event.y});
  }
  looking_ = down;
  dragged_ = false;
  drag_x_ = drag_y_ = 0;
}

void Controls::motion(const SDL_MouseMotionEvent& event) {
  if (!looking_) return;
  turn_x_ += static_cast<float>(event.xrel);
  turn_y_ += static_cast<float>(event.yrel);
  drag_x_ += event.xrel;
  drag_y_ += event.yrel;
  if (std::abs(drag_x_) + std::abs(drag_y_) > kStill) dragged_ = true;
}

void Controls::move(Camera* camera, double seconds, Real scale) {
  const Real yaw = static_cast<Real>(-turn_x_) * kRadiansPerPixel;
  const Real pitch = static_cast<Real>(-turn_y_) * kRadiansPerPixel;
  turn_x_ = turn_y_ = 0;
  if (orbit) {
    camera->orbit(yaw, pitch);
    camera->zoom(std::pow(Real(0.88), static_cast<Real>(wheel_)));
  } else {
    camera->turn(yaw, pitch);
    speed_ = std::clamp(speed_ * std::pow(1.25, static_cast<double>(wheel_)), 0.01, 1000.0);
  }
  wheel_ = 0;
  const auto active = down_ | touched_;
  touched_.reset();
  const auto way = [&active](std::size_t plus, std::size_t minus) {
    return static_cast<Real>(active[plus]) - static_cast<Real>(active[minus]);
  };
  const Real pace =
      static_cast<Real>(kBodiesPerSecond * speed_ * (fast_ ? kFaster : 1) * seconds) * scale;
  camera->move(way(kRight, kLeft) * pace, way(kUp, kDown) * pace, way(kAhead, kBack) * pace);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
