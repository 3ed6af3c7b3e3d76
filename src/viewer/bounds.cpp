/// Bounding sphere of the bodies of a scene, without outliers.
#include "src/viewer/bounds.hpp"

#include "src/scene/compound.hpp"
#include "src/viewer/shapes.hpp"

#include <algorithm>
#include <cmath>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr std::size_t kSampled = 4000;

struct Spread {
  Real low, high;
};
/// The range of the values, excluding 2 % at each end. Reorders the values.
Spread spread(std::vector<Real>& values) {
  const std::size_t left_out = values.size() / 50;
  const auto low = values.begin() + static_cast<std::ptrdiff_t>(left_out);
  const auto high = values.end() - 1 - static_cast<std::ptrdiff_t>(left_out);
  std::nth_element(values.begin(), low, values.end());
  const Real lowest = *low;
  std::nth_element(values.begin(), high, values.end());
  return {lowest, *high};
}

}  // namespace

BoundsEstimator::BoundsEstimator(const Scene& scene) {
  const std::size_t stride = std::max(scene.bodies.size() / kSampled, std::size_t{1});
  for (const bool wanted : {true, false}) {
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
      const BodyDef& body = scene.bodies[i];
      if ((body.mass > 0) != wanted || is_wall(body.shape)) continue;
      largest_ = std::max(largest_, reach_of(body.shape));
      if (i % stride == 0) {
        samples_.push_back({static_cast<std::uint32_t>(i), middle_of(body.shape)});
      }
    }
    if (!samples_.empty()) break;
  }
}

Bounds BoundsEstimator::bounds(const std::vector<BodyState>& states) const {
  constexpr Bounds kNothing{{0, 1, 0}, 4};
  if (samples_.empty()) return kNothing;
  Vec3 low, high;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<Real> along;
    along.reserve(samples_.size());
    for (const Sample& sample : samples_) {
      const BodyState& state = states[sample.body];
      const bool is_shifted = sample.middle != Vec3{};
      const Vec3 middle = is_shifted ? to_world_point(state, sample.middle) : state.position;
      const Real place = middle[axis];
      if (std::isfinite(place)) along.push_back(place);  // NaN has no order
    }
    if (along.empty()) return kNothing;
    const Spread s = spread(along);
    low[axis] = s.low;
    high[axis] = s.high;
  }
  const Vec3 half = (high - low) * Real(0.5);
  return {(low + high) * Real(0.5), length(half) + largest_, half};
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
