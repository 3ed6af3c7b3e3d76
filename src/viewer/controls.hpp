/// Keys and mouse: events in their order become commands and motion.
#pragma once

#include "src/viewer/camera.hpp"

#include <SDL.h>

#include <bitset>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

enum class Command : std::uint8_t {
  quit,
  help,
  panel,
  pause,
  step,
  step_back,
  slower,
  faster,
  restart,
  orbit,
  home,
  contacts,
  forces,
  colouring,
  screenshot,
  record,
  save,
  fullscreen,
};

/// What not every show has.
enum class Feature : std::uint8_t { none, picking, history, colouring, saving };

/// One line of the help.
struct KeyHelp {
  std::string_view keys, what;
  Feature of = Feature::none;  ///< that the keys belong to
};
std::span<const KeyHelp> key_help();

/// A click without a drag, in the window's units.
struct Click {
  int x, y;
};

/// A demo's key went down or up: the one where a US keyboard has that name, in SDL's words and
/// lower case.
struct DemoKey {
  std::string name;
  bool pressed;
};

/// Events act in the order in which they came, and all of them: a key that is pressed and released
/// between two frames still acts once (erratum E42). Keys without a meaning do nothing. Keys to
/// walk and those of demos count by their place, so that they lie together on any keyboard; others
/// by what is written on them.
class Controls {
 public:
  /// Keys that belong to a demo are kept from the camera: see take_demo_keys(). Keys that are down
  /// walk no more.
  void set_demo_keys(std::vector<std::string> names);
  /// @param keyboard, mouse whether the panel leaves them to the scene
  void handle(const SDL_Event& event, bool keyboard = true, bool mouse = true);
  std::vector<Command> take_commands() { return std::exchange(commands_, {}); }
  std::vector<Click> take_clicks() { return std::exchange(clicks_, {}); }
  std::vector<DemoKey> take_demo_keys() { return std::exchange(demo_keys_, {}); }
  bool looking() const { return looking_; }

  /// Moves the camera by what happened since the last call; `scale` is the size of a body [m].
  void move(Camera* camera, double seconds, Real scale);

  bool orbit = true;  ///< circle the focus instead of walking

 private:
  enum Motion : std::size_t { kLeft, kRight, kBack, kAhead, kDown, kUp, kMotions };

  void key(const SDL_KeyboardEvent& event);
  bool demo_key(SDL_Scancode key, bool pressed);
  void press(std::size_t motion, bool down);
  void button(const SDL_MouseButtonEvent& event);
  void motion(const SDL_MouseMotionEvent& event);

  std::vector<Command> commands_;
  std::vector<Click> clicks_;
  std::vector<DemoKey> demo_keys_;
  std::vector<std::string> demo_names_;
  std::bitset<kMotions> down_, touched_;
  bool fast_ = false, looking_ = false, dragged_ = false;
  float turn_x_ = 0, turn_y_ = 0, wheel_ = 0;
  int drag_x_ = 0, drag_y_ = 0;  ///< [units] since the button went down
  double speed_ = 1;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
