/// Command-line options shared by several commands.
#pragma once

#include "src/tool/run_options.hpp"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// Accepts whole numbers up to `largest`. CLI11 alone would parse -1 and values out of range as the
/// largest integer.
CLI::Validator whole_number(std::uint64_t largest = std::numeric_limits<std::uint64_t>::max());
/// Adds --threads.
void add_threads_option(CLI::App& app, unsigned& threads);
/// Adds SCENE, with `scene` as its help text, and the options that select and modify a scene.
void add_scene_options(CLI::App& app, RunOptions& options,
                       const std::string& scene =
                           "Name of a scene (see: jfpx scenes), a JSON file or a file of a mesh");
/// Adds --steps, --backend, --threads, --minimum-batch, --solver, --world, --json, --hash, --quiet.
void add_run_options(CLI::App& app, RunOptions& options);
/// Adds --backend, which sets `backend`.
void add_backend_option(CLI::App& app, Backend& backend,
                        const std::string& help = "Backend: auto, cpu or cuda [auto]");
/// Accepts the names of engines.
CLI::Validator engine_name();
/// Accepts the names of backends, and "x86", which version 0.1 used for "cpu".
CLI::Validator backend_name();

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
