/// Colours that show a property of each body.
#include "src/viewer/colouring.hpp"

#include "src/viewer/colours.hpp"

#include <algorithm>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace view {
namespace {

constexpr Paint kAlone{150, 154, 160};

std::uint32_t root_of(std::vector<std::uint32_t>& parents, std::uint32_t body) {
  while (parents[body] != body) {
    parents[body] = parents[parents[body]];
    body = parents[body];
  }
  return body;
}

}  // namespace

std::vector<std::uint32_t> islands_of(const Scene& scene, std::span<const Contact> contacts) {
  std::vector<std::uint32_t> parents(scene.bodies.size());
  std::iota(parents.begin(), parents.end(), 0u);
  for (const Contact& contact : contacts) {
    const std::uint32_t first = contact.a.index, second = contact.b.index;
    if (!(scene.bodies[first].mass > 0) || !(scene.bodies[second].mass > 0)) continue;
    const std::uint32_t a = root_of(parents, first), b = root_of(parents, second);
    parents[std::max(a, b)] = std::min(a, b);
  }
  for (std::uint32_t i = 0; i < parents.size(); ++i) parents[i] = root_of(parents, i);
  return parents;
}

std::vector<Paint> island_paints(const Scene& scene, std::span<const Contact> contacts) {
  const std::vector<std::uint32_t> islands = islands_of(scene, contacts);
  std::vector<std::uint32_t> sizes(islands.size());
  for (const std::uint32_t island : islands) ++sizes[island];
  std::vector<Paint> paints;
  paints.reserve(islands.size());
  for (const std::uint32_t island : islands) {
    paints.push_back(sizes[island] > 1 ? hue_paint(island) : kAlone);
  }
  return paints;
}

std::vector<Real> colour_values(const Scene& scene, const RunState& run_state,
                                Colouring colouring) {
  if (colouring == Colouring::bodies || colouring == Colouring::islands) return {};
  std::vector<Real> values(scene.bodies.size());
  if (colouring == Colouring::speed) {
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = length(run_state.states[i].velocity);
  }
  if (colouring == Colouring::sleep) {
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = run_state.awake[i];
    return values;
  }
  for (const Contact& contact : run_state.contacts) {
    for (const std::uint32_t body : {contact.a.index, contact.b.index}) {
      Real& value = values[body];
      if (colouring == Colouring::penetration) value = std::max(value, -contact.distance);
      if (colouring == Colouring::contacts) value += 1;
    }
  }
  Real largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (scene.bodies[i].mass > 0) largest = std::max(largest, values[i]);
  }
  if (largest > 0) {
    for (Real& value : values) value /= largest;
  }
  return values;
}

std::vector<Paint> body_paints(const Scene& scene, const RunState& run_state, Colouring colouring) {
  if (colouring == Colouring::islands) return island_paints(scene, run_state.contacts);
  std::vector<Paint> paints;
  for (const Real value : colour_values(scene, run_state, colouring)) {
    paints.push_back(scale_paint(value));
  }
  return paints;
}

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
