/// Islands: movable bodies that hang together by contacts.
#include "src/viewer/islands.hpp"

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
    if (!(scene.bodies[contact.a].mass > 0) || !(scene.bodies[contact.b].mass > 0)) continue;
    const std::uint32_t a = root_of(parents, contact.a), b = root_of(parents, contact.b);
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

}  // namespace view
}  // namespace JFPX_ABI
}  // namespace jfpx
