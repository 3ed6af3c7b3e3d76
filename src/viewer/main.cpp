/// The program jfpx-view.
#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/thesis/worst_first.hpp>

#include "src/base/system.hpp"
#include "src/tool/precision.hpp"
#include "src/viewer/app.hpp"

#include <fmt/format.h>

#include <new>
#include <string>
#include <vector>

namespace {

using namespace jfpx;

int run(const std::vector<std::string>& arguments) {
  tool::switch_precision_if_requested(arguments);
  view::ViewOptions options;
  if (const auto status = view::parse_command_line(arguments, options)) return *status;
  if (!options.precision_is_given && view::is_recording(options.run.scene)) {
    tool::switch_precision(recording_precision(options.run.scene), arguments);
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
    thesis::enable();
    return run(start_program(argc, argv));
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
