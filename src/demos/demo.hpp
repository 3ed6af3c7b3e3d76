/// A demo: a scene with controls, stepped with inputs, the same for command, tests and viewer.
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

/// Something that a user can do.
struct Control {
  std::string_view name;     ///< "fire": what input scripts call it
  std::string_view summary;  ///< one line for a user
  std::string_view key;      ///< of the thesis: "w", "1", "mouse"
  bool repeats = false;      ///< acts in every step while it is down; else once a press
};

/// A control goes down or comes up.
struct Input {
  std::size_t control = 0;  ///< place in controls()
  bool pressed = true;
};

/// One demo. Equal inputs in equal steps give equal bits: nothing else decides, no clock either.
/// One owner.
class Demo {
 public:
  virtual ~Demo() = default;
  Demo(const Demo&) = delete;
  Demo& operator=(const Demo&) = delete;

  virtual std::string_view name() const = 0;
  virtual Real dt() const = 0;  ///< [s], length of a step
  std::span<const Control> controls() const { return controls_; }
  /// One step, with what happened since the last. Inputs act in the order given (erratum E42); a
  /// control that is pressed and released within one step still acts once.
  /// @throws InvalidArgument for an input of no control, which changes nothing (E42); as
  ///   World::step().
  StepReport step(std::span<const Input> inputs = {});

  /// What moves, for hashes: bodies in the order of World::states(), or the living rounds.
  virtual std::vector<BodyState> states() const = 0;
  std::uint64_t state_hash() const { return jfpx::state_hash(states()); }
  /// Replaces the content of *view by what is to be drawn now.
  virtual void draw(View* view) const = 0;
  /// The rigid bodies of the demo; null where there are none.
  virtual const World* world() const { return nullptr; }

 protected:
  explicit Demo(std::span<const Control> controls) : controls_(controls), down_(controls.size()) {}

 private:
  /// The control acts in the coming step.
  virtual void act(std::size_t control) = 0;
  virtual StepReport advance() = 0;

  std::span<const Control> controls_;
  std::vector<bool> down_;
};

/// The place of a control in controls(). @throws InvalidArgument listing the names.
std::size_t find_control(const Demo& demo, std::string_view name);

struct Options {
  scenes::Options scene = {};   ///< for demos that are a named scene
  std::optional<Real> dt = {};  ///< [s]; the demo's own if absent
  WorldSettings world = {};
};

struct Entry {
  std::string_view name;
  std::string_view summary;  ///< one line for a user
  std::unique_ptr<Demo> (*make)(const Options&);
};

/// The demos of the thesis, in a fixed order.
std::span<const Entry> all();

/// The demo called `name`; a named scene without controls of its own is one too.
/// @throws InvalidArgument for an unknown name or a bad dt; as World and scenes::make().
std::unique_ptr<Demo> make(std::string_view name, const Options& options = {});
/// Any scene as a demo: its one control starts it again.
std::unique_ptr<Demo> make(const Scene& scene, const WorldSettings& settings = {});

}  // namespace demos
}  // namespace JFPX_ABI
}  // namespace jfpx
