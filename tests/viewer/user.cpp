/// Simulated user of the window.
#include "tests/viewer/user.hpp"

#include "tests/viewer/window_fixture.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace {

struct Mouse {
  SDL_Window* window = nullptr;
  int x = 0, y = 0;
  Uint32 buttons = 0;
};
Mouse mouse;
double screen_density = 1;

}  // namespace

// These replace functions of SDL, whose offscreen driver has no mouse and uses pixels as units. On
// a dense screen a window has more pixels than units.
extern "C" SDL_Window* SDL_GetMouseFocus() { return mouse.window; }
extern "C" Uint32 SDL_GetMouseState(int* x, int* y) {
  if (x != nullptr) *x = mouse.x;
  if (y != nullptr) *y = mouse.y;
  return mouse.buttons;
}
extern "C" void SDL_GetWindowSize(SDL_Window* window, int* width, int* height) {
  SDL_GL_GetDrawableSize(window, width, height);
  for (int* size : {width, height}) {
    if (size != nullptr) *size = static_cast<int>(std::lround(*size / screen_density));
  }
}

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {

User::User(view::ViewOptions options, double density)
    : app_(on_screen(std::move(options), density)) {
  mouse = {app_.window().sdl()};
  view::widget::set_log(&log_);
  for (int i = 0; i < 3; ++i) frame();  // Dear ImGui sizes panels in the first frames
}

User::~User() {
  mouse = {};
  screen_density = 1;
}

view::ViewOptions User::on_screen(view::ViewOptions options, double density) {
  screen_density = density;
  for (int* size : {&options.size.width, &options.size.height}) {
    *size = static_cast<int>(std::lround(*size * density));
  }
  return options;
}

bool User::frame(double seconds) {
  log_ = {};
  return app_.frame(seconds);
}

std::string User::value(const std::string& label) const {
  return sees(label) ? find(label).value : "";
}

bool User::reads(std::string_view part) const {
  const auto has_part = [part](const std::string& text) {
    return text.find(part) != std::string::npos;
  };
  return std::any_of(texts().begin(), texts().end(), has_part);
}

const view::PanelLog::Widget& User::find(const std::string& label) const {
  const auto found = log_.widgets.find(label);
  if (found == log_.widgets.end()) throw std::runtime_error("the panel does not show " + label);
  return found->second;
}

void User::drag_in(const std::string& label, double from, double to) {
  const view::PanelLog::Widget place = find(label);
  const auto x = [&place](double share) {
    return place.left + 1 + (place.right - place.left - 2) * static_cast<float>(share);
  };
  const float y = (place.top + place.bottom) / 2;
  drag(x(from), y, x(to), y);
}

void User::choose(const std::string& list, const std::string& entry) {
  const auto before = log_.widgets;
  click(list);
  frame();  // Dear ImGui sizes the list in its first frame
  for (int i = 0; i < 20 && !sees(entry); ++i) {
    std::vector<view::PanelLog::Widget> entries;
    for (const auto& [label, widget] : log_.widgets) {
      if (!before.contains(label)) entries.push_back(widget);
    }
    if (entries.empty()) break;
    // The first and the last entry may be outside of the list for the most part.
    const auto middle = entries.begin() + static_cast<std::ptrdiff_t>(entries.size() / 2);
    std::ranges::nth_element(entries, middle, {}, &view::PanelLog::Widget::top);
    move_to(middle->left + 4, (middle->top + middle->bottom) / 2);
    SDL_Event event{};
    event.type = SDL_MOUSEWHEEL;
    event.wheel.y = -1;
#if SDL_VERSION_ATLEAST(2, 0, 18)
    event.wheel.preciseY = -1;  // which Dear ImGui reads since 1.89
#endif
    SDL_PushEvent(&event);
    frame();
    frame();
  }
  click(entry);
}

void User::type(const std::string& field, const std::string& text) {
  click(field);
  SDL_Event event{};
  event.type = SDL_TEXTINPUT;
  text.copy(event.text.text, sizeof event.text.text - 1);
  SDL_PushEvent(&event);
  frame();
  for (const bool down : {true, false}) {
    push_key(SDLK_RETURN, down);
    frame();
  }
}

void User::click_at(Real x, Real y) { drag(x, y, x, y); }

void User::drag(Real from_x, Real from_y, Real to_x, Real to_y) {
  move_to(static_cast<float>(from_x), static_cast<float>(from_y));
  press(true);
  if (from_x != to_x || from_y != to_y) {
    move_to(static_cast<float>(to_x), static_cast<float>(to_y));
  }
  press(false);
}

void User::move_to(float x, float y) {
  SDL_Event event{};
  event.type = SDL_MOUSEMOTION;
  event.motion.state = mouse.buttons;
  event.motion.x = static_cast<int>(x);
  event.motion.y = static_cast<int>(y);
  event.motion.xrel = event.motion.x - mouse.x;
  event.motion.yrel = event.motion.y - mouse.y;
  mouse.x = event.motion.x;
  mouse.y = event.motion.y;
  SDL_PushEvent(&event);
  frame();
}

void User::press(bool down) {
  mouse.buttons = down ? SDL_BUTTON_LMASK : 0;
  SDL_Event event{};
  event.type = down ? SDL_MOUSEBUTTONDOWN : SDL_MOUSEBUTTONUP;
  event.button.button = SDL_BUTTON_LEFT;
  event.button.state = down ? SDL_PRESSED : SDL_RELEASED;
  event.button.x = mouse.x;
  event.button.y = mouse.y;
  SDL_PushEvent(&event);
  frame();
  if (!down) frame();  // shows the effect of the click
}

}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
