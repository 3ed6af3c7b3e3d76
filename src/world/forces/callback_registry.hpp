/// Callbacks of a world that run in every step: forces and contact generators.
#pragma once

#include <jfpx/contact_generator.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>

#include "src/base/reserve.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Calls the callbacks in the order of their addition, which is the order of the ids. The order
/// affects floating-point sums and the choice among equal contacts.
template <class Context, class Id>
class CallbackRegistry {
 public:
  using Function = std::function<void(Context&)>;

  /// @param kind noun for error messages
  explicit CallbackRegistry(const char* kind) : kind_(kind) {}

  Id add(Function function) {
    reserve_geometric(&ids_, ids_.size() + 1);
    functions_.push_back(std::make_unique<Function>(std::move(function)));
    ids_.push_back({next_});
    return {next_++};
  }
  /// @throws InvalidArgument if the id is unknown, as does at()
  void remove(Id id) {
    const auto position = static_cast<std::ptrdiff_t>(position_of(id));
    ids_.erase(ids_.begin() + position);
    functions_.erase(functions_.begin() + position);
  }
  /// The address is valid until the callback is removed.
  Function& at(Id id) { return *functions_[position_of(id)]; }
  /// Null if there is none.
  Function* find(Id id) const noexcept {
    const std::size_t position = lower_bound(id);
    return position < ids_.size() && ids_[position] == id ? functions_[position].get() : nullptr;
  }
  const std::vector<Id>& ids() const noexcept { return ids_; }
  bool empty() const noexcept { return ids_.empty(); }
  /// The number of the next id.
  std::uint64_t next() const noexcept { return next_; }
  /// Replaces ids and callbacks. A null callback keeps the current one with that id and its
  /// address.
  /// @param ids ascending and below `next`
  void replace(std::vector<Id> ids, std::vector<std::unique_ptr<Function>> functions,
               std::uint64_t next) noexcept {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (functions[i] == nullptr) functions[i] = std::move(functions_[lower_bound(ids[i])]);
    }
    ids_ = std::move(ids);
    functions_ = std::move(functions);
    next_ = next;
  }

  void call(Context& context) const {
    for (const auto& function : functions_) (*function)(context);
  }

 private:
  /// Number of the ids below this one.
  std::size_t lower_bound(Id id) const noexcept {
    return static_cast<std::size_t>(std::ranges::lower_bound(ids_, id.number, {}, &Id::number) -
                                    ids_.begin());
  }
  std::size_t position_of(Id id) const {
    const std::size_t position = lower_bound(id);
    if (position < ids_.size() && ids_[position] == id) return position;
    throw InvalidArgument(kind_ + (' ' + std::to_string(id.number)) +
                          " is unknown; it must be one of this world that was not removed");
  }

  const char* kind_;
  std::uint64_t next_ = 0;
  std::vector<Id> ids_;  ///< ascending
  std::vector<std::unique_ptr<Function>> functions_;
};

using ForceRegistry = CallbackRegistry<ForceContext, ForceId>;
using GeneratorRegistry = CallbackRegistry<ContactContext, ContactGeneratorId>;

}  // namespace JFPX_ABI
}  // namespace jfpx
