/// Propagation of waking through bodies in contact.
#pragma once

#include <jfpx/world.hpp>

#include "src/world/bodies/body_store.hpp"

namespace jfpx {
inline namespace JFPX_ABI {

/// Function object that owns its buffer, which grows and never shrinks.
class WakePropagation {
 public:
  /// Wakes every movable body in contact with an awake body, transitively (thesis 4.4.6,
  /// matchAwakeState). Immovable bodies are never awake and do not propagate waking. Bodies in
  /// contact with a moving kinematic body, directly or through other movable bodies, stay awake at
  /// any speed, because a sleeping body would not be carried.
  void operator()(std::span<const Contact> contacts, BodyStore* bodies);

 private:
  std::vector<std::uint8_t> carried_;  ///< by body: 1 if kept awake by a moving kinematic body
};

}  // namespace JFPX_ABI
}  // namespace jfpx
