/// Choosing what runs, in a panel.
#include "src/viewer/scene_choice.hpp"

#include "src/demos/demo.hpp"
#include "src/tool/demo_names.hpp"
#include "src/viewer/widgets.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

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
