/// Input scripts: files with the inputs of a demo, which make an interactive run repeatable.
#pragma once

#include "src/demos/demo.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

/// One line of a script: a press or release of a control before step `step`.
struct ScriptLine {
  std::uint64_t step = 1;  ///< first step: 1
  std::string control;     ///< name of the Control
  bool pressed = true;
  friend bool operator==(const ScriptLine&, const ScriptLine&) = default;
};

/// An input script. As a text file it has a header line and one line per input, in the order of the
/// steps; # starts a comment:
///
///     jfpx-input 1 flight
///     60 pitch-up press
///     75 pitch-up release
struct InputScript {
  std::string demo;
  std::vector<ScriptLine> lines;
  friend bool operator==(const InputScript&, const InputScript&) = default;
};

/// @throws InvalidArgument; the message names the line and the fault.
InputScript parse_input_script(std::string_view text);
/// The inverse of parse_input_script().
std::string to_text(const InputScript& script);
/// @throws FileError; InvalidArgument like parse_input_script(), prefixed with the path
InputScript load_input_script(const std::string& path);
/// Writes the file atomically. @throws FileError
void save_input_script(const InputScript& script, const std::string& path);

/// Supplies the inputs of a script to a demo, step by step.
class ScriptPlayer {
 public:
  /// @throws InvalidArgument if the script is for a different demo, or contains an unknown control
  ScriptPlayer(const InputScript& script, const Demo& demo);

  /// The inputs of the next step. The span is valid until the next call.
  std::span<const Input> next();
  /// True after the last input.
  bool finished() const { return next_ == inputs_.size(); }

 private:
  std::vector<std::uint64_t> steps_;  ///< step of each input
  std::vector<Input> inputs_;
  std::size_t next_ = 0;    ///< index of the next input
  std::uint64_t step_ = 0;  ///< last step that was supplied
};

/// Records the inputs of a run as a script.
class ScriptRecorder {
 public:
  explicit ScriptRecorder(const Demo& demo);
  /// Must be called once for each Demo::step(), with the same inputs.
  void add_step(std::span<const Input> inputs);
  const InputScript& script() const { return script_; }

 private:
  std::vector<std::string> names_;
  InputScript script_;
  std::uint64_t step_ = 0;
};

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
