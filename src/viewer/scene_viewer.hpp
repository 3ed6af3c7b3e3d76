/// Viewer of one run, with its panel.
#pragma once

#include "src/viewer/player.hpp"
#include "src/viewer/scene_painter.hpp"
#include "src/viewer/viewer.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

class SceneViewer final : public Viewer {
 public:
  explicit SceneViewer(const ViewOptions& options);

  void step() override;
  bool at_end() const override { return player_.at_end(); }
  void step_back() override;
  void restart() override;
  void home() override;
  void draw(Renderer& renderer, const Target& target) override;
  void panel() override;
  void pick(Real x, Real y, int width, int height) override;
  double dt() const override { return static_cast<double>(player_.scene().dt); }
  std::uint64_t steps() const override { return player_.shown().step; }
  double engine_ms() const override { return player_.shown().times.total; }
  Real body_size() const override { return painter_.body_size(); }
  bool has(Feature) const override { return true; }
  bool walks() const override;
  void save_recording(const std::string& path) const override { player_.save_recording(path); }
  void record_to(const std::string& path) override { player_.record_to(path); }
  void finish_recording() override { player_.finish_recording(); }
  std::string summary() const override;

  const Player& player() const { return player_; }
  View view() const;  ///< of the camera
  const std::optional<std::uint32_t>& picked() const { return picked_; }

 private:
  void fill_fields();
  void show_controls();
  void show_scene_choice();
  void show_engine_choice();
  void show_settings();
  bool show_resolver_settings();
  void show_counters();
  void show_picked();
  void show_body(std::uint32_t body);

  ViewOptions options_;
  Player player_;
  ScenePainter painter_;
  std::optional<std::uint32_t> picked_;
  // Contents of the panel's fields, which the user may be editing.
  std::uint64_t sphere_field_ = 0, seed_field_ = 0;
  RunSettings settings_field_;
  const RunSettings scene_settings_ = player_.settings();  ///< of the scene itself
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
