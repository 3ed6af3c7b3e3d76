/// Forces come, act and go.
#include "src/force_registry.hpp"

#include <jfpx/error.hpp>

#include <algorithm>
#include <string>
#include <utility>

namespace jfpx::inline JFPX_ABI {

ForceId ForceRegistry::add(Function force) {
  ids_.reserve(ids_.size() + 1);
  forces_.push_back(std::move(force));
  ids_.push_back({next_});
  return {next_++};
}

void ForceRegistry::remove(ForceId id) {
  const auto place = static_cast<std::ptrdiff_t>(place_of(id));
  ids_.erase(ids_.begin() + place);
  forces_.erase(forces_.begin() + place);
}

ForceRegistry::Function& ForceRegistry::at(ForceId id) { return forces_[place_of(id)]; }

void ForceRegistry::apply(ForceContext& context) const {
  for (const Function& force : forces_) force(context);
}

std::size_t ForceRegistry::place_of(ForceId id) const {
  const auto place = std::ranges::lower_bound(ids_, id.number, {}, &ForceId::number);
  if (place != ids_.end() && *place == id) return static_cast<std::size_t>(place - ids_.begin());
  throw InvalidArgument("force " + std::to_string(id.number) +
                        " is unknown; it must be one of this world that was not removed");
}

}  // namespace jfpx::inline JFPX_ABI
