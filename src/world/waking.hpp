/// Who wakes whom along the contacts of a step.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Owns a buffer, which only grows.
class Waking {
 public:
  /// What touches an awake body wakes, and so on along the contacts; the surroundings, never awake,
  /// wake nobody (thesis 4.4.6, matchAwakeState). What a moving kinematic body carries, even at
  /// walking pace and by way of others, does not fall asleep: a sleeper has no velocity.
  void operator()(std::span<const Contact> contacts, BodyStore* bodies);

 private:
  std::vector<std::uint8_t> carried_;  ///< by body
};

}  // namespace JFPX_ABI
}  // namespace jfpx
