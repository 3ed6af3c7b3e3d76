/// What users add to a world to be called in every step: forces, contact generators.
#pragma once

#include <jfpx/error.hpp>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Calls in the order in which they came, which is that of the ids: sums of floating-point numbers
/// depend on their order, and so does the choice among equal contacts.
template <class Context, class Id>
class Registry {
 public:
  using Function = std::function<void(Context&)>;

  /// @param kind what the functions are, for messages
  explicit Registry(const char* kind) : kind_(kind) {}

  Id add(Function function) {
    ids_.reserve(ids_.size() + 1);
    functions_.push_back(std::make_unique<Function>(std::move(function)));
    ids_.push_back({next_});
    return {next_++};
  }
  /// @throws InvalidArgument if the id is not of a function that is here; at() likewise
  void remove(Id id) {
    const auto place = static_cast<std::ptrdiff_t>(place_of(id));
    ids_.erase(ids_.begin() + place);
    functions_.erase(functions_.begin() + place);
  }
  /// Stays where it is until it is removed.
  Function& at(Id id) { return *functions_[place_of(id)]; }
  const std::vector<Id>& ids() const noexcept { return ids_; }
  bool empty() const noexcept { return ids_.empty(); }

  void call(Context& context) const {
    for (const auto& function : functions_) (*function)(context);
  }

 private:
  std::size_t place_of(Id id) const {
    const auto place = std::ranges::lower_bound(ids_, id.number, {}, &Id::number);
    if (place != ids_.end() && *place == id) return static_cast<std::size_t>(place - ids_.begin());
    throw InvalidArgument(kind_ + (' ' + std::to_string(id.number)) +
                          " is unknown; it must be one of this world that was not removed");
  }

  const char* kind_;
  std::uint64_t next_ = 0;
  std::vector<Id> ids_;  ///< rising
  std::vector<std::unique_ptr<Function>> functions_;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
