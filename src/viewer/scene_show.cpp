/// One run in the window.
#include "src/viewer/scene_show.hpp"

#include "src/tool/demo_names.hpp"
#include "src/viewer/framing.hpp"

#include <fmt/format.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

Player make_player(const ViewOptions& options) {
  if (is_recording(options.run.scene)) {
    Recorded recorded = open_recording(options.run.scene);
    return {std::move(recorded.run), recorded.scene};
  }
  const Scene scene = tool::load(options.run);
  return {make_run(scene, options.choice), scene};
}

}  // namespace

SceneShow::SceneShow(const ViewOptions& options)
    : options_(options), player_(make_player(options)), stage_(player_.scene()) {
  colouring = options.colouring;
  contacts = options.contacts;
  forces = options.forces;
  fill_fields();
  home();
}

void SceneShow::step() {
  player_.step();
  check(player_.shown().trouble.empty());
}
void SceneShow::step_back() {
  clock_.settle();
  player_.step_back();
}
void SceneShow::restart() {
  clock_.settle();
  player_.restart();
  message.clear();
}
void SceneShow::home() { camera = camera_for(options_, player_.scene(), player_.shown()); }

View SceneShow::view() const {
  const Bounds bounds = stage_.bounds(player_.shown().states);
  return camera.view(bounds.centre, bounds.radius);
}

void SceneShow::draw(Renderer& renderer, const Target& target) {
  options_.size = {target.width, target.height};  // what home() is to fill
  const View now = view();
  Drawing drawing(now.eye);
  stage_.draw(player_.before(), player_.shown(), share(), colouring, &drawing);
  if (contacts) stage_.draw_contacts(player_.shown().contacts, false, &drawing);
  if (forces) stage_.draw_forces(player_.before(), player_.shown(), &drawing);
  if (picked_) stage_.draw_mark(player_.before(), player_.shown(), share(), *picked_, &drawing);
  renderer.draw(drawing, now, {0, 0, target.width, target.height, target.unit}, target.framebuffer);
}

void SceneShow::pick(Real x, Real y, int width, int height) {
  const View now = view();
  const Vec3 direction = ray_through(now, x, y, width, height);
  picked_ = stage_.pick(player_.before(), player_.shown(), share(), now.eye, direction);
}

// As in the thesis.
bool SceneShow::walks() const { return tool::is_demo(options_.run.scene); }

std::string SceneShow::summary() const {
  const Moment& now = player_.shown();
  const EngineChoice choice = player_.choice();
  return fmt::format(
      "{}: {} bodies, step {}, {} contacts, engine {}, spheres by {}{}{}, hash {:016x}{}{}",
      player_.scene().name, player_.scene().bodies.size(), now.step, now.contacts.size(),
      kEngineNames[static_cast<std::size_t>(choice.engine)], now.computed_by,
      now.solved_by.empty() ? "" : ", solved by ", now.solved_by, state_hash(now.states),
      now.trouble.empty() ? "" : "; ", now.trouble);
}

std::unique_ptr<Show> make_scene_show(const ViewOptions& options) {
  return std::make_unique<SceneShow>(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
