/// Switching between the float and the double build of a program.
#include "src/tool/precision.hpp"

#include <jfpx/error.hpp>
#include <jfpx/recording.hpp>

#include "src/base/system.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

/// The same program in the other precision: NAME and NAME-f64 are in the same folder.
std::filesystem::path sibling_of(const std::filesystem::path& program) {
  constexpr std::string_view kSuffix = "-f64";
  const std::string_view extension = program.extension() == ".exe" ? ".exe" : "";
  std::string name = to_text(program.filename());
  name.resize(name.size() - extension.size());
  if (name.ends_with(kSuffix)) {
    name.resize(name.size() - kSuffix.size());
  } else {
    name += kSuffix;
  }
  return program.parent_path() / to_path(name.append(extension));
}

/// The precision that the arguments select; empty if they select none.
std::string selected_precision(const std::vector<std::string>& arguments) {
  constexpr std::string_view kOption = "--precision";
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    const std::string_view argument = arguments[i];
    if (argument == "--") break;  // later arguments belong to another program
    if (argument == kOption && i + 1 < arguments.size()) return arguments[i + 1];
    if (argument.starts_with(kOption) && argument.substr(kOption.size()).starts_with("=")) {
      return std::string(argument.substr(kOption.size() + 1));
    }
  }
  if (arguments.size() < 2 || arguments[0] != "replay") return {};
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i] == "--from") {
      ++i;  // a snapshot, not a recording
      continue;
    }
    if (!arguments[i].starts_with('-') && std::filesystem::is_regular_file(to_path(arguments[i]))) {
      return recording_precision(arguments[i]);
    }
  }
  return {};
}

}  // namespace

void switch_precision(const std::string& precision, const std::vector<std::string>& arguments) {
  if (precision == kPrecision || (precision != "float" && precision != "double")) return;
  const std::filesystem::path sibling = sibling_of(program_path());
  const std::string reason = run_instead(sibling, arguments);
  throw Error(to_text(sibling) + ", the build in " + precision +
              " precision, can't be started: " + reason);
}

void switch_precision_if_requested(const std::vector<std::string>& arguments) {
  switch_precision(selected_precision(arguments), arguments);
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
