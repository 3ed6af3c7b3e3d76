/// Values of the options that select and run a scene, without the command-line parser.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/communicator.hpp>
#include <jfpx/scene.hpp>

#include "src/scenes/scenes.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Exit statuses of `jfpx` and `jfpx-view`. They are part of the interface.
enum ExitStatus : int { kSuccess = 0, kCheckFailed = 1, kBadUsage = 2, kBackendUnavailable = 3 };

/// The native engine, Bullet with jfpx's parts, or unmodified Bullet.
enum class EngineKind : std::uint8_t { native, bullet, bullet_stock };
/// Names of the engines, in the order of EngineKind.
inline constexpr const char* kEngineNames[] = {"native", "bullet", "bullet-stock"};
std::string_view to_string(EngineKind kind);
/// @throws InvalidArgument for a name that to_string() does not return.
EngineKind parse_engine(std::string_view name);

/// Names of the native resolvers in options and results, in the order of Solver.
inline constexpr const char* kResolverNames[] = {"soft-step", "worst-first"};
inline std::string_view resolver_name(Solver solver) {
  return kResolverNames[static_cast<int>(solver)];
}
/// @throws InvalidArgument for a name that resolver_name() does not return.
Solver parse_resolver(std::string_view name);

/// The scene to run, and the settings of the run.
struct RunOptions {
  std::string scene;  ///< a name, or the path of a JSON file
  std::optional<std::uint32_t> spheres, boxes;
  std::optional<Real> dt;
  std::uint64_t seed = 1;
  std::uint64_t steps = 120;
  bool no_sleep = false;
  std::optional<Solver> resolver;         ///< replaces Scene::solver
  std::optional<std::uint32_t> substeps;  ///< replaces SoftStepSettings::substeps
  Backend backend = Backend::automatic;
  std::vector<int> devices;  ///< WorldSettings::devices
  unsigned threads = 1;
  std::optional<std::uint64_t> minimum_batch;   ///< [pairs]; empty: the command's default
  std::string solver = "jfpx", world = "jfpx";  ///< parts of Bullet: "jfpx" or "stock"
  std::string json, csv, record;
  bool hash = false, quiet = false;
  /// The processes that run together, of which each makes the same calls; null: one process.
  std::shared_ptr<Communicator> communicator = nullptr;
};

/// Whether this process writes to stdout and files: the only one, or rank 0.
inline bool writes_output(const RunOptions& options) {
  return options.communicator == nullptr || options.communicator->rank() == 0;
}

/// False if stdout receives only JSON or CSV, or nothing.
inline bool wants_table(const RunOptions& options) {
  return !options.quiet && options.json != "-" && options.csv != "-";
}
/// @throws InvalidArgument if stdout would receive JSON or CSV together with other output
void check_stdout(const RunOptions& options);

/// The options of a named scene.
scenes::Options scene_options(const RunOptions& options);
/// The first given option that applies to scenes only, not to demos; nullptr if there is none.
const char* option_of_scenes(const RunOptions& options);
/// Loads or generates the scene and applies the options to it.
/// @throws InvalidArgument, InvalidScene, FileError, OutOfMemory
Scene load(const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
