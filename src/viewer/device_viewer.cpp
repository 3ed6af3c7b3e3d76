/// Viewer of a world on the GPU that draws its balls from device memory.
#include "src/viewer/device_viewer.hpp"

#include "src/viewer/exchangeable_collider.hpp"
#include "src/viewer/framing.hpp"
#include "src/viewer/widgets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <imgui.h>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

/// Scenes with fewer bodies are drawn from the host, where pictures can show more properties.
constexpr std::size_t kFewestBodies = 100000;

bool is_movable(const BodyDef& body) { return body.mass > 0; }

std::vector<Ball> balls_of(const ScenePainter& painter) {
  std::vector<Ball> balls;
  const auto& bodies = painter.scene().bodies;
  for (std::uint32_t i = 0; i < bodies.size(); ++i) {
    if (!is_movable(bodies[i])) continue;
    const Real radius = std::get<Sphere>(bodies[i].shape).radius;
    balls.push_back({i, static_cast<float>(radius), painter.paint(i)});
  }
  return balls;
}

}  // namespace

DeviceViewer::DeviceViewer(ViewOptions options, const Scene& scene, DeviceRun run)
    : options_(std::move(options)),
      run_(std::move(run)),
      painter_(scene),
      world_(run_.make_world(scene)),
      spheres_(run_.make_spheres(&world_, balls_of(painter_))) {
  home();
}

bool DeviceViewer::suits(const Scene& scene) {
  return std::ranges::all_of(scene.bodies, [](const BodyDef& body) {
    return is_movable(body) ? std::holds_alternative<Sphere>(body.shape) : !body.kinematic;
  });
}

void DeviceViewer::step() {
  report_ = world_.step();
  check(!report_.non_finite);
}

void DeviceViewer::restart() {
  clock_.settle();
  world_ = run_.make_world(painter_.scene());  // spheres_ keeps the address
  report_ = {};
}

/// Fetches the states.
void DeviceViewer::home() {
  RunState now;
  now.states = world_.states();
  bounds_ = painter_.bounds(now.states);
  camera = initial_camera(options_, painter_.scene(), now);
}

void DeviceViewer::draw(Renderer& renderer, const Target& target) {
  options_.size = {target.width, target.height};  // for home()
  const View view = camera.view(bounds_.centre, bounds_.radius);
  Drawing drawing(view.eye);
  painter_.draw_immovable(bounds_, &drawing);
  drawing.set_resident(spheres_.get());
  renderer.draw(drawing, view, {0, 0, target.width, target.height, target.unit},
                target.framebuffer);
}

void DeviceViewer::panel() {
  ImGui::SetNextWindowPos({12, 12}, ImGuiCond_FirstUseEver);
  if (ImGui::Begin("jfpx", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    show_run_buttons(false);
    if (!message.empty()) widget::warning(message);
    if (const auto chosen = choose_scene(options_.run.scene)) {
      next = options_;
      next->run.scene = *chosen;
      next->run.spheres.reset();
      next->run.boxes.reset();
    }
    ImGui::Separator();
    widget::text(fmt::format("step {}, {:.2f} s", report_.step, world_.time()));
    widget::text(fmt::format("{} bodies, {} awake, {} contacts", painter_.scene().bodies.size(),
                             report_.awake, report_.contacts));
    widget::text(fmt::format("{:.3f} ms: detect {:.3f}, solve {:.3f}", report_.total_ms,
                             report_.detect_ms, report_.resolve_ms));
  }
  ImGui::End();
}

std::string DeviceViewer::summary() const {
  const std::string& reason = spheres_->host_copy_reason();
  return fmt::format(
      "{}: {} bodies, step {}, {} contacts, engine native, resolver {}, drawn {}, hash {:016x}{}{}",
      painter_.scene().name, painter_.scene().bodies.size(), report_.step, report_.contacts,
      tool::resolver_name(painter_.scene().solver),
      reason.empty() ? "from device memory" : "through the host: " + reason, world_.state_hash(),
      report_.non_finite ? "; a body became non-finite" : "",
      report_.device_failure.empty() ? "" : "; " + report_.device_failure);
}

std::unique_ptr<Viewer> make_device_viewer(const ViewOptions& options) {
  const bool wants_states = options.contacts || options.forces ||
                            options.colouring != Colouring::bodies || !options.recording.empty();
  if (options.choice.engine != EngineKind::native || options.choice.backend != Backend::cuda ||
      wants_states || is_recording(options.run.scene)) {
    return nullptr;
  }
  const Scene scene = tool::load(options.run);
  if (scene.bodies.size() < kFewestBodies || scene.solver != Solver::soft_step ||
      !DeviceViewer::suits(scene)) {
    return nullptr;
  }
  return std::make_unique<DeviceViewer>(
      options, scene, DeviceRun{.make_world = [choice = options.choice](const Scene& given) {
        return World(given, world_settings(choice));
      }});
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
