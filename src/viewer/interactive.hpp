/// The program in a window: events, steps that are due, a picture, and so on until it is closed.
#pragma once

#include <jfpx/error.hpp>

#include "src/viewer/app.hpp"
#include "src/viewer/recorder.hpp"
#include "src/viewer/show.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/ui.hpp"

#include <exception>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// One at a time, because SDL is one.
class App {
 public:
  /// Opens the window. @throws what loading, engines and OpenGL throw.
  explicit App(const ViewOptions& options);

  /// Obeys the events that have come, lets `seconds` pass, and draws.
  /// @return false after the last picture, which is that before one can't be written that the
  ///   command line asked for
  /// @throws BackendUnavailable if OpenGL lost its context
  bool frame(double seconds);
  /// What is completed and printed at the end. @return the exit status
  /// @throws Error for the first thing that the command line asked for and can't be written
  int finish();

  Show& show() { return *show_; }
  Window& window() { return window_; }

 private:
  void read_events();
  void meet_show();
  void grant_wishes();
  void open(const ViewOptions& next);
  void open_file(char* path);
  void try_to_obey(Command command);
  void obey(Command command);
  void toggle_recorder();
  void save_recording();
  void write_pictures(const Target& target);
  void save_picture(const Target& target);
  void fail_or_tell(const Error& error, bool by_key);
  Image picture(const Target& target) const;
  void tell(const std::string& what);
  void draw(double seconds);
  void draw_unseen(double seconds);
  void draw_to(const Target& target, double seconds);
  void show_help();
  void show_notice(double seconds);

  ViewOptions options_;
  std::unique_ptr<Show> show_;
  Window window_;
  Renderer renderer_;
  Ui ui_;
  Controls controls_;
  Recorder recorder_;
  Timing timing_;
  Target seen_;                 ///< the window as it was last seen
  std::string wanted_picture_;  ///< file for the next one
  std::string notice_;          ///< shown for a while
  double notice_left_ = 0;      ///< [s]
  std::exception_ptr failure_;  ///< to write what the command line asked for
  int status_ = 0;              ///< of the shows before
  bool quit_ = false, help_ = false, panel_ = true;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
