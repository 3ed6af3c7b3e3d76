/// What fills the window: one run, or several side by side.
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

/// Where a picture goes.
struct Target {
  GLuint framebuffer = 0;
  int width = 0, height = 0;  ///< pixels
  float unit = 1;             ///< pixels of one unit of the window
};

class Show {
 public:
  virtual ~Show() = default;

  /// Lets wall time pass: makes the steps that are due, `most` of them at most. At the end the show
  /// pauses.
  void advance(double seconds, std::uint64_t most = std::numeric_limits<std::uint64_t>::max());
  virtual void step() = 0;                       ///< exactly one step; at the end none
  virtual bool at_end() const { return false; }  ///< no step is left
  virtual void step_back() {}
  virtual void restart() = 0;
  virtual void home() = 0;  ///< the camera shows everything again
  /// Draws bodies, and text that belongs to the picture; between Ui::begin() and Ui::end().
  virtual void draw(Renderer& renderer, const Target& target) = 0;
  virtual void panel() {}  ///< likewise
  /// Looks for a body at a point of a picture that is as large as said, in any unit.
  virtual void pick(Real /*x*/, Real /*y*/, int /*width*/, int /*height*/) {}
  /// Keys of a demo, as in DemoKey.
  virtual std::vector<std::string> demo_keys() const { return {}; }
  virtual void demo_key(const DemoKey& /*key*/) {}
  /// What they do, for the help.
  virtual std::vector<KeyHelp> demo_help() const { return {}; }
  virtual bool has(Feature feature) const { return feature == Feature::none; }
  /// Walking instead of circling at first.
  virtual bool walks() const { return false; }
  /// Writes the states of all steps. @throws InvalidArgument where that can't be, FileError
  virtual void save_recording(const std::string& path) const;
  /// Before the first step: writes each step. @throws as save_recording(), and so do the steps
  virtual void record_to(const std::string& path);
  /// Completes what record_to() began, if that was called. @throws as save_recording()
  virtual void finish_recording() {}

  virtual double dt() const = 0;                      ///< [s], of the next step
  virtual std::uint64_t steps() const = 0;            ///< made so far
  virtual double engine_ms() const = 0;               ///< of the last step
  virtual Real body_size() const = 0;                 ///< [m]
  virtual std::string summary() const { return {}; }  ///< printed at the end

  /// The exit status so far: what failed once has failed, whatever starts again.
  int status() const { return failed_ ? tool::kCheckFailed : tool::kSuccess; }

  Camera camera;
  Colouring colouring = Colouring::bodies;
  bool contacts = false, forces = false;
  bool paused = false;
  double speed = 1;

  std::vector<Command> commands;    ///< that the panel asks for
  std::optional<ViewOptions> next;  ///< another show, likewise
  std::string message;              ///< what became of that, for the panel

 protected:
  /// How far the picture is into the step that is shown: 0 to 1.
  Real share() const { return paused ? 1 : static_cast<Real>(clock_.share()); }
  /// Buttons to run, step and start again, in a row.
  void show_run_buttons(bool with_back);

  /// After each step.
  void check(bool well) { failed_ = failed_ || !well; }

  StepClock clock_;

 private:
  bool failed_ = false;
};

/// Whether the options ask for a demo with its own keys.
bool shows_demo(const ViewOptions& options);
/// The show that the options ask for.
std::unique_ptr<Show> make_show(const ViewOptions& options);
std::unique_ptr<Show> make_scene_show(const ViewOptions& options);
std::unique_ptr<Show> make_demo_show(const ViewOptions& options);
/// @throws BackendUnavailable in a build without Bullet.
std::unique_ptr<Show> make_side_by_side(const ViewOptions& options);

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
