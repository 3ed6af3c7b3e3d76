/// The program jfpx-view.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>

#include "src/tool/precision.hpp"
#include "src/viewer/app.hpp"

#include <fmt/format.h>

#include <new>

namespace {

using namespace jfpx;

int run(int argc, char** argv) {
  tool::switch_precision_if_asked(argc, argv);
  CLI::App app("jfpx-view: see scenes run, on the native engine and on Bullet.", "jfpx-view");
  app.set_version_flag("--version", "jfpx-view " JFPX_VERSION);
  std::string precision = sizeof(Real) == 4 ? "float" : "double";
  const CLI::Option* asked =
      app.add_option("--precision", precision, "float or double, or what a recording was made in")
          ->check(CLI::IsMember({"float", "double"}))
          ->capture_default_str();
  app.footer(
      "Examples:\n"
      "  jfpx-view pile --spheres 2000\n"
      "  jfpx-view --side-by-side pile\n"
      "  jfpx-view pile --headless --frames 200 --screenshot pile.png --size 1600x900 --quality "
      "high\n"
      "\n"
      "F1 in the window shows all keys. Exit status: 0 all well; 1 a check failed; 2 bad usage or\n"
      "bad input; 3 backend, display or OpenGL not usable.");
  view::ViewOptions options;
  view::add_view_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? tool::kSuccess : tool::kBadUsage;
  }
  if (asked->empty() && view::is_recording(options.run.scene)) {
    tool::switch_precision(recording_precision(options.run.scene), argv);
  }
  view::check(options);
  return view::run_app(options);
}

int fail(const char* what, int status) {
  fmt::print(stderr, "jfpx-view: {}\n", what);
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const BackendUnavailable& error) {
    return fail(error.what(), tool::kBackendUnavailable);
  } catch (const DeviceError& error) {
    return fail(error.what(), tool::kBackendUnavailable);
  } catch (const std::bad_alloc&) {
    return fail("out of memory", tool::kBadUsage);
  } catch (const std::exception& error) {
    return fail(error.what(), tool::kBadUsage);
  }
}
