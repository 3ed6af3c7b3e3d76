/// Enqueued steps of a World on a device for which the host has not waited.
#pragma once

#include <jfpx/world.hpp>

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {

struct StepQueue {
  enum class State : std::uint8_t {
    empty,      ///< no step can be in progress
    open,       ///< captured graphs may have been launched, or steps are deferred
    launched,   ///< the device has enqueued steps
    finishing,  ///< World::Impl::finish_queue() is running
  };
  /// Const functions of the world read it concurrently.
  std::atomic<State> state{State::empty};
  std::uint64_t deferred_steps = 0;  ///< steps of the queue that the host must perform
  std::string failure;               ///< why the device cannot perform them; empty: no failure
  StepReport report;                 ///< of the last step of a queue
  std::recursive_mutex finishing;    ///< held by finish_queue(), whose steps call finish()
};

}  // namespace JFPX_ABI
}  // namespace jfpx
