/// Playback of a run: steps forward, and backward through a history.
#pragma once

#include <jfpx/recording.hpp>

#include "src/viewer/run.hpp"

#include <deque>
#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Settings that can be changed during a run.
struct RunSettings {
  Real dt = 0;  ///< [s]
  Solver solver = Solver::soft_step;
  SoftStepSettings soft_step;
  ResolverSettings resolver;
  SleepSettings sleep;
};

class Player {
 public:
  /// Approximate limit of the memory of the history.
  static constexpr std::size_t kHistoryBytes = std::size_t{192} << 20;
  static constexpr std::size_t kHistoryLength = 3000;

  Player(std::unique_ptr<Run> run, Scene scene);

  /// Advances one step in the history or, at its end, computes one. Has no effect if at_end().
  void step();
  /// True at the end of a recording.
  bool at_end() const { return !in_the_past() && run_->at_end(); }
  /// Shows the previous step of the history. Computed steps are kept: stepping forward again shows
  /// the same bits. @return false at the oldest step
  bool step_back();
  /// Restarts with the current engine and settings. @throws the exceptions of make_run(), without a
  /// change
  void restart();

  /// Continues with another engine or backend. @return true if the bits equal those of an
  /// uninterrupted run. @throws BackendUnavailable, without a change
  bool switch_to(const EngineChoice& choice);
  EngineChoice choice() const { return run_->choice(); }
  /// Writes the states of all steps, for `jfpx replay`.
  /// @throws InvalidArgument if the steps are not those of one run, or the first step is no longer
  ///   in the history; FileError
  void save_recording(const std::string& path) const;
  /// Writes each following step to a file; a restart restarts the file. Call before the first step.
  /// @throws FileError; step() and restart() then also throw it
  void record_to(const std::string& path);
  /// Completes the file of record_to(), if any. No step may follow.
  /// @throws InvalidArgument if the steps are not those of one run; FileError
  void finish_recording();
  RunSettings settings() const {
    return {scene_.dt, scene_.solver, scene_.soft_step, scene_.resolver, scene_.sleep};
  }
  /// Continues from the newest state with other settings.
  /// @throws InvalidScene, BackendUnavailable, without a change
  void set_settings(const RunSettings& settings);

  const RunState& shown() const { return history_[shown_]; }
  /// The state before shown(), or shown() itself if it is the oldest.
  const RunState& before() const { return history_[shown_ == 0 ? 0 : shown_ - 1]; }
  bool in_the_past() const { return shown_ + 1 < history_.size(); }
  const std::deque<RunState>& history() const { return history_; }
  const Scene& scene() const { return scene_; }

 private:
  void keep(RunState run_state);
  RecordingHeader header() const;
  void continue_with(Scene scene, const EngineChoice& choice);

  Scene scene_;
  std::unique_ptr<Run> run_;
  std::deque<RunState> history_;
  std::size_t shown_ = 0;
  std::size_t bytes_ = 0;
  bool changed_ = false;  ///< the engine or the settings have changed since the start
  std::string recording_path_;
  std::optional<RecordingWriter> recording_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
