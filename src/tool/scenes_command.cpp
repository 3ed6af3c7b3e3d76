/// jfpx scenes: lists, describes and exports scenes and demos.
#include "src/demos/demo.hpp"
#include "src/scenes/scenes.hpp"
#include "src/tool/commands.hpp"
#include "src/tool/demo_engine.hpp"
#include "src/tool/options.hpp"
#include "src/tool/output.hpp"

#include <fmt/format.h>

#include <memory>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

struct ScenesOptions {
  RunOptions run;
  bool do_export = false;
};

std::string list_text() {
  std::string text;
  std::size_t width = 0;
  for (const scenes::Entry& entry : scenes::all()) width = std::max(width, entry.name.size());
  for (const demos::Entry& entry : demos::all()) width = std::max(width, entry.name.size());
  for (const scenes::Entry& entry : scenes::all()) {
    text += fmt::format("{:<{}}  {:>5} spheres  {}\n", entry.name, width, entry.default_spheres,
                        entry.summary);
  }
  text += "\nDemos, which also have controls (jfpx scenes DEMO lists them):\n\n";
  for (const demos::Entry& entry : demos::all()) {
    text += fmt::format("{:<{}}  {}\n", entry.name, width, entry.summary);
  }
  return text;
}

std::string describe(const Scene& scene) {
  std::size_t movable = 0;
  for (const BodyDef& body : scene.bodies) movable += body.mass > 0 ? 1 : 0;
  return fmt::format("{}: {} bodies, {} of them movable, {} spheres, dt {} s, resolver {}\n",
                     scene.name, scene.bodies.size(), movable, scenes::spheres_of(scene).size(),
                     text(scene.dt), resolver_name(scene.solver));
}

}  // namespace

void add_scenes_command(CLI::App& app, int&) {
  auto options = std::make_shared<ScenesOptions>();
  CLI::App* command =
      app.add_subcommand("scenes", "List the named scenes and demos; describe or export one");
  add_scene_options(*command, options->run);
  command->get_option("SCENE")->required(false);
  command->add_flag("--export", options->do_export, "Print the scene as JSON");
  command->callback([command, options] {
    if (options->run.scene.empty()) {
      for (const CLI::Option* option : command->get_options()) {
        if (option->count() > 0) throw CLI::RequiredError("SCENE, for " + option->get_name() + ",");
      }
      fmt::print("{}", list_text());
      return;
    }
    const bool demo = is_demo(options->run.scene);
    if (demo && !options->do_export) fmt::print("{}\n", describe_demo(options->run.scene));
    if (is_only_a_demo(options->run.scene) && !options->do_export) return;
    const Scene scene = load(options->run);
    fmt::print("{}", options->do_export ? to_json(scene) : describe(scene));
  });
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
