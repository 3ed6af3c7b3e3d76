/// Conversion of keyboard and mouse events to commands and camera motion.
#pragma once

#include "src/viewer/camera.hpp"

#include <SDL.h>

#include <bitset>
#include <cstdint>
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

/// Optional features of viewers.
enum class Feature : std::uint8_t { none, picking, history, colouring, saving };

/// One line of the help.
struct KeyHelp {
  std::string_view keys, action;
  Feature of = Feature::none;  ///< feature that the keys belong to
};
std::span<const KeyHelp> key_help();

/// A click without a drag, in units of the window.
struct Click {
  int x, y;
};

/// Press or release of a key of a demo. The name is SDL's lower-case name of the key at that
/// position on a US keyboard.
struct DemoKey {
  std::string name;
  bool pressed;
};

/// Processes every event in order: a key that is pressed and released between two frames still acts
/// once (erratum E42). Unknown keys are ignored. Keys for walking and keys of demos are identified
/// by position (scancode), so that they are adjacent on any keyboard layout; other keys by label
/// (keycode).
class Controls {
 public:
  /// Sets the keys of a demo, which take_demo_keys() returns instead of moving the camera. Pressed
  /// keys no longer move the camera.
  void set_demo_keys(std::vector<std::string> names);
  /// @param keyboard, mouse false while the panel captures the device
  void handle(const SDL_Event& event, bool keyboard = true, bool mouse = true);
  std::vector<Command> take_commands() { return std::exchange(commands_, {}); }
  std::vector<Click> take_clicks() { return std::exchange(clicks_, {}); }
  std::vector<DemoKey> take_demo_keys() { return std::exchange(demo_keys_, {}); }
  bool looking() const { return looking_; }

  /// Moves the camera by the events since the last call. @param scale size of a body [m]
  void move(Camera* camera, double seconds, Real scale);

  bool orbit = true;  ///< orbit the focus instead of walking

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
  int drag_x_ = 0, drag_y_ = 0;  ///< [units] since the press of the button
  double speed_ = 1;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
