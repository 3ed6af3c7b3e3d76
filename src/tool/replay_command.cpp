/// jfpx replay: repeats a recorded run and stops at the first step that differs.
#include <jfpx/error.hpp>
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/snapshot.hpp>

#include "src/tool/commands.hpp"
#include "src/tool/engine.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"

#include <fmt/format.h>

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct ReplayOptions {
  std::string path;
  std::string engine;
  std::string from;  ///< path of a snapshot
  RunOptions run;
};

/// Restores the snapshot. @returns its step
std::uint64_t restore(const ReplayOptions& options, std::uint64_t recorded_steps, Engine& engine) {
  World* world = engine.world();
  if (world == nullptr) {
    throw InvalidArgument("--from requires the native engine; engine is " + options.engine);
  }
  world->restore(load_snapshot(options.from));
  if (world->steps() > recorded_steps) {
    throw InvalidArgument(
        fmt::format("snapshot is of step {}; it must be of step 0 to {} of the recording",
                    world->steps(), recorded_steps));
  }
  return world->steps();
}

/// Reports the first difference to the recording. @returns whether there is one
bool differs(RecordingReader& recording, std::uint64_t step, const Engine& engine) {
  const auto difference = first_difference(recording.states(step), engine.states());
  if (!difference) return false;
  fmt::print("step {}, body {}, {}: recorded {} ({}), now {} ({})\n", step, difference->body,
             difference->field, text(difference->expected), hex_bits(difference->expected),
             text(difference->actual), hex_bits(difference->actual));
  return true;
}

int replay(ReplayOptions options) {
  RecordingReader recording(options.path);
  const RecordingHeader& header = recording.header();
  if (options.engine.empty()) options.engine = header.engine;
  const auto engine = make_engine(parse_engine(options.engine), header.scene, options.run);
  World* const world = engine->world();
  if (recording.has_calls() && world == nullptr) {
    throw InvalidArgument(options.path + ": was recorded with forces or changes of bodies, which " +
                          "only the native engine repeats; engine is " + options.engine);
  }
  const std::uint64_t start =
      options.from.empty() ? 0 : restore(options, recording.steps(), *engine);
  if (start > 0 && differs(recording, start, *engine)) return kCheckFailed;
  Progress progress(header.scene.name, recording.steps(), options.run.quiet);
  for (std::uint64_t step = start + 1; step <= recording.steps(); ++step) {
    if (world != nullptr) repeat_calls(recording, step, *world);
    engine->step();
    if (differs(recording, step, *engine)) return kCheckFailed;
    progress.advance_to(step);
  }
  if (!options.run.quiet) {
    fmt::print("{}: {} steps{}, engine {}: all states equal the recording bit for bit\n",
               options.path, recording.steps() - start,
               options.from.empty() ? "" : fmt::format(" after step {}", start), options.engine);
  }
  if (options.run.hash) fmt::print("{}\n", hex(state_hash(engine->states())));
  return report_trouble(engine->device_failure(), engine->trouble());
}

}  // namespace

void add_replay_command(CLI::App& app, int& status) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command =
      app.add_subcommand("replay", "Repeat a recorded run; stop at the first step that differs");
  command
      ->add_option("FILE", options->path,
                   "Recording written by jfpx run --record FILE or by RecordedWorld")
      ->required();
  command
      ->add_option("--engine", options->engine,
                   "native, bullet or bullet-stock [default: the recorded engine]")
      ->check(engine_name());
  command->add_option(
      "--from", options->from,
      "Native engine: continue from this snapshot instead of the start; written by: "
      "jfpx run --snapshot FILE");
  add_backend_option(*command, options->run.backend);
  add_threads_option(*command, options->run.threads);
  command->add_flag("--hash", options->run.hash, "Print the hash of the final state");
  command->add_flag("--quiet", options->run.quiet, "Print only a difference");
  command->callback([options, &status] { status = replay(*options); });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
