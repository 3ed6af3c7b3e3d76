/// A scene that runs on one engine, whichever it is.
#pragma once

#include <jfpx/backend.hpp>

#include "src/viewer/moment.hpp"

#include <memory>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

enum class EngineKind : std::uint8_t { native, bullet, bullet_stock };
inline constexpr std::string_view kEngineNames[] = {"native", "bullet", "bullet-stock"};

/// @throws InvalidArgument for a name that is not in kEngineNames.
EngineKind parse_engine(std::string_view name);

struct EngineChoice {
  EngineKind engine = EngineKind::native;
  Backend backend = Backend::automatic;  ///< of sphere contacts, and of rows of Bullet's solver
  unsigned threads = 1;                  ///< x86, 0 = one per core
  bool jfpx_solver = true, jfpx_world = true;  ///< of EngineKind::bullet; else Bullet's own
  std::size_t minimum_batch = 0;               ///< likewise: less is left to Bullet's own code
  friend bool operator==(const EngineChoice&, const EngineChoice&) = default;
};

class Run {
 public:
  virtual ~Run() = default;
  virtual void step() = 0;
  /// No step is left: a recording is over.
  virtual bool at_end() const { return false; }
  virtual Moment moment() = 0;
  /// Goes back to the first step. @return false if a run of the scene that is made anew does that.
  virtual bool rewind() { return false; }
  virtual EngineChoice choice() const = 0;
  /// Goes on with another choice and the same bits: everything that the engine remembers stays.
  /// @return false if that takes another engine; the run is as before.
  /// @throws BackendUnavailable; the run is as before.
  virtual bool switch_to(const EngineChoice& choice) = 0;
};

/// @throws InvalidScene, BackendUnavailable, OutOfMemory
std::unique_ptr<Run> make_run(const Scene& scene, const EngineChoice& choice);
/// A run whose states are in a file. It has no contacts; another engine or backend goes on live.
struct Recorded {
  Scene scene;
  std::unique_ptr<Run> run;
};
/// @throws FileError
Recorded open_recording(const std::string& path);
/// Whether a scene's name is that of a recording: it ends with ".rec".
bool is_recording(std::string_view scene);

/// Engines that this build has, in the order of EngineKind.
bool has_engine(EngineKind engine);

/// A run with the scene's settings that starts from the states of another. The step counts on.
std::unique_ptr<Run> continue_run(const Scene& scene, const Moment& from,
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
