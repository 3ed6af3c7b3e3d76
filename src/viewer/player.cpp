/// Playback of a run: steps forward, and backward through a history.
#include "src/viewer/player.hpp"

#include <jfpx/error.hpp>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

std::size_t bytes_of(const RunState& run_state) {
  return sizeof run_state + run_state.states.size() * (sizeof(BodyState) + 1) +
         run_state.contacts.size() * sizeof(Contact);
}

constexpr const char* kNotOneRun =
    "the engine or the settings changed during the run, which can't be replayed";

[[noreturn]] void refuse_recording(const std::string& path, const char* why) {
  throw InvalidArgument(path + ": " + why);
}

}  // namespace

Player::Player(std::unique_ptr<Run> run, Scene scene)
    : scene_(std::move(scene)), run_(std::move(run)) {
  keep(run_->run_state());
}

void Player::keep(RunState run_state) {
  bytes_ += bytes_of(run_state);
  history_.push_back(std::move(run_state));
  while (history_.size() > 2 && (bytes_ > kHistoryBytes || history_.size() > kHistoryLength)) {
    bytes_ -= bytes_of(history_.front());
    history_.pop_front();
  }
  shown_ = history_.size() - 1;
}

void Player::step() {
  if (at_end()) return;
  if (in_the_past()) {
    ++shown_;
    return;
  }
  run_->step();
  RunState run_state = run_->run_state();
  run_state.dt = scene_.dt;
  run_state.time = history_.back().time + static_cast<double>(scene_.dt);
  if (recording_) recording_->append(run_state.states);
  keep(std::move(run_state));
}

bool Player::step_back() {
  if (shown_ == 0) return false;
  --shown_;
  return true;
}

void Player::restart() {
  if (!run_->rewind()) run_ = make_run(scene_, run_->choice());
  history_.clear();
  bytes_ = 0;
  keep(run_->run_state());
  changed_ = false;
  if (!recording_path_.empty()) record_to(recording_path_);
}

bool Player::switch_to(const EngineChoice& choice) {
  if (choice == run_->choice()) return true;
  if (run_->switch_to(choice)) return true;
  continue_with(scene_, choice);
  return false;
}

void Player::set_settings(const RunSettings& settings) {
  Scene changed = scene_;
  changed.dt = settings.dt;
  changed.solver = settings.solver;
  changed.soft_step = settings.soft_step;
  changed.resolver = settings.resolver;
  changed.sleep = settings.sleep;
  validate(changed);
  continue_with(std::move(changed), run_->choice());
}

void Player::continue_with(Scene scene, const EngineChoice& choice) {
  run_ = continue_run(scene, history_.back(), choice);
  scene_ = std::move(scene);
  shown_ = history_.size() - 1;
  changed_ = true;
  recording_.reset();
}

RecordingHeader Player::header() const {
  return {.engine = std::string(to_string(run_->choice().engine)),
          .backend = std::string(to_string(run_->choice().backend)),
          .scene = scene_};
}

void Player::save_recording(const std::string& path) const {
  if (changed_) refuse_recording(path, kNotOneRun);
  if (history_.front().step != 0)
    refuse_recording(path, "the first steps are no longer in the history");
  RecordingWriter recording(path, header());
  for (std::size_t i = 1; i < history_.size(); ++i) recording.append(history_[i].states);
  recording.finish();
}

void Player::record_to(const std::string& path) {
  recording_path_ = path;
  recording_.reset();  // removes its temporary file, whose name the next writer uses
  recording_.emplace(path, header());
}

void Player::finish_recording() {
  if (recording_path_.empty()) return;
  if (!recording_) refuse_recording(recording_path_, kNotOneRun);
  recording_->finish();
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
