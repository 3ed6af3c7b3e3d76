/// Dear ImGui's widgets as the panels use them: each can tell where it is and what it says.
#pragma once

#include <jfpx/config.hpp>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// What a panel shows: for those who operate it without seeing it. Of widgets with the same label
/// the last one counts.
struct PanelLog {
  struct Widget {
    float left = 0, top = 0, right = 0, bottom = 0;  ///< what is seen of it, in the window's units
    std::string value;                               ///< that it shows; "on" or "off" of a choice
  };
  std::map<std::string, Widget> widgets;  ///< by label
  std::vector<std::string> texts;         ///< in the order of the panel
};

namespace widget {

/// From now on all panels of the current Dear ImGui context add to `log`, until nullptr is given or
/// the context ends.
void tell(PanelLog* log);

void text(const std::string& text);
/// Text in a colour that can't be overlooked, broken into lines at `width` [units].
void warning(const std::string& text, float width);

// All of these return true when the user has done something with them.
bool button(const char* label);
bool check(const char* label, bool* on);
/// One of several; `own` is the value that it stands for.
bool radio(const char* label, int* value, int own);
/// Logarithmic. True whenever the value moves.
bool slider(const char* label, float* value, float low, float high, const char* format);
/// True when something was typed and the field left; what is no number leaves the value as it is.
bool number(const char* label, std::uint64_t* value);
/// True while what belongs to it is to be shown.
bool heading(const char* label, bool open_at_first);
/// True while the list is open: then entries, and close_list() after them.
bool open_list(const char* label, const std::string& chosen);
bool entry(const std::string& label, bool chosen);
void close_list();

}  // namespace widget
}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
