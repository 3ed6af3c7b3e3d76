/// jfpx run: runs a scene with one engine, in one process or in several that hold one world.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/snapshot.hpp>
#include <jfpx/trajectory.hpp>

#include "src/base/atomic_file.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/demo_engine.hpp"
#include "src/tool/engine.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"
#include "src/tool/precision.hpp"
#include "src/tool/ranks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <initializer_list>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct CommandOptions {
  RunOptions run;
  std::string engine = "native";
  std::string input;                                        ///< path of an input script
  std::string snapshot;                                     ///< path
  std::string from;                                         ///< path of a snapshot
  std::pair<std::uint64_t, std::string> checkpoint{0, ""};  ///< [steps], path; 0: none
  std::string states;                                       ///< path
  std::string trajectory;                                   ///< path
  std::uint64_t trajectory_every = 1;                       ///< [steps], > 0
};

struct Totals {
  std::uint64_t contacts = 0;
  StageTimes times;
  std::map<std::string, std::uint64_t> choices;  ///< number of steps by Engine::choice()
};

std::uint32_t ranks_of(const CommandOptions& options) {
  return options.run.communicator == nullptr ? 1 : options.run.communicator->size();
}

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
      "{}: {} bodies, {} steps of {} s, engine {}{}{}, backend {}{}{}\n"
      "contacts at the end {}, awake {}\n"
      "penetration at the end {:.3g} m deepest, {:.3g} m mean; largest speed {:.3g} m/s\n\n{}\n{}",
      scene.name, engine.states().size(), options.run.steps, text(scene.dt), options.engine,
      engine.resolver().empty() ? "" : ", resolver ", engine.resolver(), engine.backend(),
      options.run.devices.empty() ? ""
                                  : fmt::format(", GPUs {}", fmt::join(options.run.devices, ", ")),
      ranks_of(options) == 1 ? "" : fmt::format(", {} ranks", ranks_of(options)), engine.contacts(),
      engine.awake(), m.deepest_penetration, m.mean_penetration, m.largest_speed, table.text(),
      choices.text());
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
          {"devices", options.run.devices},
          {"ranks", ranks_of(options)},
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
  for (const auto& [name, path] :
       {std::pair{"--snapshot", &options.snapshot}, std::pair{"--from", &options.from},
        std::pair{"--checkpoint", &options.checkpoint.second}}) {
    if (path->empty()) continue;
    throw InvalidArgument(
        fmt::format("{} requires a scene; the controls of a demo are not in snapshots", name));
  }
  for (const auto& [name, path] :
       {std::pair{"--trajectory", &options.trajectory}, std::pair{"--states", &options.states}}) {
    if (path->empty()) continue;
    throw InvalidArgument(fmt::format("{} requires a scene; the bodies of a demo change", name));
  }
  return make_demo_engine(options.run, options.input, scene);
}

/// Rejects what only one process can run.
void check_ranks(const CommandOptions& options) {
  if (options.run.communicator == nullptr) return;
  if (options.engine != to_string(EngineKind::native)) {
    throw InvalidArgument(
        fmt::format("several ranks require --engine native; engine is {}", options.engine));
  }
  if (!options.input.empty() || is_only_a_demo(options.run.scene)) {
    throw InvalidArgument("several ranks require a scene; a demo runs as one process");
  }
}

/// Writes the state of the world to a file, as rank 0.
void write_snapshot(const CommandOptions& options, const std::string& path, const World& world) {
  const Snapshot snapshot = world.snapshot();
  if (writes_output(options.run)) save_snapshot(snapshot, path);
}

/// Continues from the snapshot of --from. @return the number of its steps
std::uint64_t restore(const CommandOptions& options, const Scene& scene, World* world) {
  if (options.from.empty()) return 0;
  world->restore(load_snapshot(options.from));
  if (world->bodies().size() != scene.bodies.size()) {
    throw InvalidArgument(fmt::format(
        "--from: {} has {} bodies, and the scene {}; it must be a snapshot of a run of the scene",
        options.from, world->bodies().size(), scene.bodies.size()));
  }
  if (world->steps() > options.run.steps) {
    throw InvalidArgument(fmt::format("--from: {} was written after step {}; --steps is {}",
                                      options.from, world->steps(), options.run.steps));
  }
  return world->steps();
}

/// Reports failures on stderr. All ranks have the same trouble, and each its own device.
/// @return the exit status
int report_trouble_of_rank(const CommandOptions& options, const Engine& engine) {
  if (writes_output(options.run)) return report_trouble(engine.device_failure(), engine.trouble());
  if (!engine.device_failure().empty()) {
    report_trouble(
        fmt::format("rank {}: {}", options.run.communicator->rank(), engine.device_failure()), {});
  }
  return engine.trouble().empty() ? kSuccess : kCheckFailed;
}

/// All ranks call the same functions of the engine, which may communicate; rank 0 writes.
int run(const CommandOptions& options) {
  check_stdout(options.run);
  check_ranks(options);
  Scene scene;
  const auto engine = start(options, &scene);
  const std::uint64_t first = restore(options, scene, engine->world());
  const auto& [checkpoint_every, checkpoint_path] = options.checkpoint;
  const bool writes = writes_output(options.run);
  const bool records = !options.run.record.empty(), has_csv = !options.run.csv.empty();
  OutputFile csv(writes ? options.run.csv : ""), json(writes ? options.run.json : "");
  std::optional<RecordingWriter> recording;
  if (writes && records) {
    recording.emplace(options.run.record,
                      RecordingHeader{.engine = options.engine,
                                      .backend = std::string(to_string(options.run.backend)),
                                      .scene = scene});
  }
  std::optional<TrajectoryWriter> trajectory;
  const auto append_frame = [&](std::uint64_t step) {
    const std::vector<BodyState> states = engine->states();
    if (trajectory) trajectory->append(scene, step, states);
  };
  if (!options.trajectory.empty()) {
    if (writes) trajectory.emplace(options.trajectory);
    append_frame(first);
  }
  // Fails before the run if the file cannot be written.
  if (writes && !options.states.empty()) AtomicFile{options.states};
  std::optional<AtomicFile> snapshot;
  if (writes && !options.snapshot.empty()) snapshot.emplace(options.snapshot);
  csv.write(
      "step,contacts,awake,integrate_ms,broad_ms,detect_ms,solve_ms,total_ms,"
      "deepest_penetration,mean_penetration,largest_speed\n");
  Totals totals;
  {
    Progress progress(scene.name, options.run.steps, options.run.quiet,
                      options.run.communicator.get());
    for (std::uint64_t step = first + 1; step <= options.run.steps; ++step) {
      engine->step();
      totals.times += engine->times();
      totals.contacts += engine->contacts();
      ++totals.choices[engine->choice()];
      if (has_csv) csv.write(csv_row(step, *engine));
      if (records) {
        const std::vector<BodyState> states = engine->states();
        if (recording) recording->append(states);
      }
      if (!options.trajectory.empty() && step % options.trajectory_every == 0) append_frame(step);
      if (checkpoint_every > 0 && step % checkpoint_every == 0) {
        write_snapshot(options, checkpoint_path, *engine->world());
      }
      progress.advance_to(step);
    }
  }
  if (recording) recording->finish();
  if (trajectory) trajectory->finish();
  if (!options.states.empty()) write_states(*engine->world(), options.states);
  if (!options.snapshot.empty()) {
    const std::vector<std::byte> bytes = engine->world()->snapshot().bytes;
    if (snapshot) {
      snapshot->write({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
      snapshot->finish();
    }
  }
  csv.finish();
  json.write(to_json_value(options, scene, *engine, totals).dump(2) + "\n");
  json.finish();
  std::string text;
  if (wants_table(options.run)) text += summary(options, scene, *engine, totals);
  if (options.run.hash) text += hex(state_hash(engine->states())) + "\n";
  if (writes) fmt::print("{}", text);
  return report_trouble_of_rank(options, *engine);
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
  require(EngineKind::native, {"--devices", "--resolver", "--substeps", "--snapshot", "--from",
                               "--checkpoint", "--states"});
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
  command
      ->add_option(
          "--devices", options->run.devices,
          "Native engine with --backend cuda, which is then the default: numbers of the GPUs "
          "that share the world, separated by commas (see: jfpx devices) [default: one GPU]")
      ->delimiter(',')
      ->check(whole_number(std::numeric_limits<int>::max()));
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
                      "Native engine: write the state after the last step to this file (see: "
                      "--from, jfpx replay --from)");
  command
      ->add_option("--checkpoint", options->checkpoint,
                   "Native engine: write a snapshot to the file FILE after every EVERY steps, from "
                   "which --from continues")
      ->type_name("EVERY FILE");
  command->add_option(
      "--from", options->from,
      "Native engine: continue from this snapshot of a run of the same scene, up to "
      "step --steps, with any number of threads and ranks");
  command->add_option("--states", options->states,
                      "Native engine: write the states of the bodies after the last step to this "
                      "file, for numpy.load(); several ranks write together");
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
    if (command->count("--checkpoint") > 0 && options->checkpoint.first == 0) {
      throw InvalidArgument("--checkpoint: EVERY is 0; it must be at least 1");
    }
    status = run_on_ranks([&options](const std::shared_ptr<Communicator>& communicator) {
      CommandOptions on_ranks = *options;
      on_ranks.run.communicator = communicator;
      return run(on_ranks);
    });
  });
  command->footer(
      "mpirun -n RANKS jfpx run SCENE ... divides the world among processes, in a build with MPI: "
      "the results\nare those of one process, and rank 0 writes them. --threads is for each rank. "
      "Only the native engine\nand scenes run so.");
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
