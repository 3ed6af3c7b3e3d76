/// The forces of a world, in the order in which they came.
#pragma once

#include <jfpx/force.hpp>

#include <functional>
#include <vector>

namespace jfpx::inline JFPX_ABI {

/// Sums of floating-point numbers depend on their order: forces act in the order of their ids.
class ForceRegistry {
 public:
  using Function = std::function<void(ForceContext&)>;

  ForceId add(Function force);
  /// @throws InvalidArgument if the id is not of a force that is here
  void remove(ForceId id);
  Function& at(ForceId id);
  const std::vector<ForceId>& ids() const noexcept { return ids_; }

  void apply(ForceContext& context) const;

 private:
  std::size_t place_of(ForceId id) const;

  std::uint64_t next_ = 0;
  std::vector<ForceId> ids_;  ///< rising
  std::vector<Function> forces_;
};

}  // namespace jfpx::inline JFPX_ABI
