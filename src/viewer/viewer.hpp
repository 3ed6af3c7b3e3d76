/// Interface of the viewers that fill the window: one run, a demo, or several runs side by side.
#pragma once

#include "src/viewer/camera.hpp"
#include "src/viewer/controls.hpp"
#include "src/viewer/options.hpp"
#include "src/viewer/renderer.hpp"
#include "src/viewer/step_clock.hpp"

#include <limits>
#include <memory>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Destination of a picture.
struct Target {
  GLuint framebuffer = 0;
  int width = 0, height = 0;  ///< [pixels]
  float unit = 1;             ///< size of a unit of the window [pixels]
};

class Viewer {
 public:
  virtual ~Viewer() = default;

  /// Advances wall time and computes the due steps, at most `max_steps`. Pauses if at_end().
  void advance(double seconds, std::uint64_t max_steps = std::numeric_limits<std::uint64_t>::max());
  virtual void step() = 0;                       ///< computes one step; none if at_end()
  virtual bool at_end() const { return false; }  ///< whether there is no further step
  virtual void step_back() {}
  virtual void restart() = 0;
  virtual void home() = 0;  ///< resets the camera to show everything
  /// Draws the picture and its text. Call between Ui::begin() and Ui::end().
  virtual void draw(Renderer& renderer, const Target& target) = 0;
  /// Draws the panel. Call between Ui::begin() and Ui::end().
  virtual void panel() {}
  /// Picks the body at a point of a picture of the given size, in any unit.
  virtual void pick(Real /*x*/, Real /*y*/, int /*width*/, int /*height*/) {}
  /// Keys of a demo, named as in DemoKey.
  virtual std::vector<std::string> demo_keys() const { return {}; }
  virtual void demo_key(const DemoKey& /*key*/) {}
  /// Descriptions of the keys of a demo, for the help.
  virtual std::vector<KeyHelp> demo_help() const { return {}; }
  virtual bool has(Feature feature) const { return feature == Feature::none; }
  /// True if the camera initially walks instead of orbiting.
  virtual bool walks() const { return false; }
  /// Writes the states of all steps. @throws InvalidArgument if that is impossible; FileError
  virtual void save_recording(const std::string& path) const;
  /// Writes each following step. Call before the first step.
  /// @throws the exceptions of save_recording(), here and in step()
  virtual void record_to(const std::string& path);
  /// Completes the file of record_to(), if any. @throws the exceptions of save_recording()
  virtual void finish_recording() {}

  virtual double dt() const = 0;                      ///< [s], of the next step
  virtual std::uint64_t steps() const = 0;            ///< number of steps
  virtual double engine_ms() const = 0;               ///< of the last step
  virtual Real body_size() const = 0;                 ///< [m]
  virtual std::string summary() const { return {}; }  ///< printed at the end

  /// The exit status so far. A restart does not clear a failure.
  int status() const { return failed_ ? tool::kCheckFailed : tool::kSuccess; }

  Camera camera;
  Colouring colouring = Colouring::bodies;
  bool contacts = false, forces = false;
  bool paused = false;
  double speed = 1;

  std::vector<Command> commands;    ///< issued by the panel
  std::optional<ViewOptions> next;  ///< of the next viewer, set by the panel
  std::string message;              ///< result of the last request, for the panel

 protected:
  /// Position of the picture in the shown step, in [0, 1].
  Real share() const { return paused ? 1 : static_cast<Real>(clock_.share()); }
  /// Draws a row of buttons to run, step and restart.
  void show_run_buttons(bool with_back);

  /// Records the result of a step.
  void check(bool passed) { failed_ = failed_ || !passed; }

  StepClock clock_;

 private:
  bool failed_ = false;
};

/// True if the options select a demo with keys.
bool selects_demo(const ViewOptions& options);
/// Creates the viewer that the options select.
std::unique_ptr<Viewer> make_viewer(const ViewOptions& options);
std::unique_ptr<Viewer> make_scene_viewer(const ViewOptions& options);
/// Null if the options or the scene need states on the host, or the scene has few bodies.
std::unique_ptr<Viewer> make_device_viewer(const ViewOptions& options);
std::unique_ptr<Viewer> make_demo_viewer(const ViewOptions& options);
/// @throws BackendUnavailable in a build without Bullet.
std::unique_ptr<Viewer> make_side_by_side(const ViewOptions& options);

/// Draws a list of all named scenes and demos. @return the entry that the user has just selected
std::optional<std::string> choose_scene(const std::string& current);

/// True for demos with controls other than a restart.
bool is_playable(std::string_view name);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
