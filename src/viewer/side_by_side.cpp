/// Viewer of native jfpx, stock Bullet and Bullet with jfpx in lockstep, with marked differences.
#include <jfpx/bullet/scene_world.hpp>
#include <jfpx/bullet/verify.hpp>

#include "src/viewer/bullet_run.hpp"
#include "src/viewer/comparison.hpp"
#include "src/viewer/framing.hpp"
#include "src/viewer/scene_painter.hpp"
#include "src/viewer/timing.hpp"
#include "src/viewer/viewer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <imgui.h>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

enum Column : std::size_t { kNative, kStock, kJfpx, kColumns };
constexpr std::array<const char*, kColumns> kTitles = {"native jfpx", "stock Bullet",
                                                       "Bullet with jfpx"};
/// Colours of the paths of native jfpx and of Bullet; both Bullet columns have the same colour.
constexpr std::array<Paint, 2> kTrails = {{{255, 170, 40}, {90, 190, 255}}};
constexpr std::size_t kTraced = 6;     // number of bodies with drawn paths
constexpr std::size_t kTrail = 240;    // steps of a path
constexpr std::size_t kPlotted = 600;  // steps of a plot
constexpr std::size_t kTimed = 60;     // steps of the displayed median time
constexpr float kWideColumn = 260;     // smallest width for large titles [units]
constexpr float kStrip = 0.26f;        // fraction of the height below the pictures

bullet::SceneWorld make_stock_world(const Scene& scene) {
  return bullet::SceneWorld(scene, {.dispatcher = bullet::DispatcherKind::stock,
                                    .solver = bullet::SolverKind::stock,
                                    .world = bullet::WorldKind::stock});
}

bullet::SceneWorld make_jfpx_world(const Scene& scene, const EngineChoice& choice) {
  bullet::SceneWorldOptions world = world_options(choice);
  if (!choice.jfpx_solver) world.solver = bullet::SolverKind::stock;
  if (!choice.jfpx_world) world.world = bullet::WorldKind::stock;
  // The default is 0, because small scenes would compare Bullet's code with itself.
  world.dispatch.minimum_batch = world.solve.minimum_batch = choice.minimum_batch;
  return bullet::SceneWorld(scene, world);
}

/// The three engines in lockstep, and the differences between them.
struct Trio {
  std::unique_ptr<Run> native;
  bullet::SceneWorld stock, jfpx;
  bullet::ContactCheck check;
  std::array<RunState, kColumns> before, now;
  std::vector<Contact> different;  ///< contacts of the last step in only one Bullet world
  std::uint64_t differences = 0;   ///< of all steps
  std::string first_difference;
  std::array<std::vector<float>, kColumns> energies;
  std::array<std::deque<double>, kColumns> times;  ///< of the last steps [ms]
  std::vector<float> drifts;

  Trio(const Scene& scene, const ViewOptions& options)
      : native(
            make_run(scene, {EngineKind::native, options.choice.backend, options.choice.threads})),
        stock(make_stock_world(scene)),
        jfpx(make_jfpx_world(scene, options.choice)) {
    record(0);
    before = now;
  }

  void step() {
    const std::uint64_t step = now[kNative].step + 1;
    before = std::move(now);
    native->step();
    check.capture(stock.world());
    stock.step();
    check.compare(stock.world(), step);
    jfpx.step();
    record(step);
    different = different_contacts(now[kStock].contacts, now[kJfpx].contacts);
    differences += different.size();
    if (!first_difference.empty()) return;  // all later differences follow from the first
    const auto difference = bullet::first_difference(stock.world(), jfpx.world(), step);
    if (difference) first_difference = to_text(*difference);
  }

 private:
  void record(std::uint64_t step) {
    now = {native->run_state(), run_state_of(stock, step), run_state_of(jfpx, step)};
    const Scene& scene = stock.scene();
    for (std::size_t i = 0; i < kColumns; ++i) {
      now[i].dt = scene.dt;
      energies[i].push_back(static_cast<float>(energy(scene, now[i].states)));
      times[i].push_back(now[i].times.total);
      if (times[i].size() > kTimed) times[i].pop_front();
    }
    drifts.push_back(static_cast<float>(drift(scene, now[kNative].states, now[kStock].states)));
  }
};

class SideBySide final : public Viewer {
 public:
  explicit SideBySide(const ViewOptions& options)
      : options_(options),
        scene_(tool::load(options.run)),
        painter_(scene_),
        trio_(std::make_unique<Trio>(scene_, options)) {
    colouring = options.colouring;
    contacts = options.contacts;
    forces = options.forces;
    home();
  }

  void step() override {
    trio_->step();
    check(same());
    trace();
  }
  void restart() override {
    trio_ = std::make_unique<Trio>(scene_, options_);
    clock_.settle();
    for (auto& trail : trails_) trail.clear();
  }
  void home() override {
    ViewOptions column = options_;
    column.size.width = std::max(options_.size.width / 3, 1);
    column.size.height =
        std::max(static_cast<int>(static_cast<float>(options_.size.height) * (1 - kStrip)), 1);
    camera = initial_camera(column, scene_, trio_->now[kNative]);
  }
  void draw(Renderer& renderer, const Target& target) override;

  bool has(Feature feature) const override {
    return feature == Feature::none || feature == Feature::colouring;
  }
  double dt() const override { return static_cast<double>(scene_.dt); }
  std::uint64_t steps() const override { return trio_->now[kNative].step; }
  double engine_ms() const override {
    double sum = 0;
    for (const RunState& run_state : trio_->now) sum += run_state.times.total;
    return sum;
  }
  Real body_size() const override { return painter_.body_size(); }
  std::string summary() const override;

 private:
  bool same() const {
    return trio_->differences == 0 && trio_->first_difference.empty() &&
           trio_->check.mismatches() == 0;
  }
  std::string findings() const;
  void trace();
  void draw_trails(Drawing* drawing) const;
  void draw_texts(const Target& target, int top_height) const;
  void draw_plots(const Target& target, int top_height) const;

  ViewOptions options_;
  Scene scene_;
  ScenePainter painter_;
  std::unique_ptr<Trio> trio_;
  std::array<std::deque<std::vector<Vec3>>, kTrails.size()> trails_;
};

void SideBySide::trace() {
  for (const std::size_t column : {kNative, kStock}) {
    std::vector<Vec3> places;
    const std::size_t stride = std::max<std::size_t>(scene_.bodies.size() / kTraced, 1);
    for (std::size_t i = 0; i < scene_.bodies.size(); i += stride) {
      if (scene_.bodies[i].mass > 0) places.push_back(trio_->now[column].states[i].position);
    }
    trails_[column].push_back(std::move(places));
    if (trails_[column].size() > kTrail) trails_[column].pop_front();
  }
}

void SideBySide::draw_trails(Drawing* drawing) const {
  for (const std::size_t column : {kNative, kStock}) {
    const auto& trail = trails_[column];
    for (std::size_t i = 1; i < trail.size(); ++i) {
      const auto alpha = static_cast<std::uint8_t>(60 + 195 * i / trail.size());
      for (std::size_t k = 0; k < trail[i].size(); ++k) {
        drawing->add_line(trail[i - 1][k], trail[i][k], kTrails[column], 2.0f, alpha);
      }
    }
  }
}

void SideBySide::draw(Renderer& renderer, const Target& target) {
  options_.size = {target.width, target.height};  // for home()
  const int strip = static_cast<int>(static_cast<float>(target.height) * kStrip);
  const int top_height = target.height - strip;
  const Bounds bounds = painter_.bounds(trio_->now[kNative].states);
  const View view = camera.view(bounds.centre, bounds.radius);
  for (std::size_t column = 0; column < kColumns; ++column) {
    Drawing drawing(view.eye);
    const RunState& now = trio_->now[column];
    painter_.draw(trio_->before[column], now, share(), colouring, &drawing);
    if (contacts) painter_.draw_contacts(now.contacts, false, &drawing);
    if (forces) painter_.draw_forces(trio_->before[column], now, &drawing);
    if (column != kNative) painter_.draw_contacts(trio_->different, true, &drawing);
    draw_trails(&drawing);
    // Equal widths, because the renderer recreates its buffers when the size changes. Columns may
    // overlap by a pixel.
    const int width = (target.width + 2) / 3;
    const int left = (target.width - width) * static_cast<int>(column) / 2;
    renderer.draw(drawing, view, {left, strip, width, top_height, target.unit}, target.framebuffer);
  }
  draw_texts(target, top_height);
  draw_plots(target, top_height);
}

void SideBySide::draw_texts(const Target& target, int top_height) const {
  constexpr float kMargin = 10;
  const ImU32 dark = IM_COL32(12, 16, 22, 200);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const float width = ImGui::GetIO().DisplaySize.x / 3;
  const float line = ImGui::GetTextLineHeightWithSpacing();
  const float title = ImGui::GetFontSize() * (width > kWideColumn ? 2 : 1);
  for (std::size_t column = 0; column < kColumns; ++column) {
    const float left = width * static_cast<float>(column);
    const auto& times = trio_->times[column];
    const std::string count =
        fmt::format("{} contacts, {:.2f} ms a step", trio_->now[column].contacts.size(),
                    median({times.begin(), times.end()}));
    list->AddRectFilled({left, 0}, {left + width, title + line + 13}, dark);
    list->AddText(ImGui::GetFont(), title, {left + kMargin, 6}, IM_COL32_WHITE, kTitles[column]);
    list->AddText({left + kMargin, 11 + title}, IM_COL32(200, 212, 226, 255), count.c_str());
    if (column == 0) continue;
    list->AddLine({left, 0}, {left, static_cast<float>(top_height) / target.unit}, dark, 3);
  }
}

void SideBySide::draw_plots(const Target& target, int top_height) const {
  const float top = static_cast<float>(top_height) / target.unit;
  ImGui::SetNextWindowPos({0, top});
  ImGui::SetNextWindowSize({ImGui::GetIO().DisplaySize.x, ImGui::GetIO().DisplaySize.y - top});
  ImGui::PushStyleVar(ImGuiStyleVar_WindowRounding, 0);
  ImGui::Begin("differences", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoBringToFrontOnFocus | ImGuiWindowFlags_NoNav);
  const ImVec4 verdict = same() ? ImVec4{0.45f, 0.95f, 0.55f, 1} : ImVec4{1, 0.2f, 0.15f, 1};
  ImGui::TextColored(verdict, "%s", findings().c_str());
  const float height =
      std::max(ImGui::GetContentRegionAvail().y - ImGui::GetFrameHeightWithSpacing(), 1.0f);
  const float width = (ImGui::GetContentRegionAvail().x - 16) / 3;
  const auto plot = [&](const char* id, const std::vector<float>& values, const std::string& text) {
    const std::size_t first = values.size() > kPlotted ? values.size() - kPlotted : 0;
    ImGui::BeginGroup();
    ImGui::AlignTextToFramePadding();  // aligns the first text with later texts
    ImGui::TextUnformatted(text.c_str());
    ImGui::PlotLines(id, values.data() + first, static_cast<int>(values.size() - first), 0, nullptr,
                     FLT_MAX, FLT_MAX, {width, height});
    ImGui::EndGroup();
  };
  const auto& e = trio_->energies;
  plot("##native", e[kNative], fmt::format("energy, native: {:.4g} J", e[kNative].back()));
  ImGui::SameLine();
  plot("##bullet", e[kJfpx], fmt::format("energy, Bullet: {:.4g} J", e[kJfpx].back()));
  ImGui::SameLine();
  plot("##drift", trio_->drifts,
       fmt::format("mean distance native to Bullet: {:.4g} m", trio_->drifts.back()));
  ImGui::End();
  ImGui::PopStyleVar();
}

std::string SideBySide::findings() const {
  const std::string& first = trio_->first_difference;
  return fmt::format(
      "{} different contacts between stock Bullet and Bullet with jfpx, worlds {}; "
      "{} contacts checked, {} mismatches",
      trio_->differences, first.empty() ? "identical" : first, trio_->check.compared(),
      trio_->check.mismatches());
}

std::string SideBySide::summary() const {
  return fmt::format("{}: step {}, {}; native is {:.4g} m away on average", scene_.name, steps(),
                     findings(), trio_->drifts.back());
}

}  // namespace

std::unique_ptr<Viewer> make_side_by_side(const ViewOptions& options) {
  return std::make_unique<SideBySide>(options);
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
