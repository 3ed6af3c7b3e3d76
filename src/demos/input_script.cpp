/// Parsing, writing, replay and recording of input scripts.
#include "src/demos/input_script.hpp"

#include <jfpx/error.hpp>

#include "src/base/file.hpp"

#include <charconv>
#include <sstream>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

constexpr std::string_view kHead = "jfpx-input 1";

[[noreturn]] void fail(std::size_t line, const std::string& what) {
  throw InvalidArgument("line " + std::to_string(line) + ": " + what);
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line.substr(0, line.find('#')));
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::uint64_t step_of(const std::string& word, std::size_t line) {
  std::uint64_t step = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), step);
  if (error != std::errc() || end != word.data() + word.size() || step == 0) {
    fail(line, "step is " + word + "; it must be a whole number from 1 to 2^64 - 1");
  }
  return step;
}

ScriptLine parse_line(const std::vector<std::string>& words, std::size_t line) {
  if (words.size() != 3) {
    fail(line, "has " + std::to_string(words.size()) +
                   " words; it must have the form STEP CONTROL press or STEP CONTROL release");
  }
  if (words[2] != "press" && words[2] != "release") {
    fail(line, "ends in \"" + words[2] + "\"; it must be press or release");
  }
  return {step_of(words[0], line), words[1], words[2] == "press"};
}

}  // namespace

InputScript parse_input_script(std::string_view text) {
  InputScript script;
  bool head_seen = false;
  std::istringstream stream{std::string(text)};
  std::size_t number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    const std::vector<std::string> words = words_of(line);
    if (words.empty()) continue;
    if (!head_seen) {
      if (words.size() != 3 || words[0] + " " + words[1] != kHead) {
        fail(number, "must have the form " + std::string(kHead) + " DEMO");
      }
      script.demo = words[2];
      head_seen = true;
      continue;
    }
    script.lines.push_back(parse_line(words, number));
    const std::size_t count = script.lines.size();
    if (count > 1 && script.lines[count - 1].step < script.lines[count - 2].step) {
      fail(number, "step " + words[0] + " follows step " +
                       std::to_string(script.lines[count - 2].step) + "; steps must not decrease");
    }
  }
  if (!head_seen) fail(number + 1, "must have the form " + std::string(kHead) + " DEMO");
  return script;
}

std::string to_text(const InputScript& script) {
  std::string text = std::string(kHead) + " " + script.demo + "\n";
  for (const ScriptLine& line : script.lines) {
    text +=
        std::to_string(line.step) + " " + line.control + (line.pressed ? " press\n" : " release\n");
  }
  return text;
}

InputScript load_input_script(const std::string& path) {
  const std::string text = read_file(path);
  try {
    return parse_input_script(text);
  } catch (const InvalidArgument& error) {
    throw InvalidArgument(path + ": " + error.what());
  }
}

void save_input_script(const InputScript& script, const std::string& path) {
  write_file(path, to_text(script));
}

ScriptPlayer::ScriptPlayer(const InputScript& script, const Demo& demo) {
  if (script.demo != demo.name()) {
    throw InvalidArgument("the input script is for the demo \"" + script.demo + "\", not for \"" +
                          std::string(demo.name()) + "\"");
  }
  for (const ScriptLine& line : script.lines) {
    inputs_.push_back({find_control(demo, line.control), line.pressed});
    steps_.push_back(line.step);
  }
}

std::span<const Input> ScriptPlayer::next() {
  ++step_;
  const std::size_t first = next_;
  while (next_ < steps_.size() && steps_[next_] <= step_) ++next_;
  return std::span(inputs_).subspan(first, next_ - first);
}

ScriptRecorder::ScriptRecorder(const Demo& demo) {
  script_.demo = demo.name();
  for (const Control& control : demo.controls()) names_.emplace_back(control.name);
}

void ScriptRecorder::add_step(std::span<const Input> inputs) {
  ++step_;
  for (const Input& input : inputs) {
    script_.lines.push_back({step_, names_.at(input.control), input.pressed});
  }
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
