/// Ids and materials of the bodies of an earlier step, for its contact lists.
#pragma once

#include "src/world/bodies/body_store.hpp"

#include <cstdint>
#include <unordered_map>

namespace jfpx {
inline namespace JFPX_ABI {

/// Properties of a body that World::contacts() and World::contact_events() report.
struct ListedBody {
  BodyId id;
  Real radius = 0, friction = 0, restitution = 0;
  bool sensor = false;
};
/// By BodyId::index.
using ListedBodies = std::unordered_map<std::uint32_t, ListedBody>;

inline ListedBody listed(const BodyStore& store, std::uint32_t body) {
  return {store.id(body), store.radius(body), store.friction(body), store.restitution(body),
          store.sensor(body)};
}

/// The bodies of an earlier step, some of which may have changed or been removed since.
class BodiesOfStep {
 public:
  /// @param changed the former values of changed and removed bodies; null: no body has changed
  explicit BodiesOfStep(const BodyStore& store, const ListedBodies* changed = nullptr)
      : store_(store), changed_(changed) {}

  ListedBody operator[](std::uint32_t body) const {
    const ListedBody* changed = find_changed(body);
    return changed != nullptr ? *changed : listed(store_, body);
  }

 private:
  const ListedBody* find_changed(std::uint32_t body) const {
    if (changed_ == nullptr || changed_->empty()) return nullptr;
    const auto found = changed_->find(body);
    return found != changed_->end() ? &found->second : nullptr;
  }

  const BodyStore& store_;
  const ListedBodies* changed_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
