/// Wrappers of Dear ImGui's widgets.
#include "src/viewer/widgets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <imgui.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view::widget {
namespace {

constexpr float kTextWidth = 320;  // [units]

const ImVec4 kWarning{1.0f, 0.55f, 0.35f, 1.0f};

PanelLog* log() { return static_cast<PanelLog*>(ImGui::GetIO().UserData); }

/// Logs the last item. @param width of the part that reacts to the mouse
void log_item(const std::string& label, float width, const std::string& value) {
  if (log() == nullptr) return;
  const ImVec2 item = ImGui::GetItemRectMin(), end = ImGui::GetItemRectMax();
  const ImVec2 from = ImGui::GetWindowDrawList()->GetClipRectMin();
  const ImVec2 to = ImGui::GetWindowDrawList()->GetClipRectMax();
  const PanelLog::Widget seen{std::max(item.x, from.x), std::max(item.y, from.y),
                              std::min({end.x, item.x + width, to.x}), std::min(end.y, to.y),
                              value};
  if (seen.left < seen.right && seen.top < seen.bottom) log()->widgets[label] = seen;
}
void log_item(const std::string& label, const std::string& value = {}) {
  log_item(label, ImGui::GetItemRectSize().x, value);
}

const char* on_or_off(bool on) { return on ? "on" : "off"; }

void log_text(const std::string& text) {
  if (log() != nullptr) log()->texts.push_back(text);
}

}  // namespace

void set_log(PanelLog* log) { ImGui::GetIO().UserData = log; }

void text(const std::string& text) {
  ImGui::TextUnformatted(text.c_str());
  log_text(text);
}

void warning(const std::string& text) {
  ImGui::PushTextWrapPos(kTextWidth);
  ImGui::TextColored(kWarning, "%s", text.c_str());
  ImGui::PopTextWrapPos();
  log_text(text);
}

bool button(const char* label) {
  const bool pressed = ImGui::Button(label);
  log_item(label);
  return pressed;
}

bool check(const char* label, bool* on) {
  const bool changed = ImGui::Checkbox(label, on);
  log_item(label, on_or_off(*on));
  return changed;
}

bool radio(const char* label, int* value, int own) {
  const bool chosen = ImGui::RadioButton(label, value, own);
  log_item(label, on_or_off(*value == own));
  return chosen;
}

bool slider(const char* label, float* value, float low, float high, const char* format) {
  const bool moved =
      ImGui::SliderFloat(label, value, low, high, format, ImGuiSliderFlags_Logarithmic);
  log_item(label, ImGui::CalcItemWidth(), fmt::format("{:g}", *value));
  return moved;
}

bool number(const char* label, std::uint64_t* value) {
  std::string text = std::to_string(*value);
  text.resize(24);  // holds any 64-bit number
  if (ImGui::InputText(label, text.data(), text.size(),
                       ImGuiInputTextFlags_CharsDecimal | ImGuiInputTextFlags_AutoSelectAll)) {
    const char* end = text.data() + text.find('\0');
    std::uint64_t typed = 0;
    const auto [rest, error] = std::from_chars(text.data(), end, typed);
    if (rest == end && error == std::errc()) *value = typed;
  }
  log_item(label, ImGui::CalcItemWidth(), std::to_string(*value));
  return ImGui::IsItemDeactivatedAfterEdit();
}

bool heading(const char* label, bool open_at_first) {
  const bool open = ImGui::CollapsingHeader(
      label, open_at_first ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
  log_item(label);
  return open;
}

bool open_list(const char* label, const std::string& chosen) {
  const float width = ImGui::CalcItemWidth();
  const bool open = ImGui::BeginCombo(label, chosen.c_str());
  if (!open) log_item(label, width, chosen);  // an open list contains the last item
  return open;
}

bool entry(const std::string& label, bool chosen) {
  const bool pressed = ImGui::Selectable(label.c_str(), chosen);
  log_item(label, on_or_off(chosen));
  return pressed;
}

void close_list() { ImGui::EndCombo(); }

}  // namespace view::widget
}  // namespace JFPX_ABI
}  // namespace jfpx
