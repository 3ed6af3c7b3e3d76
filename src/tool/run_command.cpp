/// jfpx run: runs a scene with one engine.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/trajectory.hpp>

#include "src/base/atomic_file.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/demo_engine.hpp"
#include "src/tool/engine.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"
#include "src/tool/precision.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct CommandOptions {
  RunOptions run;
  std::string engine = "native";
  std::string input;                   ///< path of an input script
  std::string snapshot;                ///< path
  std::string trajectory;              ///< path
  std::uint64_t trajectory_every = 1;  ///< [steps], > 0
};

struct Totals {
  std::uint64_t contacts = 0;
  StageTimes times;
  std::map<std::string, std::uint64_t> choices;  ///< number of steps by Engine::choice()
};

std::string csv_row(std::uint64_t step, const Engine& engine) {
  const StageTimes t = engine.times();
  const StepMeasures m = engine.measures();
  return fmt::format("{},{},{},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{},{},{}\n", step,
                     engine.contacts(), engine.awake(), t.integrate, t.broad, t.detect, t.solve,
                     t.total, m.deepest_penetration, m.mean_penetration, m.largest_speed);
}

std::string summary(const CommandOptions& options, const Scene& scene, const Engine& engine,
                    const Totals& totals) {
  const double steps = std::max(1.0, static_cast<double>(options.run.steps));
  const StageTimes& t = totals.times;
  Table table({"ms per step", "integrate", "broad", "detect", "solve", "total"});
  table.add({options.engine, ms(t.integrate / steps), ms(t.broad / steps), ms(t.detect / steps),
             ms(t.solve / steps), ms(t.total / steps)});
  Table choices({"sphere contacts by", "steps"});
  for (const auto& [choice, count] : totals.choices) choices.add({choice, std::to_string(count)});
  const StepMeasures m = engine.measures();
  return fmt::format(
      "{}: {} bodies, {} steps of {} s, engine {}{}{}, backend {}\n"
      "contacts at the end {}, awake {}\n"
      "penetration at the end {:.3g} m deepest, {:.3g} m mean; largest speed {:.3g} m/s\n\n{}\n{}",
      scene.name, engine.states().size(), options.run.steps, text(scene.dt), options.engine,
      engine.resolver().empty() ? "" : ", resolver ", engine.resolver(), engine.backend(),
      engine.contacts(), engine.awake(), m.deepest_penetration, m.mean_penetration, m.largest_speed,
      table.text(), choices.text());
}

nlohmann::ordered_json to_json_value(const CommandOptions& options, const Scene& scene,
                                     const Engine& engine, const Totals& totals) {
  const StepMeasures m = engine.measures();
  nlohmann::ordered_json resolver;  // null for an engine without a resolver
  if (!engine.resolver().empty()) resolver = engine.resolver();
  return {{"scene", scene.name},
          {"bodies", engine.states().size()},
          {"steps", options.run.steps},
          {"engine", options.engine},
          {"resolver", resolver},
          {"backend", engine.backend()},
          {"precision", kPrecision},
          {"contacts", engine.contacts()},
          {"contacts_total", totals.contacts},
          {"awake", engine.awake()},
          {"deepest_penetration", m.deepest_penetration},
          {"mean_penetration", m.mean_penetration},
          {"largest_speed", m.largest_speed},
          {"choices", totals.choices},
          {"device_failure", engine.device_failure()},
          {"hash", hex(state_hash(engine.states()))},
          {"ms", to_json_value(totals.times)}};
}

/// Creates the engine. @param scene receives the initial scene
std::unique_ptr<Engine> start(const CommandOptions& options, Scene* scene) {
  const EngineKind kind = parse_engine(options.engine);
  if (options.input.empty() && !(kind == EngineKind::native && is_only_a_demo(options.run.scene))) {
    *scene = load(options.run);
    return make_engine(kind, *scene, options.run);
  }
  if (kind != EngineKind::native) {
    throw InvalidArgument("--input requires the native engine; engine is " + options.engine);
  }
  if (!options.run.record.empty()) {
    throw InvalidArgument("--record requires a scene; a demo is repeated with --input");
  }
  if (!options.snapshot.empty()) {
    throw InvalidArgument("--snapshot requires a scene; the controls of a demo are not in it");
  }
  if (!options.trajectory.empty()) {
    throw InvalidArgument("--trajectory requires a scene; the bodies of a demo change");
  }
  return make_demo_engine(options.run, options.input, scene);
}

int run(const CommandOptions& options) {
  check_stdout(options.run);
  Scene scene;
  const auto engine = start(options, &scene);
  OutputFile csv(options.run.csv), json(options.run.json);
  std::optional<RecordingWriter> recording;
  if (!options.run.record.empty()) {
    recording.emplace(options.run.record,
                      RecordingHeader{.engine = options.engine,
                                      .backend = std::string(to_string(options.run.backend)),
                                      .scene = scene});
  }
  std::optional<TrajectoryWriter> trajectory;
  if (!options.trajectory.empty()) {
    trajectory.emplace(options.trajectory);
    trajectory->append(scene, 0, engine->states());
  }
  std::optional<AtomicFile> snapshot;
  if (!options.snapshot.empty()) snapshot.emplace(options.snapshot);
  csv.write(
      "step,contacts,awake,integrate_ms,broad_ms,detect_ms,solve_ms,total_ms,"
      "deepest_penetration,mean_penetration,largest_speed\n");
  Totals totals;
  {
    Progress progress(scene.name, options.run.steps, options.run.quiet);
    for (std::uint64_t step = 1; step <= options.run.steps; ++step) {
      engine->step();
      totals.times += engine->times();
      totals.contacts += engine->contacts();
      ++totals.choices[engine->choice()];
      if (csv) csv.write(csv_row(step, *engine));
      if (recording) recording->append(engine->states());
      if (trajectory && step % options.trajectory_every == 0) {
        trajectory->append(scene, step, engine->states());
      }
      progress.advance_to(step);
    }
  }
  if (recording) recording->finish();
  if (trajectory) trajectory->finish();
  if (snapshot) {
    const std::vector<std::byte> bytes = engine->world()->snapshot().bytes;
    snapshot->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    snapshot->finish();
  }
  csv.finish();
  json.write(to_json_value(options, scene, *engine, totals).dump(2) + "\n");
  json.finish();
  if (wants_table(options.run)) fmt::print("{}", summary(options, scene, *engine, totals));
  if (options.run.hash) fmt::print("{}\n", hex(state_hash(engine->states())));
  return report_trouble(engine->device_failure(), engine->trouble());
}

/// Rejects options of other engines.
void check_engine(const CLI::App& command, const CommandOptions& options) {
  const auto require = [&](EngineKind engine, std::initializer_list<const char*> names) {
    if (options.engine == to_string(engine)) return;
    for (const char* option : names) {
      if (command.count(option) == 0) continue;
      throw InvalidArgument(fmt::format("{} requires --engine {}; engine is {}", option,
                                        to_string(engine), options.engine));
    }
  };
  require(EngineKind::bullet, {"--solver", "--world", "--minimum-batch"});
  require(EngineKind::native, {"--resolver", "--substeps", "--snapshot"});
}

}  // namespace

void add_run_command(CLI::App& app, int& status) {
  auto options = std::make_shared<CommandOptions>();
  CLI::App* command = app.add_subcommand("run", "Run a scene with one engine");
  add_scene_options(*command, options->run);
  add_run_options(*command, options->run);
  command->add_option("--engine", options->engine, "native, bullet (with jfpx) or bullet-stock")
      ->check(engine_name())
      ->capture_default_str();
  command->add_option("--input", options->input,
                      "Run as a demo with the inputs in this file (see: jfpx scenes DEMO)");
  command->add_option(
      "--csv", options->run.csv,
      "Write one line per step to this file: step, contacts, awake bodies, milliseconds (detect "
      "and solve of a step on a GPU: of the device, by CUDA events), deepest and mean penetration "
      "[m], largest speed [m/s]; - writes to stdout instead of a table");
  command->get_option("--quiet")->description(
      "Print only the output of --hash, --json - and --csv -");
  command->add_option("--record", options->run.record,
                      "Write the state after every step to this file (see: jfpx replay)");
  command->add_option("--snapshot", options->snapshot,
                      "Native engine: write the state after the last step to this file (see: jfpx "
                      "replay --from)");
  CLI::Option* const trajectory =
      command->add_option("--trajectory", options->trajectory,
                          "Write the bodies at the start and after every step to this file, for "
                          "other programs: .xyz or "
                          ".extxyz (extended XYZ: OVITO, ASE), .pvd (VTK: ParaView)");
  command
      ->add_option("--trajectory-every", options->trajectory_every,
                   "Number of steps from a frame of --trajectory to the next")
      ->check(whole_number())
      ->capture_default_str()
      ->needs(trajectory);
  command->callback([command, options, &status] {
    check_engine(*command, *options);
    if (options->trajectory_every == 0) {
      throw InvalidArgument("--trajectory-every is 0; it must be at least 1");
    }
    status = run(*options);
  });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
