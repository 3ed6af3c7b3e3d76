/// The panel of a run: what runs, on what, how fast, and what is known about a body.
#include <jfpx/error.hpp>

#include "examples/viewer/scene_choice.hpp"
#include "examples/viewer/scene_show.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <imgui.h>

namespace jfpx::inline JFPX_ABI::view {
namespace {

const ImVec4 kWarning{1.0f, 0.55f, 0.35f, 1.0f};

void say(const std::string& text) { ImGui::TextUnformatted(text.c_str()); }

std::ptrdiff_t count_spheres(const Scene& scene) {
  return std::count_if(scene.bodies.begin(), scene.bodies.end(), [](const BodyDef& body) {
    return std::holds_alternative<Sphere>(body.shape);
  });
}

/// A slider over a Real. @return whether the user has let go of a new value.
bool slide(const char* label, Real* value, float low, float high, const char* format = "%.3f") {
  auto number = static_cast<float>(*value);
  if (ImGui::SliderFloat(label, &number, low, high, format, ImGuiSliderFlags_Logarithmic)) {
    *value = static_cast<Real>(std::clamp(number, low, high));
  }
  return ImGui::IsItemDeactivatedAfterEdit();
}

}  // namespace

void SceneShow::panel() {
  ImGui::SetNextWindowPos({12, 12}, ImGuiCond_FirstUseEver);
  ImGui::SetNextWindowSize({330, 0}, ImGuiCond_FirstUseEver);
  if (ImGui::Begin("jfpx", nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
    ImGui::PushItemWidth(170);
    try {
      show_controls();
      show_scene_choice();
      show_engine_choice();
      show_settings();
    } catch (const Error& error) {
      message_ = error.what();  // what was asked for can't be had; the run goes on as before
    }
    if (!message_.empty()) {
      ImGui::PushTextWrapPos(320);
      ImGui::TextColored(kWarning, "%s", message_.c_str());
      ImGui::PopTextWrapPos();
    }
    show_counters();
    show_picked();
    ImGui::PopItemWidth();
  }
  ImGui::End();
}

void SceneShow::show_controls() {
  if (ImGui::Button(paused ? "Run" : "Pause")) paused = !paused;
  ImGui::SameLine();
  if (ImGui::Button("Back")) paused = true, step_back();
  ImGui::SameLine();
  if (ImGui::Button("Step")) paused = true, step();
  ImGui::SameLine();
  if (ImGui::Button("Restart")) restart();
  for (const auto& [label, command] :
       {std::pair("Picture", Command::screenshot), std::pair("Film", Command::record),
        std::pair("Save steps", Command::save)}) {
    if (command != Command::screenshot) ImGui::SameLine();
    if (ImGui::Button(label)) commands.push_back(command);
  }
  auto rate = static_cast<float>(speed);
  if (ImGui::SliderFloat("speed", &rate, 0.01f, 4, "%.2f x", ImGuiSliderFlags_Logarithmic)) {
    speed = static_cast<double>(rate);
  }
  say(fmt::format("step {}, {:.2f} s{}", player_.shown().step, player_.time(),
                  player_.in_the_past() ? "  (looking back)" : ""));
}

void SceneShow::show_scene_choice() {
  if (!ImGui::CollapsingHeader("Scene", ImGuiTreeNodeFlags_DefaultOpen)) return;
  ViewOptions wish = options_;
  wish.choice = player_.choice();
  bool changed = false;
  if (const auto chosen = choose_scene(player_.scene().name)) {
    wish.run.scene = *chosen;
    wish.run.spheres.reset();
    wish.run.boxes.reset();
    changed = true;
  }
  ImGui::InputInt("spheres", &wanted_spheres_, 0);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    wanted_spheres_ = std::clamp(wanted_spheres_, 0, 2'000'000);
    wish.run.spheres = static_cast<std::uint32_t>(wanted_spheres_);
    changed = true;
  }
  ImGui::InputInt("seed", &wanted_seed_, 0);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    wanted_seed_ = std::max(wanted_seed_, 0);
    wish.run.seed = static_cast<std::uint64_t>(wanted_seed_);
    changed = true;
  }
  if (!changed) return;
  message_.clear();
  if (is_playable(wish.run.scene)) {
    wish.choice.engine = EngineKind::native;
    next = wish;
    return;
  }
  load(wish);
  wanted_spheres_ = static_cast<int>(count_spheres(player_.scene()));
  home();
}

void SceneShow::show_engine_choice() {
  if (!ImGui::CollapsingHeader("Engine", ImGuiTreeNodeFlags_DefaultOpen)) return;
  EngineChoice wish = player_.choice();
  int engine = static_cast<int>(wish.engine);
  for (int i = 0; i < 3; ++i) {
    if (!has_engine(static_cast<EngineKind>(i))) continue;
    if (i > 0) ImGui::SameLine();
    ImGui::RadioButton(kEngineNames[static_cast<std::size_t>(i)].data(), &engine, i);
  }
  wish.engine = static_cast<EngineKind>(engine);
  int backend = static_cast<int>(wish.backend);
  for (int i = 0; i < 3; ++i) {
    if (i > 0) ImGui::SameLine();
    ImGui::RadioButton(to_string(static_cast<Backend>(i)).data(), &backend, i);
  }
  wish.backend = static_cast<Backend>(backend);
  if (wish.engine == EngineKind::bullet) {
    ImGui::Checkbox("jfpx' solver", &wish.jfpx_solver);
    ImGui::SameLine();
    ImGui::Checkbox("jfpx' world", &wish.jfpx_world);
  }
  if (wish == player_.choice()) return;
  message_ = player_.switch_to(wish) ? "Switched: the bits stay the same."
                                     : "Another engine goes on from the same state.";
}

void SceneShow::show_settings() {
  if (!ImGui::CollapsingHeader("Settings")) return;
  Scene wish = player_.scene();
  bool changed = slide("dt [s]", &wish.dt, 1e-4f, 0.05f, "%.4f");
  int iterations = static_cast<int>(wish.resolver.max_iterations);
  ImGui::InputInt("iterations, 0 = 8N", &iterations, 0);
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    wish.resolver.max_iterations = static_cast<std::uint32_t>(std::max(iterations, 0));
    changed = true;
  }
  changed |= slide("velocity eps [m/s]", &wish.resolver.velocity_epsilon, 1e-5f, 1);
  changed |= slide("position eps [m]", &wish.resolver.position_epsilon, 1e-5f, 1);
  changed |= slide("restitution from [m/s]", &wish.resolver.restitution_velocity, 1e-3f, 5);
  changed |= slide("sleep eps [m2/s2]", &wish.sleep.epsilon, 1e-4f, 5);
  changed |= ImGui::Checkbox("sleep", &wish.sleep.enabled);
  if (!changed) return;
  validate(wish);
  player_.set_settings(wish);
  message_.clear();
}

void SceneShow::show_counters() {
  const Moment& now = player_.shown();
  ImGui::Separator();
  const auto awake = std::count(now.awake.begin(), now.awake.end(), std::uint8_t{1});
  say(fmt::format("{} bodies, {} awake, {} contacts", now.states.size(), awake,
                  now.contacts.size()));
  say(now.solved_by.empty()
          ? fmt::format("spheres by {}, {} corrections", now.computed_by, now.iterations)
          : fmt::format("spheres by {}, solved by {}", now.computed_by, now.solved_by));
  if (!now.trouble.empty()) ImGui::TextColored(kWarning, "%s", now.trouble.c_str());
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
                     FLT_MAX, {170, 26});
  }
  int telling = static_cast<int>(colouring);
  if (ImGui::Combo("colours", &telling, kColouringNames,
                   static_cast<int>(std::size(kColouringNames)))) {
    colouring = static_cast<Colouring>(telling);
  }
  ImGui::Checkbox("contacts", &contacts);
  ImGui::SameLine();
  ImGui::Checkbox("forces", &forces);
}

void SceneShow::show_picked() {
  if (!picked_) return;
  const Moment& now = player_.shown();
  const BodyState& state = now.states[*picked_];
  ImGui::Separator();
  say(fmt::format("body {}{}", *picked_, now.awake[*picked_] != 0 ? "" : ", asleep"));
  say(fmt::format("at ({:.3f}, {:.3f}, {:.3f})", state.position.x, state.position.y,
                  state.position.z));
  say(fmt::format("{:.3f} m/s, {:.3f} rad/s", length(state.velocity),
                  length(state.angular_velocity)));
  if (!ImGui::BeginTable("contacts", 3, ImGuiTableFlags_RowBg | ImGuiTableFlags_ScrollY,
                         {0, 120})) {
    return;
  }
  for (const char* head : {"with", "depth [mm]", "normal"}) ImGui::TableSetupColumn(head);
  ImGui::TableHeadersRow();
  for (const Contact& contact : now.contacts) {
    if (contact.a != *picked_ && contact.b != *picked_) continue;
    const Vec3 n = contact.a == *picked_ ? contact.normal : -contact.normal;
    ImGui::TableNextColumn();
    say(fmt::format("{}", contact.a == *picked_ ? contact.b : contact.a));
    ImGui::TableNextColumn();
    say(fmt::format("{:.3f}", -contact.distance * 1000));
    ImGui::TableNextColumn();
    say(fmt::format("{:.2f} {:.2f} {:.2f}", n.x, n.y, n.z));
  }
  ImGui::EndTable();
}

}  // namespace jfpx::inline JFPX_ABI::view
