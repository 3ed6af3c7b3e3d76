/// Forces on bodies, drawn as arrows.
#include "src/viewer/forces.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Paint kForce{90, 225, 255};
constexpr Real kLongest = 5;            // [units]
constexpr Real kLeast = Real(0.01);     // relative to the reference
constexpr Real kHeadShare = Real(0.3);  // relative to the length of the arrow

/// The median weight; 0 if most bodies have none.
Real typical_weight(const Scene& scene) {
  std::vector<Real> weights;
  for (const BodyDef& body : scene.bodies) {
    if (body.mass > 0) weights.push_back(body.mass * length(body.acceleration));
  }
  if (weights.empty()) return 0;
  const auto middle = weights.begin() + static_cast<std::ptrdiff_t>(weights.size() / 2);
  std::nth_element(weights.begin(), middle, weights.end());
  return *middle;
}

}  // namespace

void draw_arrow(const Vec3& from, const Vec3& way, Drawing* drawing) {
  const Vec3 tip = from + way;
  const Vec3 across = cross(way, tip - drawing->eye());  // turns the head towards the eye
  const Real width = length(across);
  drawing->add_line(from, tip, kForce, 3);
  if (!(width > 0)) return;
  const Vec3 side = across * (length(way) * kHeadShare / 2 / width);
  const Vec3 neck = tip - way * kHeadShare;
  drawing->add_line(tip, neck + side, kForce, 3);
  drawing->add_line(tip, neck - side, kForce, 3);
}

std::vector<Vec3> forces_between(const Scene& scene, const RunState& before, const RunState& now) {
  std::vector<Vec3> forces(scene.bodies.size());
  if (before.step == now.step) return forces;
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const BodyDef& body = scene.bodies[i];
    if (!(body.mass > 0)) continue;
    const Vec3 change = now.states[i].velocity - before.states[i].velocity;
    forces[i] = (change * (1 / now.dt) - body.acceleration) * body.mass;
  }
  return forces;
}

void draw_forces(const Scene& scene, const RunState& before, const RunState& now, Real unit,
                 Drawing* drawing) {
  const std::vector<Vec3> forces = forces_between(scene, before, now);
  Real reference = typical_weight(scene);
  if (!(reference > 0)) {
    for (const Vec3& force : forces) reference = std::max(reference, length(force));
  }
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const Real strength = length(forces[i]);
    if (!(strength > kLeast * reference)) continue;
    const Real reach = std::min(square_root(strength / reference), kLongest) * unit;
    draw_arrow(now.states[i].position, forces[i] * (reach / strength), drawing);
  }
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
