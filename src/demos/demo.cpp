/// The table of demos, and the mapping of inputs to actions.
#include "src/demos/demo.hpp"

#include <jfpx/error.hpp>
#include <jfpx/thesis/worst_first.hpp>

#include "src/demos/makers.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {
namespace {

constexpr Entry kDemos[] = {
    {"boxes-and-balls", "the thesis' benchmark: a leaning tower of balls collapses",
     make_boxes_and_balls},
    {"ballistic", "four weapons fire particles along a range", make_ballistic},
    {"big-ballistic", "four weapons fire rigid balls at two crates", make_big_ballistic},
    {"flight", "an aircraft with wings, rudder and tail takes off", make_flight},
    {"fountain", "a jet of --spheres balls; a hundred come and go in every step", make_fountain},
};

}  // namespace

std::span<const Entry> all() { return kDemos; }

std::unique_ptr<Demo> make(std::string_view name, const Options& options) {
  thesis::enable();
  for (const Entry& entry : kDemos) {
    if (entry.name == name) return entry.make(options);
  }
  Scene scene = scenes::make(name, options.scene);
  scene.dt = options.dt.value_or(scene.dt);
  return make(scene, options.world);
}

StepReport Demo::step(std::span<const Input> inputs) {
  for (const Input& input : inputs) {
    if (input.control < controls_.size()) continue;
    throw InvalidArgument("control is " + std::to_string(input.control) +
                          "; it must be less than the number of controls of \"" +
                          std::string(name()) + "\", " + std::to_string(controls_.size()));
  }
  std::vector<bool> acted(controls_.size());
  for (const Input& input : inputs) {
    // Ignores repeated presses of a control that is already down (key repeat).
    if (input.pressed && !down_[input.control]) {
      act(input.control);
      acted[input.control] = true;
    }
    down_[input.control] = input.pressed;
  }
  for (std::size_t i = 0; i < controls_.size(); ++i) {
    if (controls_[i].repeats && down_[i] && !acted[i]) act(i);
  }
  return advance();
}

std::size_t find_control(const Demo& demo, std::string_view name) {
  std::string names;
  for (std::size_t i = 0; i < demo.controls().size(); ++i) {
    if (demo.controls()[i].name == name) return i;
    names += (names.empty() ? "" : ", ") + std::string(demo.controls()[i].name);
  }
  throw InvalidArgument("\"" + std::string(demo.name()) + "\" has no control \"" +
                        std::string(name) + "\"; controls are " + names);
}

Item shadow_of(const Item& item, Real thickness) {
  Item shadow = item;
  shadow.position.y = 0;
  shadow.scale.y *= thickness;
  shadow.colour = kShadow;
  return shadow;
}

void add_ground_lines(View* view, Real half_width, Real spacing, int count) {
  for (int i = 0; i < count; ++i) {
    const Real z = spacing * static_cast<Real>(i);
    view->lines.push_back({{-half_width, 0, z}, {half_width, 0, z}, kGrey});
  }
}

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
