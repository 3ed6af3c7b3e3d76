/// The panel of a run: what runs, on what, how fast, and what is known about a body.
#include <jfpx/error.hpp>

#include "src/viewer/scene_choice.hpp"
#include "src/viewer/scene_show.hpp"
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
constexpr float kItemWidth = 170;  // of a slider or a field, its label not counted
constexpr float kTextWidth = 320;
constexpr float kTableWidth = 300;
constexpr float kMargin = 12;        // between a panel and the window's edge
constexpr double kUnnoticed = 0.95;  // share of the speed that was asked for
constexpr std::uint64_t kMaxSpheres = 2'000'000;

/// A slider over a Real. @return whether the user has let go of a new value.
bool slide(const char* label, Real* value, float low, float high) {
  auto number = static_cast<float>(*value);
  if (widget::slider(label, &number, low, high, "%.5f")) {  // to which it is rounded
    *value = static_cast<Real>(std::clamp(number, low, high));
  }
  return ImGui::IsItemDeactivatedAfterEdit();
}

}  // namespace

void SceneShow::panel() {
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
      message = error.what();  // what was asked for can't be had; the run goes on as before
      fill_fields();
    }
    if (!message.empty()) widget::warning(message, kTextWidth);
    show_counters();
    ImGui::PopItemWidth();
  }
  ImGui::End();
  show_picked();
}

void SceneShow::fill_fields() {
  const auto& bodies = player_.scene().bodies;
  wanted_spheres_ = static_cast<std::uint64_t>(std::count_if(
      bodies.begin(), bodies.end(),
      [](const BodyDef& body) { return std::holds_alternative<Sphere>(body.shape); }));
  wanted_seed_ = options_.run.seed;
  wanted_settings_ = player_.settings();
}

void SceneShow::show_controls() {
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
  if (clock_.kept() < kUnnoticed) {
    widget::text(fmt::format("too slow for that: {:.2f} x", speed * clock_.kept()));
  }
  widget::text(fmt::format("step {}, {:.2f} s{}", player_.shown().step, player_.shown().time,
                           player_.in_the_past() ? "  (looking back)"
                           : player_.at_end()    ? "  (end of recording)"
                                                 : ""));
}

void SceneShow::show_scene_choice() {
  if (!widget::heading("Scene", true)) return;
  ViewOptions wish = options_;
  wish.choice = player_.choice();
  bool changed = false;
  if (const auto chosen = choose_scene(player_.scene().name)) {
    wish.run.scene = *chosen;
    wish.run.spheres.reset();
    wish.run.boxes.reset();
    changed = true;
  }
  if (widget::number("spheres", &wanted_spheres_)) {
    wish.run.spheres = static_cast<std::uint32_t>(std::min(wanted_spheres_, kMaxSpheres));
    changed = true;
  }
  if (widget::number("seed", &wanted_seed_)) {
    wish.run.seed = wanted_seed_;
    changed = true;
  }
  if (!changed) return;
  message.clear();
  if (is_playable(wish.run.scene)) {  // which takes less
    wish.choice.engine = EngineKind::native;
    wish.run.no_sleep = false;
    wish.colouring = Colouring::bodies;
  }
  next = wish;
  fill_fields();  // which stay if that can't be had
}

void SceneShow::show_engine_choice() {
  if (!widget::heading("Engine", true)) return;
  EngineChoice wish = player_.choice();
  int engine = static_cast<int>(wish.engine);
  for (int i = 0; i < 3; ++i) {
    if (!has_engine(static_cast<EngineKind>(i))) continue;
    if (i > 0) ImGui::SameLine();
    widget::radio(kEngineNames[static_cast<std::size_t>(i)].data(), &engine, i);
  }
  wish.engine = static_cast<EngineKind>(engine);
  int backend = static_cast<int>(wish.backend);
  for (int i = 0; i < 3; ++i) {
    if (i > 0) ImGui::SameLine();
    widget::radio(to_string(static_cast<Backend>(i)).data(), &backend, i);
  }
  wish.backend = static_cast<Backend>(backend);
  if (wish.engine == EngineKind::bullet) {
    widget::check("jfpx' solver", &wish.jfpx_solver);
    ImGui::SameLine();
    widget::check("jfpx' world", &wish.jfpx_world);
  }
  if (wish == player_.choice()) return;
  message = player_.switch_to(wish) ? "Switched: the bits stay the same."
                                    : "Another engine goes on from the same state.";
}

void SceneShow::show_settings() {
  if (!widget::heading("Settings", false)) return;
  // While a widget is held its value is the user's, and is taken over when he lets go.
  if (!ImGui::IsAnyItemActive()) wanted_settings_ = player_.settings();
  bool changed = slide("dt [s]", &wanted_settings_.dt, 1e-4f, 0.05f);
  std::uint64_t iterations = wanted_settings_.resolver.max_iterations;
  changed |= widget::number("iterations, 0 = 8N", &iterations);
  constexpr std::uint64_t kMax = std::numeric_limits<std::uint32_t>::max();
  wanted_settings_.resolver.max_iterations = static_cast<std::uint32_t>(std::min(iterations, kMax));
  changed |= slide("velocity eps [m/s]", &wanted_settings_.resolver.velocity_epsilon, 1e-5f, 1);
  changed |= slide("position eps [m]", &wanted_settings_.resolver.position_epsilon, 1e-5f, 1);
  changed |=
      slide("restitution from [m/s]", &wanted_settings_.resolver.restitution_velocity, 1e-3f, 5);
  changed |= slide("sleep eps [m2/s2]", &wanted_settings_.sleep.epsilon, 1e-4f, 5);
  changed |= widget::check("sleep", &wanted_settings_.sleep.enabled);
  if (widget::button("The scene's own")) {
    wanted_settings_ = own_settings_;
    changed = true;
  }
  if (!changed) return;
  player_.set_settings(wanted_settings_);
  message.clear();
}

void SceneShow::show_counters() {
  const Moment& now = player_.shown();
  ImGui::Separator();
  const auto awake = std::count(now.awake.begin(), now.awake.end(), std::uint8_t{1});
  widget::text(fmt::format("{} bodies, {} awake, {} contacts", now.states.size(), awake,
                           now.contacts.size()));
  widget::text(now.solved_by.empty()
                   ? fmt::format("spheres by {}, {} corrections", now.computed_by, now.iterations)
                   : fmt::format("spheres by {}, solved by {}", now.computed_by, now.solved_by));
  if (!now.trouble.empty()) widget::warning(now.trouble, kTextWidth);
  const std::array<std::pair<const char*, double StageTimes::*>, 5> stages = {
      {{"integrate", &StageTimes::integrate},
       {"broad", &StageTimes::broad},
       {"detect", &StageTimes::detect},
       {"solve", &StageTimes::solve},
       {"total", &StageTimes::total}}};
  const auto& history = player_.history();
  constexpr std::size_t kPlotted = 240;
  const std::size_t first = history.size() > kPlotted ? history.size() - kPlotted : 0;
  std::vector<float> values(history.size() - first);
  for (const auto& [name, field] : stages) {
    for (std::size_t i = first; i < history.size(); ++i) {
      values[i - first] = static_cast<float>(history[i].times.*field);
    }
    // What stands behind ### keeps the plot the same one while its label changes.
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

void SceneShow::show_picked() {
  if (!picked_) return;
  // What stands behind ### keeps the window the same one for all bodies.
  const std::string title = fmt::format("body {}###body", *picked_);
  ImGui::SetNextWindowPos({ImGui::GetIO().DisplaySize.x - kMargin, kMargin}, ImGuiCond_Always,
                          {1, 0});
  if (ImGui::Begin(title.c_str(), nullptr,
                   ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoFocusOnAppearing)) {
    show_body(*picked_);
  }
  ImGui::End();
}

void SceneShow::show_body(std::uint32_t body) {
  const Moment& now = player_.shown();
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
    if (contact.a != body && contact.b != body) continue;
    const Vec3 n = contact.a == body ? contact.normal : -contact.normal;
    ImGui::TableNextColumn();
    widget::text(fmt::format("{}", contact.a == body ? contact.b : contact.a));
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
