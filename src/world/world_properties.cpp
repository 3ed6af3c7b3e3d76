/// Properties of the bodies of a World that can be changed between two steps.
#include <jfpx/error.hpp>

#include "src/world/world_impl.hpp"

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

bool World::sensor(BodyId id) const { return impl_->bodies.sensor(impl_->bodies.require(id)); }

CollisionFilter World::filter(BodyId id) const {
  return impl_->bodies.filter(impl_->bodies.require(id));
}

void World::set_filter(BodyId id, const CollisionFilter& filter) {
  const std::uint32_t body = impl_->bodies.require(id);
  if (impl_->bodies.filter(body) == filter) return;
  impl_->bodies.set_filter(body, filter);
  impl_->wake_with_neighbors(id);
}

bool World::pair_ignored(BodyId a, BodyId b) const {
  return impl_->bodies.pair_ignored({impl_->bodies.require(a), impl_->bodies.require(b)});
}

void World::set_pair_ignored(BodyId a, BodyId b, bool ignored) {
  const BodyPair pair{impl_->bodies.require(a), impl_->bodies.require(b)};
  if (a == b) {
    throw InvalidArgument("pair is (" + std::to_string(a.index) + ", " + std::to_string(b.index) +
                          "); it must be of two different bodies");
  }
  if (impl_->bodies.pair_ignored(pair) == ignored) return;
  impl_->bodies.set_pair_ignored(pair, ignored);
  impl_->wake_with_neighbors(a);
  impl_->wake_with_neighbors(b);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
