/// Inputs of a demo, written down: what makes a run with controls repeatable without hands.
#pragma once

#include "src/demos/demo.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

/// One line of a script: before step `step` (from 1), a control goes down or comes up.
struct ScriptLine {
  std::uint64_t step = 1;
  std::string control;  ///< a Control's name
  bool pressed = true;
  friend bool operator==(const ScriptLine&, const ScriptLine&) = default;
};

/// As a text file, a head and one line for each input, in the order of steps; # starts a comment:
///
///     jfpx-input 1 flight
///     60 pitch-up press
///     75 pitch-up release
struct InputScript {
  std::string demo;
  std::vector<ScriptLine> lines;
  friend bool operator==(const InputScript&, const InputScript&) = default;
};

/// @throws InvalidArgument naming the line and what is wrong with it.
InputScript parse_input_script(std::string_view text);
std::string to_text(const InputScript& script);
/// @throws FileError, and as parse_input_script() with the path in front.
InputScript load_input_script(const std::string& path);
/// All or nothing. @throws FileError
void save_input_script(const InputScript& script, const std::string& path);

/// Hands the inputs of a script to a demo, step by step.
class ScriptPlayer {
 public:
  /// @throws InvalidArgument if the script is of another demo, or names a control that the demo
  ///   does not have.
  ScriptPlayer(const InputScript& script, const Demo& demo);

  /// The inputs of the next step. Valid until the next call.
  std::span<const Input> next();
  /// True when no input is left.
  bool finished() const { return place_ == inputs_.size(); }

 private:
  std::vector<std::uint64_t> steps_;  ///< of each input
  std::vector<Input> inputs_;
  std::size_t place_ = 0;
  std::uint64_t step_ = 0;
};

/// Writes a run down as it happens.
class ScriptRecorder {
 public:
  explicit ScriptRecorder(const Demo& demo);
  /// Call it once for each Demo::step(), with the same inputs.
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
