/// What fills the window.
#include "examples/viewer/show.hpp"

#include <jfpx/error.hpp>

#include "examples/viewer/scene_choice.hpp"

namespace jfpx::inline JFPX_ABI::view {

void Show::save_recording(const std::string& path) const {
  throw InvalidArgument(path + ": only a scene on one engine can be recorded");
}

std::unique_ptr<Show> make_show(const ViewOptions& options) {
  if (options.side_by_side) return make_side_by_side(options);
  const bool demo = !options.input.empty() || is_playable(options.run.scene);
  return demo ? make_demo_show(options) : make_scene_show(options);
}

}  // namespace jfpx::inline JFPX_ABI::view
