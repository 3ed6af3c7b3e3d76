/// Interface of the viewers that fill the window.
#include "src/viewer/viewer.hpp"

#include <jfpx/error.hpp>

#include "src/demos/demo.hpp"
#include "src/tool/demo_names.hpp"
#include "src/viewer/widgets.hpp"

#include <imgui.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

void Viewer::advance(double seconds, std::uint64_t max_steps) {
  if (!paused) clock_.advance(seconds * speed, dt(), max_steps, [this] { step(); });
  paused = paused || at_end();
}

void Viewer::show_run_buttons(bool with_back) {
  if (widget::button(paused ? "Run" : "Pause")) paused = !paused;
  ImGui::SameLine();
  if (with_back) {
    if (widget::button("Back")) paused = true, step_back();
    ImGui::SameLine();
  }
  if (widget::button("Step")) paused = true, step();
  ImGui::SameLine();
  if (widget::button("Restart")) restart();
}

void Viewer::save_recording(const std::string& path) const {
  throw InvalidArgument(path + ": only a scene on one engine can be recorded");
}
void Viewer::record_to(const std::string& path) { save_recording(path); }

bool selects_demo(const ViewOptions& options) {
  return !options.side_by_side && (!options.input.empty() || is_playable(options.run.scene));
}

std::unique_ptr<Viewer> make_viewer(const ViewOptions& options) {
  if (options.side_by_side) return make_side_by_side(options);
  if (selects_demo(options)) return make_demo_viewer(options);
  if (auto viewer = make_device_viewer(options)) return viewer;
  return make_scene_viewer(options);
}

std::optional<std::string> choose_scene(const std::string& current) {
  std::optional<std::string> chosen;
  if (!widget::open_list("scene", current)) return chosen;
  const auto offer = [&](std::string_view name) {
    const std::string text(name);
    if (widget::entry(text, text == current)) chosen = text;
  };
  for (const scenes::Entry& entry : scenes::all()) offer(entry.name);
  for (const demos::Entry& entry : demos::all()) {
    if (tool::is_only_a_demo(std::string(entry.name))) offer(entry.name);
  }
  widget::close_list();
  return chosen;
}

bool is_playable(std::string_view name) {
  return tool::is_demo(std::string(name)) &&
         demos::make(name, {.scene = {.spheres = 0}})->controls().size() > 1;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
