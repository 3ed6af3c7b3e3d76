/// A recording as a run, which returns its states in order.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>

#include "src/viewer/run.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

class RecordedRun final : public Run {
 public:
  explicit RecordedRun(RecordingReader recording) : recording_(std::move(recording)) {
    choice_.engine = tool::parse_engine(recording_.header().engine);
    if (const auto backend = parse_backend(recording_.header().backend)) choice_.backend = *backend;
    rewind();
  }

  void step() override { states_ = recording_.states(++step_); }
  bool at_end() const override { return step_ == recording_.steps(); }

  RunState run_state() override {
    RunState run_state;
    run_state.step = step_;
    run_state.states = states_;
    run_state.awake.assign(states_.size(), 1);
    run_state.computed_by = "the recording";
    return run_state;
  }

  bool rewind() override {
    step_ = 0;
    states_.clear();
    for (const BodyDef& body : recording_.header().scene.bodies) {
      states_.push_back({body.position, body.orientation, body.velocity, body.angular_velocity});
    }
    return true;
  }

  EngineChoice choice() const override { return choice_; }
  bool switch_to(const EngineChoice&) override { return false; }

 private:
  RecordingReader recording_;
  EngineChoice choice_;
  std::uint64_t step_ = 0;
  std::vector<BodyState> states_;
};

}  // namespace

bool is_recording(std::string_view scene) { return scene.ends_with(".rec"); }

Recorded open_recording(const std::string& path) {
  RecordingReader recording(path);
  if (recording.has_calls()) {
    throw InvalidArgument(path + ": was recorded with forces or changes of bodies, which only " +
                          "jfpx replay repeats");
  }
  Scene scene = recording.header().scene;
  return {std::move(scene), std::make_unique<RecordedRun>(std::move(recording))};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
