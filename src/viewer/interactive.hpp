/// The program in a window: the loop of events, steps and pictures.
#pragma once

#include <jfpx/error.hpp>

#include "src/viewer/app.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/ui.hpp"
#include "src/viewer/viewer.hpp"

#include <exception>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// The interactive program. Only one object may exist at a time, because SDL is global.
class App {
 public:
  /// Opens the window. @throws exceptions of scene loading, engines and OpenGL
  explicit App(const ViewOptions& options);

  /// Processes the pending events, advances the time by `seconds`, and draws.
  /// @return false after the last picture, or when a file given on the command line can't be
  /// written
  /// @throws BackendUnavailable if OpenGL lost its context
  bool frame(double seconds);
  /// Completes the recording and prints the summary. @return the exit status
  /// @throws Error for the first file given on the command line that can't be written
  int finish();

  Viewer& viewer() { return *viewer_; }
  Window& window() { return window_; }

 private:
  void read_events();
  void attach_viewer();
  void apply_panel_requests();
  void open(const ViewOptions& next);
  void open_file(char* path);
  void try_to_execute(Command command);
  void execute(Command command);
  void toggle_image_sequence();
  void save_recording();
  void write_pictures(const Target& target);
  void save_picture(const Target& target);
  void fail_or_notify(const Error& error, bool by_key);
  Image picture(const Target& target) const;
  void notify(const std::string& text);
  void draw(double seconds);
  void draw_minimised(double seconds);
  void draw_to(const Target& target, double seconds);
  void show_help();
  void show_notice(double seconds);

  ViewOptions options_;
  std::unique_ptr<Viewer> viewer_;
  Window window_;
  Renderer renderer_;
  Ui ui_;
  Controls controls_;
  ImageSequenceWriter image_sequence_;
  Timing timing_;
  Target last_target_;             ///< the window when it was last visible
  std::string requested_picture_;  ///< file of the next picture
  std::string notice_;             ///< displayed for a while
  double notice_left_ = 0;         ///< [s]
  std::exception_ptr failure_;     ///< to write a file given on the command line
  int status_ = 0;                 ///< of the previous viewers
  bool quit_ = false, help_ = false, panel_ = true;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
