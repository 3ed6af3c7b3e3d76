/// Viewer of a world on the GPU that draws its balls from device memory.
#pragma once

#include "src/viewer/scene_painter.hpp"
#include "src/viewer/viewer.hpp"
#include "src/viewer/world_spheres.hpp"

#include <functional>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {

/// Creation of the world of a DeviceViewer; tests replace it.
struct DeviceRun {
  std::function<World(const Scene&)> make_world;
  std::function<std::unique_ptr<ResidentSpheres>(World*, const std::vector<Ball>&)> make_spheres =
      make_world_spheres;
};

/// Steps and draws without copying states to the host. Has no history, no colours of properties, no
/// contacts and forces, and no interpolation between steps.
class DeviceViewer final : public Viewer {
 public:
  /// @param scene must satisfy suits(); its balls and immovable bodies are drawn
  DeviceViewer(ViewOptions options, const Scene& scene, DeviceRun run);

  /// Whether every body is a movable ball or immovable.
  static bool suits(const Scene& scene);

  void step() override;
  void restart() override;
  void home() override;
  void draw(Renderer& renderer, const Target& target) override;
  void panel() override;
  double dt() const override { return static_cast<double>(painter_.scene().dt); }
  std::uint64_t steps() const override { return report_.step; }
  double engine_ms() const override { return report_.total_ms; }
  Real body_size() const override { return painter_.body_size(); }
  std::string summary() const override;

 private:
  ViewOptions options_;
  DeviceRun run_;
  ScenePainter painter_;
  World world_;
  std::unique_ptr<ResidentSpheres> spheres_;
  Bounds bounds_;  ///< of the movable bodies at the last home()
  StepReport report_;
};

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
