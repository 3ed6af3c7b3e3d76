/// Loading of the selected scene.
#include "src/tool/run_options.hpp"

#include <jfpx/error.hpp>

#include "src/base/system.hpp"
#include "src/tool/demo_names.hpp"
#include "src/tool/scene_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

bool looks_like_file(const std::string& name) {
  return name.find('/') != std::string::npos || name.ends_with(".json") ||
         std::filesystem::exists(to_path(name));
}

/// The first given option that applies to named scenes only; nullptr if there is none.
const char* option_of_named_scenes(const RunOptions& options) {
  if (options.spheres) return "--spheres";
  if (options.boxes) return "--boxes";
  return options.seed == RunOptions{}.seed ? nullptr : "--seed";
}

/// The index of a name in a list. @throws InvalidArgument naming `what` if there is none
template <std::size_t N>
std::size_t find_name(const char* what, const char* const (&names)[N], std::string_view name) {
  const auto* found = std::ranges::find(names, name);
  if (found != std::end(names)) return static_cast<std::size_t>(found - std::begin(names));
  throw InvalidArgument(
      fmt::format("{} is \"{}\"; it must be one of {}", what, name, fmt::join(names, ", ")));
}

}  // namespace

std::string_view to_string(EngineKind kind) { return kEngineNames[static_cast<int>(kind)]; }

EngineKind parse_engine(std::string_view name) {
  return static_cast<EngineKind>(find_name("engine", kEngineNames, name));
}

Solver parse_resolver(std::string_view name) {
  return static_cast<Solver>(find_name("resolver", kResolverNames, name));
}

void check_stdout(const RunOptions& options) {
  const char* exclusive = options.csv == "-"    ? "--csv -"
                          : options.json == "-" ? "--json -"
                                                : nullptr;
  const char* other = options.hash ? "--hash" : options.json == "-" ? "--json -" : nullptr;
  if (exclusive == nullptr || other == nullptr || std::string_view(exclusive) == other) return;
  throw InvalidArgument(fmt::format("{} can't be combined with {}, the only output on stdout{}",
                                    other, exclusive,
                                    options.csv == "-" ? "" : ", which contains the hash"));
}

const char* option_of_scenes(const RunOptions& options) {
  if (options.no_sleep) return "--no-sleep";
  if (options.resolver) return "--resolver";
  return options.substeps ? "--substeps" : nullptr;
}

scenes::Options scene_options(const RunOptions& options) {
  return {.spheres = options.spheres, .boxes = options.boxes, .seed = options.seed};
}

Scene load(const RunOptions& options) {
  Scene scene;
  if (!is_scene(options.scene) && looks_like_file(options.scene)) {
    if (const char* option = option_of_named_scenes(options)) {
      throw InvalidArgument(std::string(option) + " requires a named scene; " + options.scene +
                            " is a file");
    }
    scene = load_scene_file(options.scene);
  } else {
    if (is_only_a_demo(options.scene)) {
      throw InvalidArgument(
          "\"" + options.scene +
          "\" is a demo, which is more than a scene; only the native engine runs it; "
          "try: jfpx run " +
          options.scene);
    }
    scene = scenes::make(options.scene, scene_options(options));
  }
  if (options.dt) scene.dt = *options.dt;
  if (options.no_sleep) scene.sleep.enabled = false;
  if (options.resolver) scene.solver = *options.resolver;
  if (options.substeps) {
    if (scene.solver != Solver::soft_step) {
      throw InvalidArgument(fmt::format("--substeps requires --resolver soft-step; resolver is {}",
                                        resolver_name(scene.solver)));
    }
    scene.soft_step.substeps = *options.substeps;
  }
  validate(scene);
  return scene;
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
