/// The panel of a run: controls, scene, engine, settings, counters, and the picked body.
#include <jfpx/error.hpp>

#include "src/viewer/scene_viewer.hpp"
#include "src/viewer/widgets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <imgui.h>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr float kWidth = 330;      // [units]
constexpr float kItemWidth = 170;  // of a slider or a field without its label
constexpr float kTableWidth = 300;
constexpr float kMargin = 12;          // between a panel and the edge of the window
constexpr double kAsRequested = 0.95;  // fraction of the requested speed
constexpr std::uint64_t kMaxSpheres = 2'000'000;

constexpr std::uint64_t kMaxCount = std::numeric_limits<std::uint32_t>::max();

/// A slider for a Real. @return true when the user releases a changed value
bool slide(const char* label, Real* value, float low, float high) {
  auto number = static_cast<float>(*value);
  if (widget::slider(label, &number, low, high, "%.5f")) {  // also rounds the value
    *value = static_cast<Real>(std::clamp(number, low, high));
  }
  return ImGui::IsItemDeactivatedAfterEdit();
}

/// A field for a 32-bit number. @return true when the user leaves it after a change
bool count(const char* label, std::uint32_t* value) {
  std::uint64_t number = *value;
  const bool changed = widget::number(label, &number);
  *value = static_cast<std::uint32_t>(std::min(number, kMaxCount));
  return changed;
}

}  // namespace

void SceneViewer::panel() {
  ImGui::SetNextWindowPos({kMargin, kMargin}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({kWidth, 0}, ImGuiCond_FirstUseEver);
  if (ImGui::Begin("jfpx", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    ImGui::PushItemWidth(kItemWidth);
    try {
      show_controls();
      show_scene_choice();
      show_engine_choice();
      show_settings();
    } catch (const Error& error) {
      message = error.what();  // the request failed; the run is unchanged
      fill_fields();
    }
    if (!message.empty()) widget::warning(message);
    show_counters();
    ImGui::PopItemWidth();
  }
  ImGui::End();
  show_picked();
}

void SceneViewer::fill_fields() {
  const auto& bodies = player_.scene().bodies;
  sphere_field_ = static_cast<std::uint64_t>(std::count_if(
      bodies.begin(), bodies.end(),
      [](const BodyDef& body) { return std::holds_alternative<Sphere>(body.shape); }));
  seed_field_ = options_.run.seed;
  settings_field_ = player_.settings();
}

void SceneViewer::show_controls() {
  show_run_buttons(true);
  for (const auto& [label, command] :
       {std::pair("Picture", Command::screenshot), std::pair("Film", Command::record),
        std::pair("Save steps", Command::save)}) {
    if (command != Command::screenshot) ImGui::SameLine();
    if (widget::button(label)) commands.push_back(command);
  }
  auto rate = static_cast<float>(speed);
  if (widget::slider("speed", &rate, 0.01f, 4, "%.2f x")) {
    speed = static_cast<double>(rate);
  }
  if (clock_.kept() < kAsRequested) {
    widget::text(fmt::format("too slow: {:.2f} x", speed * clock_.kept()));
  }
  widget::text(fmt::format("step {}, {:.2f} s{}", player_.shown().step, player_.shown().time,
                           player_.in_the_past() ? "  (history)"
                           : player_.at_end()    ? "  (end of recording)"
                                                 : ""));
}

void SceneViewer::show_scene_choice() {
  if (!widget::heading("Scene", true)) return;
  ViewOptions request = options_;
  request.choice = player_.choice();
  bool changed = false;
  if (const auto chosen = choose_scene(player_.scene().name)) {
    request.run.scene = *chosen;
    request.run.spheres.reset();
    request.run.boxes.reset();
    changed = true;
  }
  if (widget::number("spheres", &sphere_field_)) {
    request.run.spheres = static_cast<std::uint32_t>(std::min(sphere_field_, kMaxSpheres));
    changed = true;
  }
  if (widget::number("seed", &seed_field_)) {
    request.run.seed = seed_field_;
    changed = true;
  }
  if (!changed) return;
  message.clear();
  if (is_playable(request.run.scene)) {  // demos do not support these options
    request.choice.engine = EngineKind::native;
    request.run.no_sleep = false;
    request.run.resolver.reset();
    request.run.substeps.reset();
    request.colouring = Colouring::bodies;
  }
  next = request;
  fill_fields();  // remain if the request fails
}

void SceneViewer::show_engine_choice() {
  if (!widget::heading("Engine", true)) return;
  EngineChoice request = player_.choice();
  int engine = static_cast<int>(request.engine);
  for (int i = 0; i < 3; ++i) {
    if (!has_engine(static_cast<EngineKind>(i))) continue;
    if (i > 0) ImGui::SameLine();
    widget::radio(tool::kEngineNames[i], &engine, i);
  }
  request.engine = static_cast<EngineKind>(engine);
  int backend = static_cast<int>(request.backend);
  for (int i = 0; i < 3; ++i) {
    if (i > 0) ImGui::SameLine();
    widget::radio(to_string(static_cast<Backend>(i)).data(), &backend, i);
  }
  request.backend = static_cast<Backend>(backend);
  if (request.engine == EngineKind::bullet) {
    widget::check("jfpx solver", &request.jfpx_solver);
    ImGui::SameLine();
    widget::check("jfpx world", &request.jfpx_world);
  }
  if (request == player_.choice()) return;
  message = player_.switch_to(request) ? "Switched; the bits are unchanged."
                                       : "Another engine continues from the same state.";
}

void SceneViewer::show_settings() {
  if (!widget::heading("Settings", false)) return;
  // An active widget has the user's value, which takes effect when the widget is released.
  if (!ImGui::IsAnyItemActive()) settings_field_ = player_.settings();
  bool changed = slide("dt [s]", &settings_field_.dt, 1e-4f, 0.05f);
  if (player_.choice().engine == EngineKind::native) changed |= show_resolver_settings();
  changed |= widget::check("sleep", &settings_field_.sleep.enabled);
  if (widget::button("Scene defaults")) {
    settings_field_ = scene_settings_;
    changed = true;
  }
  if (!changed) return;
  player_.set_settings(settings_field_);
  message.clear();
}

/// Shows the choice of the resolver and its settings. @return true if one has changed
bool SceneViewer::show_resolver_settings() {
  int chosen = static_cast<int>(settings_field_.solver);
  for (int i = 0; i < static_cast<int>(std::size(tool::kResolverNames)); ++i) {
    if (i > 0) ImGui::SameLine();
    widget::radio(tool::kResolverNames[i], &chosen, i);
  }
  const auto solver = static_cast<Solver>(chosen);
  bool changed = solver != settings_field_.solver;
  settings_field_.solver = solver;
  SleepSettings& sleep = settings_field_.sleep;
  if (solver == Solver::soft_step) {
    SoftStepSettings& soft = settings_field_.soft_step;
    changed |= count("substeps", &soft.substeps);
    changed |= slide("contact [Hz], 0 = auto", &soft.contact_hertz, 0, 1000);
    changed |= slide("damping ratio", &soft.damping_ratio, 0.01f, 1000);
    changed |= slide("push-out [m/s]", &soft.push_out_speed, 0.01f, 100);
    changed |= slide("restitution from [m/s]", &soft.restitution_threshold, 1e-3f, 5);
    changed |= slide("margin [m]", &soft.speculative_margin, 0, 1);
    changed |= slide("sleep speed [m/s]", &sleep.speed, 1e-4f, 5);
    changed |= slide("sleep time [s]", &sleep.time, 0.01f, 10);
  } else {
    ResolverSettings& resolver = settings_field_.resolver;
    changed |= count("iterations, 0 = 8N", &resolver.max_iterations);
    changed |= slide("velocity eps [m/s]", &resolver.velocity_epsilon, 1e-5f, 1);
    changed |= slide("position eps [m]", &resolver.position_epsilon, 1e-5f, 1);
    changed |= slide("restitution from [m/s]", &resolver.restitution_velocity, 1e-3f, 5);
    changed |= slide("sleep eps [m2/s2]", &sleep.epsilon, 1e-4f, 5);
  }
  return changed;
}

void SceneViewer::show_counters() {
  const RunState& now = player_.shown();
  ImGui::Separator();
  const auto awake = std::count(now.awake.begin(), now.awake.end(), std::uint8_t{1});
  widget::text(fmt::format("{} bodies, {} awake, {} contacts", now.states.size(), awake,
                           now.contacts.size()));
  const std::string solved = !now.solved_by.empty() ? "solved by " + now.solved_by
                             : now.substeps > 0     ? fmt::format("{} substeps", now.substeps)
                                                    : fmt::format("{} corrections", now.iterations);
  widget::text(fmt::format("spheres by {}, {}", now.computed_by, solved));
  if (!now.trouble.empty()) widget::warning(now.trouble);
  const std::array<std::pair<const char*, double tool::StageTimes::*>, 5> stages = {
      {{"integrate", &tool::StageTimes::integrate},
       {"broad", &tool::StageTimes::broad},
       {"detect", &tool::StageTimes::detect},
       {"solve", &tool::StageTimes::solve},
       {"total", &tool::StageTimes::total}}};
  const auto& history = player_.history();
  constexpr std::size_t kPlotted = 240;
  const std::size_t first = history.size() > kPlotted ? history.size() - kPlotted : 0;
  std::vector<float> values(history.size() - first);
  for (const auto& [name, field] : stages) {
    for (std::size_t i = first; i < history.size(); ++i) {
      values[i - first] = static_cast<float>(history[i].times.*field);
    }
    // The text after ### is the identity of the plot, which is constant while the label changes.
    const std::string label = fmt::format("{:.3f} ms {}###{}", now.times.*field, name, name);
    ImGui::PlotLines(label.c_str(), values.data(), static_cast<int>(values.size()), 0, nullptr, 0,
                     FLT_MAX, {kItemWidth, 26});
  }
  if (widget::open_list("colours", kColouringNames[static_cast<std::size_t>(colouring)])) {
    for (std::size_t i = 0; i < std::size(kColouringNames); ++i) {
      const auto offered = static_cast<Colouring>(i);
      if (widget::entry(kColouringNames[i], offered == colouring)) colouring = offered;
    }
    widget::close_list();
  }
  widget::check("contacts", &contacts);
  ImGui::SameLine();
  widget::check("forces", &forces);
}

void SceneViewer::show_picked() {
  if (!picked_) return;
  // The text after ### is the identity of the window, which is the same for all bodies.
  const std::string title = fmt::format("body {}###body", *picked_);
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x - kMargin, kMargin}, ImGuiCond_Always,
                          {1, 0});
  if (ImGui::Begin(title.c_str(), nullptr,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing)) {
    show_body(*picked_);
  }
  ImGui::End();
}

void SceneViewer::show_body(std::uint32_t body) {
  const RunState& now = player_.shown();
  const BodyState& state = now.states[body];
  widget::text(fmt::format("at ({:.3f}, {:.3f}, {:.3f})", state.position.x, state.position.y,
                           state.position.z));
  widget::text(fmt::format("{:.3f} m/s, {:.3f} rad/s{}", length(state.velocity),
                           length(state.angular_velocity), now.awake[body] != 0 ? "" : ", asleep"));
  if (!ImGui::BeginTable("contacts", 3, ImGuiTableFlags_RowBg | ImGuiTableFlags_ScrollY,
                         {kTableWidth, 120})) {
    return;
  }
  for (const char* head : {"with", "depth [mm]", "normal"}) ImGui::TableSetupColumn(head);
  ImGui::TableHeadersRow();
  for (const Contact& contact : now.contacts) {
    const std::uint32_t a = contact.a.index, b = contact.b.index;
    if (a != body && b != body) continue;
    const Vec3 n = a == body ? contact.normal : -contact.normal;
    ImGui::TableNextColumn();
    widget::text(fmt::format("{}", a == body ? b : a));
    ImGui::TableNextColumn();
    widget::text(fmt::format("{:.3f}", -contact.distance * 1000));
    ImGui::TableNextColumn();
    widget::text(fmt::format("{:.2f} {:.2f} {:.2f}", n.x, n.y, n.z));
  }
  ImGui::EndTable();
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
