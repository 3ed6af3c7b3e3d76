/// Bodies as the contacts of an earlier step show them.
#pragma once

#include "src/world/body_store.hpp"

#include <cstdint>
#include <unordered_map>

namespace jfpx {
inline namespace JFPX_ABI {

/// What World::contacts() and World::contact_events() show of a body.
struct ListedBody {
  BodyId id;
  Real radius = 0, friction = 0, restitution = 0;
  bool sensor = false;
};
/// By BodyId::index.
using RemovedBodies = std::unordered_map<std::uint32_t, ListedBody>;

inline ListedBody listed(const BodyStore& store, std::uint32_t body) {
  return {store.id(body), store.radius(body), store.friction(body), store.restitution(body),
          store.sensor(body)};
}

/// The bodies that a step had, of which some may have been removed since.
class BodiesOfStep {
 public:
  /// @param removed the bodies that were removed since the step; null: none
  explicit BodiesOfStep(const BodyStore& store, const RemovedBodies* removed = nullptr)
      : store_(store), removed_(removed) {}

  ListedBody operator[](std::uint32_t body) const {
    const ListedBody* removed = find_removed(body);
    return removed != nullptr ? *removed : listed(store_, body);
  }

 private:
  const ListedBody* find_removed(std::uint32_t body) const {
    if (removed_ == nullptr || removed_->empty()) return nullptr;
    const auto found = removed_->find(body);
    return found != removed_->end() ? &found->second : nullptr;
  }

  const BodyStore& store_;
  const RemovedBodies* removed_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
