/// Options of jfpx-view, and the parser of its command line.
#include "src/viewer/options.hpp"

#include <jfpx/error.hpp>

#include "src/tool/demo_names.hpp"
#include "src/tool/options.hpp"
#include "src/tool/precision.hpp"
#include "src/viewer/viewer.hpp"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr int kLargestSize = 8192;

Size parse_size(const std::string& text) {
  Size size;
  const char* end = text.data() + text.size();
  const auto [x, bad_width] = std::from_chars(text.data(), end, size.width);
  if (bad_width == std::errc() && x != end && *x == 'x') {
    const auto [rest, bad_height] = std::from_chars(x + 1, end, size.height);
    const int smallest = std::min(size.width, size.height);
    const int largest = std::max(size.width, size.height);
    if (bad_height == std::errc() && rest == end && smallest >= 16 && largest <= kLargestSize) {
      return size;
    }
  }
  throw CLI::ValidationError("--size", "is " + text +
                                           "; it must be WIDTHxHEIGHT, each from 16 to " +
                                           std::to_string(kLargestSize) + ", as in 1280x720");
}

Vec3 parse_point(const std::string& option, const std::string& text) {
  Vec3 point;
  const char *from = text.data(), *end = text.data() + text.size();
  for (int axis = 0; axis < 3; ++axis) {
    const auto [rest, bad] = std::from_chars(from, end, point[axis]);
    const bool last = axis == 2;
    if (bad != std::errc() || !(absolute(point[axis]) <= Real(1e9)) ||
        (last ? rest != end : rest == end || *rest != ',')) {
      throw CLI::ValidationError(option, "is " + text + "; it must be X,Y,Z in metres");
    }
    from = rest + 1;
  }
  return point;
}

void check_recording(const ViewOptions& options) {
  const tool::RunOptions& run = options.run;
  if (options.side_by_side) {
    throw InvalidArgument("--side-by-side can't play a recording; " + run.scene +
                          " is a recording");
  }
  if (run.spheres || run.boxes || run.dt || run.seed != tool::RunOptions{}.seed ||
      tool::option_of_scenes(run) != nullptr) {
    throw InvalidArgument(
        run.scene +
        " is a recording: --spheres, --boxes, --seed, --dt, --no-sleep, --resolver and --substeps "
        "do not apply");
  }
  if (options.choice != EngineChoice{}) {
    throw InvalidArgument(
        run.scene +
        " is a recording: it starts with the recorded engine and backend; the panel "
        "selects others");
  }
}

void check_demo(const ViewOptions& options) {
  const char* unused = tool::option_of_scenes(options.run);
  if (unused == nullptr && options.colouring != ViewOptions{}.colouring) unused = "--colours";
  if (unused == nullptr) return;
  throw InvalidArgument(std::string(unused) + " requires a scene; " + options.run.scene +
                        " is a demo");
}

/// Adds the options except --precision; they write to `options`.
void add_view_options(CLI::App& app, ViewOptions& options) {
  tool::add_scene_options(
      app, options.run,
      "Name of a scene or demo (see: jfpx scenes), a JSON file, a file of a mesh, "
      "or a recording (.rec)");
  app.add_flag("--side-by-side", options.side_by_side,
               "Step native jfpx, stock Bullet and Bullet with jfpx together and compare them");
  app.add_option_function<std::string>(
         "--engine",
         [&options](const std::string& name) { options.choice.engine = tool::parse_engine(name); },
         "Engine: native, bullet (with jfpx) or bullet-stock [native]")
      ->check(tool::engine_name());
  tool::add_backend_option(
      app, options.choice.backend,
      "Backend of native steps; in Bullet, of sphere contacts and of jfpx's solver: auto, cpu or "
      "cuda [auto]");
  tool::add_threads_option(app, options.choice.threads);
  const auto add_part = [&](const char* name, bool* jfpx, const char* help) {
    app.add_option_function<std::string>(
           name, [jfpx](const std::string& value) { *jfpx = value == "jfpx"; }, help)
        ->check(CLI::IsMember({"stock", "jfpx"}));
  };
  add_part("--solver", &options.choice.jfpx_solver, "Engine bullet: solver, stock or jfpx [jfpx]");
  add_part("--world", &options.choice.jfpx_world, "Engine bullet: world, stock or jfpx [jfpx]");
  app.add_option("--minimum-batch", options.choice.minimum_batch,
                 "Engine bullet: smallest number of pairs, bodies or manifolds that a part of jfpx "
                 "computes instead of Bullet")
      ->check(tool::whole_number())
      ->capture_default_str();
  app.add_flag("--headless", options.headless, "Render without a window and a display");
  app.add_option("--frames", options.frames,
                 "Number of steps; a recording ends earlier [default: headless: 120; window: until "
                 "closed]")
      ->check(tool::whole_number());
  app.add_option("--screenshot", options.screenshot, "Write the last picture to this PNG file");
  app.add_option("--pictures", options.pictures,
                 "Write every picture to this folder as frame-000001.png and so on");
  app.add_option("--record,--recording", options.recording,
                 "Write the state after every step to this file (see: jfpx replay)");
  app.add_option_function<std::string>(
      "--size", [&options](const std::string& text) { options.size = parse_size(text); },
      "Size of the picture or window [1280x720]");
  app.add_option_function<std::string>(
         "--quality",
         [&options](const std::string& name) {
           options.quality = name == "low"    ? kLowQuality
                             : name == "high" ? kHighQuality
                                              : kMediumQuality;
         },
         "low, medium or high [medium]")
      ->check(CLI::IsMember({"low", "medium", "high"}));
  app.add_option_function<std::string>(
         "--colours",
         [&options](const std::string& name) {
           const auto* found =
               std::find(std::begin(kColouringNames), std::end(kColouringNames), name);
           options.colouring = static_cast<Colouring>(found - std::begin(kColouringNames));
         },
         "Property shown by colours: bodies, speed, sleep, penetration, contacts or islands "
         "[bodies]")
      ->check(CLI::IsMember(
          std::vector<std::string>(std::begin(kColouringNames), std::end(kColouringNames))));
  app.add_flag("--contacts", options.contacts, "Draw contact points and normals");
  app.add_flag("--forces", options.forces, "Draw the force on each body, without its weight");
  app.add_flag("--panel", options.panel, "Draw the panel in headless pictures too");
  app.add_option("--input", options.input, "Input script of a demo");
  app.add_option_function<std::string>(
      "--eye", [&options](const std::string& text) { options.eye = parse_point("--eye", text); },
      "Position of the camera: X,Y,Z [m]");
  app.add_option_function<std::string>(
      "--target",
      [&options](const std::string& text) { options.target = parse_point("--target", text); },
      "Point that the camera looks at: X,Y,Z [m]");
  app.add_flag_callback(
      "--no-render", [&options] { options.render = false; },
      "Draw nothing and open no window, to time the engine alone");
  app.add_flag("--fullscreen", options.fullscreen, "Start in full screen");
  app.add_flag("--paused", options.paused, "Start paused");
}

}  // namespace

std::optional<int> parse_command_line(std::vector<std::string> arguments, ViewOptions& options) {
  CLI::App app("jfpx-view: shows scenes that run on the native engine or on Bullet.", "jfpx-view");
  app.set_version_flag("--version", "jfpx-view " JFPX_VERSION);
  std::string precision(tool::kPrecision);
  const CLI::Option* precision_option =
      app.add_option("--precision", precision, "float or double; a recording has its own precision")
          ->check(CLI::IsMember({"float", "double"}))
          ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  jfpx-view pile --spheres 2000\n"
      "  jfpx-view --side-by-side pile\n"
      "  jfpx-view pile --headless --frames 200 --screenshot pile.png --size 1600x900 --quality "
      "high\n"
      "\n"
      "F1 in the window lists all keys. Exit status: 0 success; 1 a check failed; 2 invalid usage\n"
      "or input; 3 backend, display or OpenGL not usable.");
  add_view_options(app, options);
  std::ranges::reverse(arguments);  // as CLI11 takes them
  try {
    app.parse(std::move(arguments));
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? tool::kSuccess : tool::kBadUsage;
  }
  options.precision_is_given = !precision_option->empty();
  return std::nullopt;
}

void check(const ViewOptions& options) {
  const std::string& scene = options.run.scene;
  if (!options.input.empty() && (options.side_by_side || !tool::is_demo(scene))) {
    throw InvalidArgument("--input requires a demo; " + scene + " is a scene");
  }
  if (is_recording(scene)) check_recording(options);
  if (options.side_by_side && options.choice.engine != EngineKind::native) {
    throw InvalidArgument("--side-by-side runs all engines; it can't be combined with --engine");
  }
  if (selects_demo(options)) check_demo(options);
  if (!options.recording.empty() && (options.side_by_side || selects_demo(options))) {
    throw InvalidArgument(options.recording + ": only a scene on one engine can be recorded");
  }
  if (options.eye.has_value() != options.target.has_value()) {
    throw InvalidArgument("--eye and --target must be given together");
  }
  if (options.eye && length(*options.target - *options.eye) <= kEpsilon) {
    throw InvalidArgument("--eye and --target are the same point");
  }
  if (options.paused && (options.headless || !options.render)) {
    throw InvalidArgument("--paused requires a window");
  }
  if (!options.render && (!options.screenshot.empty() || !options.pictures.empty())) {
    throw InvalidArgument("--no-render can't be combined with --screenshot or --pictures");
  }
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
