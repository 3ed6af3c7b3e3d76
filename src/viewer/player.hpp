/// Plays a run: steps ahead, and back through what is kept.
#pragma once

#include <jfpx/recording.hpp>

#include "src/viewer/run.hpp"

#include <deque>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// What can be changed while a scene runs.
struct RunSettings {
  Real dt = 0;  ///< [s]
  ResolverSettings resolver;
  SleepSettings sleep;
};

class Player {
 public:
  /// Moments that are kept for stepping back take no more memory than this, about.
  static constexpr std::size_t kHistoryBytes = std::size_t{192} << 20;
  static constexpr std::size_t kHistoryLength = 3000;

  Player(std::unique_ptr<Run> run, Scene scene);

  /// One step: of what was kept, or a new one; at the end none.
  void step();
  /// No step is left: the run is a recording, which is over.
  bool at_end() const { return !in_the_past() && run_->at_end(); }
  /// Shows the step before, as far as kept. What was computed stays: stepping ahead again shows the
  /// same bits. @return false at the oldest one
  bool step_back();
  /// Begins anew, on the engine and with the settings of now. @throws as make_run(); nothing has
  /// changed then.
  void restart();

  /// Goes on with another engine or backend. @return whether the bits stay those of one run.
  /// @throws BackendUnavailable; nothing has changed then.
  bool switch_to(const EngineChoice& choice);
  EngineChoice choice() const { return run_->choice(); }
  /// Writes the states of all steps, for `jfpx replay`.
  /// @throws InvalidArgument if they are not one run from the first step, or the first is no longer
  ///   kept; FileError
  void save_recording(const std::string& path) const;
  /// Before the first step: from now on each step is written to a file, which beginning anew begins
  /// anew. @throws FileError, and so do the steps
  void record_to(const std::string& path);
  /// Completes that file, if there is one; no step may follow.
  /// @throws InvalidArgument if the steps are not those of one run; FileError
  void finish_recording();
  RunSettings settings() const { return {scene_.dt, scene_.resolver, scene_.sleep}; }
  /// Replaces them from the newest moment on. @throws InvalidScene, BackendUnavailable; nothing has
  /// changed then.
  void set_settings(const RunSettings& settings);

  const Moment& shown() const { return history_[shown_]; }
  /// The moment before the one that is shown, or that one itself.
  const Moment& before() const { return history_[shown_ == 0 ? 0 : shown_ - 1]; }
  bool in_the_past() const { return shown_ + 1 < history_.size(); }
  const std::deque<Moment>& history() const { return history_; }
  const Scene& scene() const { return scene_; }

 private:
  void keep(Moment moment);
  RecordingHeader header() const;
  void go_on_with(Scene scene, const EngineChoice& choice);

  Scene scene_;
  std::unique_ptr<Run> run_;
  std::deque<Moment> history_;
  std::size_t shown_ = 0;
  std::size_t bytes_ = 0;
  bool changed_ = false;  ///< the run is no longer the one that began
  std::string recording_path_;
  std::optional<RecordingWriter> recording_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
