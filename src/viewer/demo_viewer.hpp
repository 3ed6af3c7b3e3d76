/// Viewer of a demo of the thesis, with the demo's keys, camera and text.
#pragma once

#include "src/demos/input_script.hpp"
#include "src/viewer/bounds.hpp"
#include "src/viewer/viewer.hpp"

#include <optional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Adds the items of a demo, interpolated between two of its pictures. Omits flattened shapes,
/// which are shadows in the thesis, because the renderer computes shadows.
void draw_demo(const demos::View& from, const demos::View& to, Real share, Drawing* drawing);
/// Bounding sphere of the items of a demo.
Bounds bounds_of(const demos::View& view);

class DemoViewer final : public Viewer {
 public:
  explicit DemoViewer(const ViewOptions& options);

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
  void follow_camera();

  ViewOptions options_;
  std::unique_ptr<demos::Demo> demo_;
  std::optional<demos::ScriptPlayer> script_;
  std::vector<demos::Input> waiting_;  ///< inputs since the last step
  demos::View before_, now_;
  StepReport report_;
  std::optional<Camera> followed_;  ///< the demo's camera, until the user moves it
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
