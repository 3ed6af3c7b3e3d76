/// A demo of the thesis in the window: its own keys, camera and text.
#pragma once

#include "src/demos/input_script.hpp"
#include "src/viewer/player.hpp"
#include "src/viewer/show.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Adds what a demo shows, between two of its pictures. Flattened shapes, which stood for shadows
/// in the thesis, are left out: the renderer throws real ones.
void draw_demo(const demos::View& from, const demos::View& to, Real share, Drawing* drawing);
/// A ball around a demo's solid things.
Bounds bounds_of(const demos::View& view);

class DemoShow final : public Show {
 public:
  explicit DemoShow(const ViewOptions& options);

  void step() override;
  void restart() override;
  void home() override;
  void draw(Renderer& renderer, const Target& target) override;
  void panel() override;
  std::vector<std::string> demo_keys() const override;
  void demo_key(const DemoKey& key) override;
  std::vector<KeyHelp> demo_help() const override;
  double dt() const override { return static_cast<double>(demo_->dt()); }
  std::uint64_t steps() const override { return report_.step; }
  double engine_ms() const override { return report_.total_ms; }
  Real body_size() const override { return 1; }
  std::string summary() const override;

  const demos::Demo& demo() const { return *demo_; }

 private:
  void follow();

  ViewOptions options_;
  std::unique_ptr<demos::Demo> demo_;
  std::optional<demos::ScriptPlayer> script_;
  std::vector<demos::Input> waiting_;  ///< what the user did since the last step
  demos::View before_, now_;
  StepReport report_;
  std::optional<Camera> followed_;  ///< the demo's own camera, while nobody moved it
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
