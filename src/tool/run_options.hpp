/// Options of the commands that run scenes, as values.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/scene.hpp>

#include "src/scenes/scenes.hpp"

#include <cstdint>
#include <optional>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Exit statuses; part of the command's contract.
enum ExitStatus : int { kSuccess = 0, kCheckFailed = 1, kBadUsage = 2, kBackendUnavailable = 3 };

enum class EngineKind : std::uint8_t { native, bullet, bullet_stock };
/// Their names, in this order.
inline constexpr const char* kEngineNames[] = {"native", "bullet", "bullet-stock"};

/// Which scene, and how to run it.
struct RunOptions {
  std::string scene;  ///< name or path of a JSON file
  std::optional<std::uint32_t> spheres, boxes;
  std::optional<Real> dt;
  std::uint64_t seed = 1;
  std::uint64_t steps = 120;
  bool no_sleep = false;
  Backend backend = Backend::automatic;
  unsigned threads = 1;
  std::optional<std::uint64_t> minimum_batch;   ///< pairs; absent: the command's default
  std::string solver = "jfpx", world = "jfpx";  ///< Bullet's parts: "jfpx" or "stock"
  std::string json, csv, record;
  bool hash = false, quiet = false;
};

/// False where only JSON, or nothing, shall be on stdout.
inline bool wants_table(const RunOptions& options) { return !options.quiet && options.json != "-"; }

/// What the options say about a named scene.
scenes::Options scene_options(const RunOptions& options);
/// The scene that the options name, changed as they say.
/// @throws InvalidArgument, InvalidScene, FileError, OutOfMemory
Scene load(const RunOptions& options);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
