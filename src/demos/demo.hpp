/// Demos: scenes with user controls, used by the command, the tests and the viewer.
#pragma once

#include <jfpx/world.hpp>

#include "src/demos/view.hpp"
#include "src/scenes/scenes.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace demos {

/// An action that the user can trigger.
struct Control {
  std::string_view name;     ///< the name in input scripts, for example "fire"
  std::string_view summary;  ///< one line for the user
  std::string_view key;      ///< key in the thesis: "w", "1", "mouse"
  bool repeats = false;      ///< acts in every step while it is down; otherwise once per press
};

/// A press or release of a control.
struct Input {
  std::size_t control = 0;  ///< index in controls()
  bool pressed = true;
};

/// Interface of a demo. The states depend only on the inputs of each step: equal inputs yield equal
/// bits. Not thread-safe.
class Demo {
 public:
  virtual ~Demo() = default;
  Demo(const Demo&) = delete;
  Demo& operator=(const Demo&) = delete;

  virtual std::string_view name() const = 0;
  virtual Real dt() const = 0;  ///< [s], length of a step
  std::span<const Control> controls() const { return controls_; }
  /// Advances the demo by one step with the inputs since the previous step. Inputs act in the given
  /// order (erratum E42); a control that is pressed and released within one step acts once.
  /// @throws InvalidArgument if an input has an invalid control; the demo is then unchanged (E42).
  ///   Also throws the exceptions of World::step().
  StepReport step(std::span<const Input> inputs = {});

  /// The moving objects, for hashes: bodies in the order of World::states(), or the rounds in
  /// flight.
  virtual std::vector<BodyState> states() const = 0;
  std::uint64_t state_hash() const { return jfpx::state_hash(states()); }
  /// Replaces the content of *view by the current state.
  virtual void draw(View* view) const = 0;
  /// The world of the demo's rigid bodies; null if the demo has none.
  virtual const World* world() const { return nullptr; }
  /// The initial scene of this world; null if the demo has none.
  virtual const Scene* scene() const { return nullptr; }

 protected:
  explicit Demo(std::span<const Control> controls) : controls_(controls), down_(controls.size()) {}

 private:
  /// Applies a control before the next step.
  virtual void act(std::size_t control) = 0;
  virtual StepReport advance() = 0;

  std::span<const Control> controls_;
  std::vector<bool> down_;
};

/// The index of a control in controls().
/// @throws InvalidArgument for an unknown name; the message lists the names.
std::size_t find_control(const Demo& demo, std::string_view name);

/// Parameters of a demo.
struct Options {
  scenes::Options scene = {};   ///< for demos that start from a named scene
  std::optional<Real> dt = {};  ///< [s], length of a step; the demo's default if absent
  WorldSettings world = {};
};

/// One row of the table of demos.
struct Entry {
  std::string_view name;
  std::string_view summary;  ///< one line for the user
  std::unique_ptr<Demo> (*make)(const Options&);
};

/// The demos of the thesis, and fountain, in a fixed order.
std::span<const Entry> all();

/// Creates the demo called `name`. The name of a scene is also valid.
/// @throws InvalidArgument for an unknown name or an invalid dt; the exceptions of World and
///   scenes::make()
std::unique_ptr<Demo> make(std::string_view name, const Options& options = {});
/// A demo of any scene. Its only control, "reset", restarts the scene.
std::unique_ptr<Demo> make(const Scene& scene, const WorldSettings& settings = {});

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
