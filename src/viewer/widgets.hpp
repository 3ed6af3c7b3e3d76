/// Wrappers of Dear ImGui's widgets, which can log their positions and contents.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Content of the panels, for tests. Among widgets with the same label, the last one is recorded.
struct PanelLog {
  struct Widget {
    float left = 0, top = 0, right = 0, bottom = 0;  ///< visible rectangle [units]
    std::string value;                               ///< displayed value; "on" or "off" of a choice
  };
  std::map<std::string, Widget> widgets;  ///< by label
  std::vector<std::string> texts;         ///< in the order of the panels
};

namespace widget {

/// Makes all panels of the current Dear ImGui context add to `log`, until nullptr is set or the
/// context is destroyed.
void set_log(PanelLog* log);

void text(const std::string& text);
/// Text in a conspicuous colour, wrapped.
void warning(const std::string& text);

// The following functions return true if the user has just operated the widget.
bool button(const char* label);
bool check(const char* label, bool* on);
/// One of several choices; `own` is its value.
bool radio(const char* label, int* value, int own);
/// Logarithmic scale. True whenever the value changes.
bool slider(const char* label, float* value, float low, float high, const char* format);
/// True if the field was edited and has lost the focus. Text that is not a number does not change
/// the value.
bool number(const char* label, std::uint64_t* value);
/// True while the section is open.
bool heading(const char* label, bool open_at_first);
/// True while the list is open; then add entries and call close_list().
bool open_list(const char* label, const std::string& chosen);
bool entry(const std::string& label, bool chosen);
void close_list();

}  // namespace widget
}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
