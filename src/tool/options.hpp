/// What the commands that run scenes have in common on their command lines.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/scene.hpp>

#include "examples/scenes/scenes.hpp"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace jfpx::inline JFPX_ABI::tool {

/// Exit statuses; part of the command's contract.
enum ExitStatus : int { kSuccess = 0, kCheckFailed = 1, kBadUsage = 2, kBackendUnavailable = 3 };

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

/// Accepts whole numbers of 64 bits. CLI11 by itself reads -1, and what is too large, as the
/// largest one.
CLI::Validator whole_number();
/// Adds SCENE, with that as its help, and the options that choose and change a scene.
void add_scene_options(
    CLI::App& app, RunOptions& options,
    const std::string& scene = "Name of a scene (see: jfpx scenes) or a JSON file");
/// Adds --steps, --backend, --threads, --minimum-batch, --solver, --world, --json, --hash, --quiet.
void add_run_options(CLI::App& app, RunOptions& options);

/// False where only JSON, or nothing, shall be on stdout.
inline bool wants_table(const RunOptions& options) { return !options.quiet && options.json != "-"; }

/// What the options say about a named scene.
scenes::Options scene_options(const RunOptions& options);
/// The scene that the options name, changed as they say.
/// @throws InvalidArgument, InvalidScene, FileError, OutOfMemory
Scene load(const RunOptions& options);

}  // namespace jfpx::inline JFPX_ABI::tool
