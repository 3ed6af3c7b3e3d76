/// What the commands that run scenes have in common on their command lines.
#include "src/tool/options.hpp"

#include <jfpx/error.hpp>

#include "examples/scenes/scenes.hpp"
#include "src/tool/demo_names.hpp"

#include <charconv>
#include <filesystem>
#include <system_error>

namespace jfpx::inline JFPX_ABI::tool {
namespace {

bool looks_like_file(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".json") ||
         std::filesystem::exists(name);
}

/// The option that a file can't follow, if one was given.
const char* option_of_named_scenes(const RunOptions& options) {
  if (options.spheres) return "--spheres";
  if (options.boxes) return "--boxes";
  return options.seed == RunOptions{}.seed ? nullptr : "--seed";
}

}  // namespace

CLI::Validator whole_number() {
  return {[](std::string& text) {
            std::uint64_t value = 0;
            const auto [end, error] =
                std::from_chars(text.data(), text.data() + text.size(), value);
            const bool whole = error == std::errc() && end == text.data() + text.size();
            return whole ? "" : "is " + text + "; it must be a whole number from 0 to 2^64 - 1";
          },
          ""};
}

void add_scene_options(CLI::App& app, RunOptions& options, const std::string& scene) {
  app.add_option("SCENE", options.scene, scene)->required();
  app.add_option("--spheres", options.spheres, "Number of spheres of a named scene")
      ->check(whole_number());
  app.add_option("--boxes", options.boxes,
                 "Number of boxes, of named scenes that have some [see: jfpx scenes]")
      ->check(whole_number());
  app.add_option("--seed", options.seed, "Seed of a named scene")
      ->check(whole_number())
      ->capture_default_str();
  app.add_option("--dt", options.dt, "Length of a step in seconds [the scene's]");
  app.add_flag("--no-sleep", options.no_sleep, "Keep all bodies awake");
}

void add_run_options(CLI::App& app, RunOptions& options) {
  app.add_option("--steps", options.steps, "Number of steps")
      ->check(whole_number())
      ->capture_default_str();
  app.add_option_function<std::string>(
         "--backend",
         [&options](const std::string& text) { options.backend = *parse_backend(text); },
         "Who finds sphere contacts: auto, x86 or cuda [auto]")
      ->check(CLI::IsMember({"auto", "x86", "cuda"}));
  app.add_option("--threads", options.threads, "Threads on x86, 0 = one per core")
      ->check(whole_number())
      ->capture_default_str();
  app.add_option("--minimum-batch", options.minimum_batch,
                 "Bullet: pairs below which a dispatch, and manifolds below which a group of the "
                 "solver, is left to Bullet's own code [compare: 0, so that jfpx computes; else "
                 "what pays]")
      ->check(whole_number());
  const CLI::IsMember whose({"stock", "jfpx"});
  app.add_option("--solver", options.solver, "Bullet: whose constraint solver")
      ->check(whose)
      ->capture_default_str();
  app.add_option("--world", options.world, "Bullet: whose dynamics world")
      ->check(whose)
      ->capture_default_str();
  app.add_option("--json", options.json,
                 "Write the results as JSON to this file, - for stdout, instead of a table");
  app.add_flag("--hash", options.hash,
               "Print the hash of the final state, 16 hex digits, as the last line");
  app.add_flag("--quiet", options.quiet, "Print nothing but what --hash and --json - ask for");
}

scenes::Options scene_options(const RunOptions& options) {
  return {.spheres = options.spheres, .boxes = options.boxes, .seed = options.seed};
}

Scene load(const RunOptions& options) {
  Scene scene;
  if (!is_scene(options.scene) && looks_like_file(options.scene)) {
    if (const char* option = option_of_named_scenes(options)) {
      throw InvalidArgument(std::string(option) + " goes with a named scene; " + options.scene +
                            " is a file");
    }
    scene = load_scene(options.scene);
  } else {
    if (is_only_a_demo(options.scene)) {
      throw InvalidArgument("\"" + options.scene +
                            "\" is a demo: more than rigid bodies belongs to it, so that only the "
                            "native engine has it; try: jfpx run " +
                            options.scene);
    }
    scene = scenes::make(options.scene, scene_options(options));
  }
  if (options.dt) scene.dt = *options.dt;
  if (options.no_sleep) scene.sleep.enabled = false;
  validate(scene);
  return scene;
}

}  // namespace jfpx::inline JFPX_ABI::tool
