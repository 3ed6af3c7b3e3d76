/// Viewer of a demo of the thesis.
#include "src/viewer/demo_viewer.hpp"

#include <jfpx/error.hpp>

#include "src/base/stopwatch.hpp"
#include "src/viewer/exchangeable_collider.hpp"
#include "src/viewer/forces.hpp"
#include "src/viewer/run_state.hpp"
#include "src/viewer/shapes.hpp"
#include "src/viewer/widgets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <imgui.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Real kFlat = Real(0.5);  // items with a smaller scale are shadows

std::unique_ptr<demos::Demo> make_demo(const ViewOptions& options) {
  return demos::make(options.run.scene, {.scene = tool::scene_options(options.run),
                                         .dt = options.run.dt,
                                         .world = world_settings(options.choice)});
}

/// Draws the acceleration of each body by forces in the last step, including its weight. An
/// acceleration of kGravity has the length kWeight.
void draw_forces(const World& world, Drawing* drawing) {
  constexpr Real kWeight = 3, kGravity = Real(9.81), kLongest = 20;
  for (const BodyId id : world.bodies()) {
    const Vec3 way = world.last_acceleration(id) * (kWeight / kGravity);
    const Real reach = length(way);
    if (!(world.mass(id) > 0) || !(reach > kEpsilon)) continue;
    draw_arrow(world.state(id).position, way * (std::min(reach, kLongest) / reach), drawing);
  }
}

bool is_shadow(const demos::Item& item) {
  return std::min({item.scale.x, item.scale.y, item.scale.z}) < kFlat;
}

Paint paint_of(const demos::Colour& colour, bool ball) {
  const auto byte = [](float x) {
    return static_cast<std::uint8_t>(std::lround(std::clamp(x, 0.0f, 1.0f) * 255));
  };
  Paint paint{byte(colour.red), byte(colour.green), byte(colour.blue)};
  const bool brown = colour.red > colour.blue + 0.3f;
  if (ball) paint.pattern = Pattern::solid_ball;
  if (!ball && brown) paint.pattern = Pattern::crate;
  if (ball && paint.r + paint.g + paint.b < 60) paint = {34, 34, 38, Pattern::solid_ball};
  return paint;
}

/// True if the items of two pictures correspond by index, that is, if no item was added or removed.
bool same_items(const demos::View& a, const demos::View& b) {
  return a.items.size() == b.items.size() &&
         std::equal(a.items.begin(), a.items.end(), b.items.begin(),
                    [](const demos::Item& x, const demos::Item& y) { return x.shape == y.shape; });
}

}  // namespace

void draw_demo(const demos::View& from, const demos::View& to, Real share, Drawing* drawing) {
  drawing->add_ground({0, 1, 0}, 0, 1, kGroundPaint);
  const bool interpolates = same_items(from, to);
  for (std::size_t i = 0; i < to.items.size(); ++i) {
    const demos::Item& item = to.items[i];
    if (is_shadow(item)) continue;
    const demos::Item& old = interpolates ? from.items[i] : item;
    const Vec3 position = interpolate(old.position, item.position, share);
    const Quat turn = interpolate(old.orientation, item.orientation, share);
    for_each_solid(item.shape, {position, turn, {}, {}}, [&](const auto& solid, const BodyState&) {
      const bool is_ball = std::is_same_v<std::decay_t<decltype(solid)>, Sphere>;
      drawing->add_solid(solid, position, turn, paint_of(item.colour, is_ball));
    });
  }
  for (const demos::Line& line : to.lines) {
    if (line.from.y == 0 && line.to.y == 0) continue;  // the ground is drawn with a grid
    drawing->add_line(line.from, line.to, paint_of(line.colour, false), 1.5f, 160);
  }
}

Bounds bounds_of(const demos::View& view) {
  Aabb box;
  for (const demos::Item& item : view.items) box = merged(box, {item.position, item.position});
  if (view.items.empty()) return {{0, 1, 0}, 10};
  return {(box.lower + box.upper) * Real(0.5), length(box.upper - box.lower) / 2 + 4};
}

DemoViewer::DemoViewer(const ViewOptions& options) : options_(options) {
  contacts = options.contacts;
  forces = options.forces;
  if (options.choice.engine != EngineKind::native) {
    throw InvalidArgument(options.run.scene +
                          " is a demo, which requires the native engine; omit --engine");
  }
  restart();
  home();
}

void DemoViewer::restart() {
  demo_ = make_demo(options_);
  script_.reset();
  if (!options_.input.empty()) script_.emplace(demos::load_input_script(options_.input), *demo_);
  waiting_.clear();
  clock_.settle();
  report_ = {};
  demo_->draw(&now_);
  before_ = now_;
}

void DemoViewer::step() {
  std::vector<demos::Input> inputs;
  if (script_) {
    const auto written = script_->next();
    inputs.assign(written.begin(), written.end());
  }
  inputs.insert(inputs.end(), waiting_.begin(), waiting_.end());
  waiting_.clear();
  Stopwatch watch;
  report_ = demo_->step(inputs);
  check(!report_.non_finite);
  report_.total_ms = watch.lap_ms();  // includes the controls
  before_ = std::move(now_);
  demo_->draw(&now_);
}

std::vector<std::string> DemoViewer::demo_keys() const {
  std::vector<std::string> keys;
  for (const demos::Control& control : demo_->controls()) keys.emplace_back(control.key);
  return keys;
}

void DemoViewer::demo_key(const DemoKey& key) {
  const auto controls = demo_->controls();
  for (std::size_t i = 0; i < controls.size(); ++i) {
    if (controls[i].key != key.name) continue;
    if (paused) {  // only the final state of the keys has an effect
      std::erase_if(waiting_, [i](const demos::Input& input) { return input.control == i; });
    }
    waiting_.push_back({i, key.pressed});
  }
}

std::vector<KeyHelp> DemoViewer::demo_help() const {
  std::vector<KeyHelp> help;
  for (const demos::Control& control : demo_->controls()) {
    help.push_back({control.key, control.summary});
  }
  return help;
}

void DemoViewer::home() {
  followed_ = camera;
  follow_camera();
}

// Follows the demo's camera until the user moves the camera.
void DemoViewer::follow_camera() {
  if (options_.eye) {
    if (followed_) camera.look_at(*options_.eye, *options_.target);
    followed_.reset();
    return;
  }
  if (followed_ && *followed_ != camera) followed_.reset();
  if (!followed_) return;
  const demos::Camera &old = before_.camera, &now = now_.camera;
  camera.fov_y = now.field_of_view * kPi / 180;
  camera.look_at(interpolate(old.eye, now.eye, share()),
                 interpolate(old.target, now.target, share()));
  followed_ = camera;
}

void DemoViewer::draw(Renderer& renderer, const Target& target) {
  follow_camera();
  const Bounds bounds = bounds_of(now_);
  const View view = camera.view(bounds.centre, bounds.radius);
  Drawing drawing(view.eye);
  drawing.set_bounds(bounds.centre, bounds.radius * Real(1.2));
  drawing.set_detail(1);
  draw_demo(before_, now_, share(), &drawing);
  const World* world = demo_->world();
  if (contacts && world != nullptr) {
    for (const Contact& contact : world->contacts()) {
      drawing.add_line(contact.point, contact.point + contact.normal, {60, 255, 90}, 2);
    }
  }
  if (forces && world != nullptr) draw_forces(*world, &drawing);
  renderer.draw(drawing, view, {0, 0, target.width, target.height, target.unit},
                target.framebuffer);
  float y = ImGui::GetIO().DisplaySize.y - 12;
  std::for_each(now_.text.rbegin(), now_.text.rend(), [&](const std::string& line) {
    y -= ImGui::GetTextLineHeightWithSpacing();
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    list->AddText({15, y + 1}, IM_COL32(0, 0, 0, 190), line.c_str());
    list->AddText({14, y}, IM_COL32_WHITE, line.c_str());
  });
}

void DemoViewer::panel() {
  ImGui::SetNextWindowPos({12, 12}, ImGuiCond_FirstUseEver);
  const std::string title(demo_->name());
  if (ImGui::Begin(title.c_str(), nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    show_run_buttons(false);
    if (!message.empty()) widget::warning(message);
    if (const auto chosen = choose_scene(options_.run.scene)) {
      next = options_;
      next->run.scene = *chosen;
      next->input.clear();
    }
    for (const KeyHelp& line : demo_help()) {
      widget::text(fmt::format("{:6} {}", line.keys, line.action));
    }
    ImGui::Separator();
    widget::text(fmt::format("step {}, {} contacts, {:.3f} ms", report_.step, report_.contacts,
                             report_.total_ms));
  }
  ImGui::End();
}

std::string DemoViewer::summary() const {
  return fmt::format("{}: step {}, hash {:016x}{}", demo_->name(), report_.step,
                     demo_->state_hash(), report_.non_finite ? "; a body became non-finite" : "");
}

std::unique_ptr<Viewer> make_demo_viewer(const ViewOptions& options) {
  return std::make_unique<DemoViewer>(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
