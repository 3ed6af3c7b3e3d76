/// Interface of a scene that runs on one of the engines.
#pragma once

#include <jfpx/backend.hpp>

#include "src/tool/run_options.hpp"
#include "src/viewer/run_state.hpp"

#include <memory>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

using tool::EngineKind;

/// The engine of a run and its settings. Another choice with the same kind of engine and the same
/// number of threads preserves the bits.
struct EngineChoice {
  EngineKind engine = EngineKind::native;
  /// Of native steps; in Bullet, of sphere contacts and of jfpx's solver.
  Backend backend = Backend::automatic;
  unsigned threads = 1;                        ///< on the CPU, fixed for a run; 0: one per core
  bool jfpx_solver = true, jfpx_world = true;  ///< parts of EngineKind::bullet; false: Bullet's
  std::size_t minimum_batch = 0;               ///< Bullet's own code does smaller work
  friend bool operator==(const EngineChoice&, const EngineChoice&) = default;
};

class Run {
 public:
  virtual ~Run() = default;
  virtual void step() = 0;
  /// True after the last step of a recording.
  virtual bool at_end() const { return false; }
  virtual RunState run_state() = 0;
  /// Returns to the first step. @return false if the caller must create a new run instead.
  virtual bool rewind() { return false; }
  virtual EngineChoice choice() const = 0;
  /// Continues with another choice. Preserves the internal state of the engine and the bits.
  /// @return false, without a change, if another engine is necessary
  /// @throws BackendUnavailable, without a change
  virtual bool switch_to(const EngineChoice& choice) = 0;
};

/// @throws InvalidScene, BackendUnavailable, OutOfMemory
std::unique_ptr<Run> make_run(const Scene& scene, const EngineChoice& choice);
/// A run whose states are read from a file. It has no contacts. Another engine or backend continues
/// it by simulation.
struct Recorded {
  Scene scene;
  std::unique_ptr<Run> run;
};
/// @throws FileError
Recorded open_recording(const std::string& path);
/// True for the path of a recording, which ends with ".rec".
bool is_recording(std::string_view scene);

/// True if this build contains the engine.
bool has_engine(EngineKind engine);

/// Creates a run with the settings of the scene that starts from a state and continues its step
/// count.
std::unique_ptr<Run> continue_run(const Scene& scene, const RunState& from,
                                  const EngineChoice& choice);

/// The scene with its bodies in the given states.
Scene with_states(const Scene& scene, const std::vector<BodyState>& states);

namespace detail {
std::unique_ptr<Run> make_native_run(const Scene& scene, const EngineChoice& choice,
                                     std::uint64_t first_step);
std::unique_ptr<Run> make_bullet_run(const Scene& scene, const EngineChoice& choice,
                                     std::uint64_t first_step);
}  // namespace detail

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
