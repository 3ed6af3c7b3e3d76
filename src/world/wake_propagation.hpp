/// Propagation of waking through the islands of a step.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Owns a buffer, which grows and never shrinks.
class WakePropagation {
 public:
  /// Wakes every body in contact with an awake body, transitively; immovable bodies are never awake
  /// and wake no body (thesis 4.4.6, matchAwakeState). A body that a moving kinematic body carries,
  /// directly or through others and at any speed, stays awake, because a sleeping body has no
  /// velocity.
  void operator()(std::span<const Contact> contacts, BodyStore* bodies);

 private:
  std::vector<std::uint8_t> carried_;  ///< by body
};

}  // namespace JFPX_ABI
}  // namespace jfpx
