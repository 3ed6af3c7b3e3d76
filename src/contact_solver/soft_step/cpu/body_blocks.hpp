/// The blocks of a step on the CPU.
#pragma once

#include "src/base/parallel_for.hpp"
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/contact_solver/soft_step/step_constants.hpp"

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// The movable bodies of a step by block: the blocks with at least one of the bodies, in their
/// order. Bodies without a place follow in blocks of their own, which have no inner rows. Buffers
/// grow and never shrink.
class BodyBlocks {
 public:
  /// @param mobile indices of bodies that are not immovable, ascending
  /// @param bodies by index
  /// @param places by index
  /// @param pool   null: in the calling thread
  void build(std::span<const std::uint32_t> mobile, std::span<const SolverBody> bodies,
             std::span<const std::uint32_t> places, ThreadPool* pool) {
    const auto for_movable = [&](std::size_t first, std::size_t last, const auto& f) {
      for (const std::uint32_t body : mobile.subspan(first, last - first)) {
        if (bodies[body].inverse_mass > 0) f(body);
      }
    };
    struct Extent {
      std::uint32_t end = 0, without_place = 0;
    };
    const Extent extent = parallel_reduce(
        pool, mobile.size(), kBodiesPerChunk, Extent{},
        [&](std::size_t first, std::size_t last) {
          Extent e;
          for_movable(first, last, [&](std::uint32_t body) {
            if (places[body] == kNoPlace) {
              ++e.without_place;
            } else {
              e.end = std::max(e.end, places[body] + 1);
            }
          });
          return e;
        },
        [](const Extent& x, const Extent& y) {
          return Extent{std::max(x.end, y.end), x.without_place + y.without_place};
        });
    without_place_ = {};
    number_.assign(block_count(extent.end), 0);
    parallel_for(pool, mobile.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
      for_movable(first, last, [&](std::uint32_t body) {
        if (places[body] == kNoPlace) return;
        std::atomic_ref(number_[block_of(places[body])]).store(1, std::memory_order_relaxed);
      });
    });
    // The last block has a body.
    std::exclusive_scan(number_.begin(), number_.end(), number_.begin(), 0u);
    const std::size_t blocks = number_.empty() ? 0 : number_.back() + 1;
    bodies_.resize(blocks * kBodiesPerBlock);
    parallel_for(pool, bodies_.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
      std::ranges::fill(std::span(bodies_).subspan(first, last - first), kNoBody);
    });
    places_ = places;
    parallel_for(pool, mobile.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
      for_movable(first, last, [&](std::uint32_t body) {
        if (places[body] == kNoPlace) return;
        bodies_[block(body) * kBodiesPerBlock + places[body] % kBodiesPerBlock] = body;
      });
    });
    if (extent.without_place == 0) return;
    bodies_.reserve(bodies_.size() + extent.without_place);
    for_movable(0, mobile.size(), [&](std::uint32_t body) {
      if (places[body] == kNoPlace) bodies_.push_back(body);
    });
    without_place_ = std::span(bodies_).subspan(blocks * kBodiesPerBlock);
  }

  /// Number of blocks.
  std::size_t size() const { return block_count(bodies_.size()); }
  /// Calls f(body) for the bodies of a block, and ahead(body) for a body that follows soon.
  template <class F, class Ahead>
  void for_bodies(std::size_t block, const F& f, const Ahead& ahead) const {
    const std::size_t first = block * kBodiesPerBlock;
    const auto bodies = std::span(bodies_).subspan(
        first, std::min<std::size_t>(kBodiesPerBlock, bodies_.size() - first));
    for (std::size_t k = 0; k < bodies.size(); ++k) {
      constexpr std::size_t kAhead = 8;
      if (k + kAhead < bodies.size() && bodies[k + kAhead] != kNoBody) ahead(bodies[k + kAhead]);
      if (bodies[k] != kNoBody) f(bodies[k]);
    }
  }
  /// Block of one of the movable bodies.
  std::uint32_t block(std::uint32_t body) const {
    if (places_[body] != kNoPlace) return number_[block_of(places_[body])];
    const auto at = std::ranges::lower_bound(without_place_, body) - without_place_.begin();
    const std::size_t before = bodies_.size() - without_place_.size();
    return block_of(static_cast<std::uint32_t>(before + static_cast<std::size_t>(at)));
  }

 private:
  static constexpr std::size_t kBodiesPerChunk = 16384;
  /// An unused place.
  static constexpr std::uint32_t kNoBody = 0xffffffffu;

  std::vector<std::uint32_t> number_;  ///< by block of the partition: its number among the blocks
  std::vector<std::uint32_t> bodies_;  ///< by block, then by place
  std::span<const std::uint32_t> places_;         ///< by body
  std::span<const std::uint32_t> without_place_;  ///< the last ones of bodies_, ascending
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
