/// What fills the window.
#include "src/viewer/show.hpp"

#include <jfpx/error.hpp>

#include "src/viewer/scene_choice.hpp"
#include "src/viewer/widgets.hpp"

#include <imgui.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

void Show::advance(double seconds, std::uint64_t most) {
  if (!paused) clock_.advance(seconds * speed, dt(), most, [this] { step(); });
  paused = paused || at_end();
}

void Show::show_run_buttons(bool with_back) {
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

void Show::save_recording(const std::string& path) const {
  throw InvalidArgument(path + ": only a scene on one engine can be recorded");
}
void Show::record_to(const std::string& path) { save_recording(path); }

bool shows_demo(const ViewOptions& options) {
  return !options.side_by_side && (!options.input.empty() || is_playable(options.run.scene));
}

std::unique_ptr<Show> make_show(const ViewOptions& options) {
  if (options.side_by_side) return make_side_by_side(options);
  return shows_demo(options) ? make_demo_show(options) : make_scene_show(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
