/// Viewer of one run.
#include "src/viewer/scene_viewer.hpp"

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

SceneViewer::SceneViewer(const ViewOptions& options)
    : options_(options), player_(make_player(options)), painter_(player_.scene()) {
  colouring = options.colouring;
  contacts = options.contacts;
  forces = options.forces;
  fill_fields();
  home();
}

void SceneViewer::step() {
  player_.step();
  check(player_.shown().trouble.empty());
}
void SceneViewer::step_back() {
  clock_.settle();
  player_.step_back();
}
void SceneViewer::restart() {
  clock_.settle();
  player_.restart();
  message.clear();
}
void SceneViewer::home() { camera = initial_camera(options_, player_.scene(), player_.shown()); }

View SceneViewer::view() const {
  const Bounds bounds = painter_.bounds(player_.shown().states);
  return camera.view(bounds.centre, bounds.radius);
}

void SceneViewer::draw(Renderer& renderer, const Target& target) {
  options_.size = {target.width, target.height};  // for home()
  const View now = view();
  Drawing drawing(now.eye);
  painter_.draw(player_.before(), player_.shown(), share(), colouring, &drawing);
  if (contacts) painter_.draw_contacts(player_.shown().contacts, false, &drawing);
  if (forces) painter_.draw_forces(player_.before(), player_.shown(), &drawing);
  if (picked_) painter_.draw_mark(player_.before(), player_.shown(), share(), *picked_, &drawing);
  renderer.draw(drawing, now, {0, 0, target.width, target.height, target.unit}, target.framebuffer);
}

void SceneViewer::pick(Real x, Real y, int width, int height) {
  const View now = view();
  const Vec3 direction = ray_through(now, x, y, width, height);
  picked_ = painter_.pick(player_.before(), player_.shown(), share(), now.eye, direction);
}

// As in the thesis.
bool SceneViewer::walks() const { return tool::is_demo(options_.run.scene); }

std::string SceneViewer::summary() const {
  const RunState& now = player_.shown();
  const EngineChoice choice = player_.choice();
  const bool native = choice.engine == EngineKind::native;
  return fmt::format(
      "{}: {} bodies, step {}, {} contacts, engine {}{}{}, spheres by {}{}{}, hash {:016x}{}{}",
      player_.scene().name, player_.scene().bodies.size(), now.step, now.contacts.size(),
      to_string(choice.engine), native ? ", resolver " : "",
      native ? tool::resolver_name(player_.scene().solver) : "", now.computed_by,
      now.solved_by.empty() ? "" : ", solved by ", now.solved_by, state_hash(now.states),
      now.trouble.empty() ? "" : "; ", now.trouble);
}

std::unique_ptr<Viewer> make_scene_viewer(const ViewOptions& options) {
  return std::make_unique<SceneViewer>(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
