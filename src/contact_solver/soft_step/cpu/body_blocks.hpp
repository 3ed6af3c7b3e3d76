/// The blocks of a step on the CPU.
#pragma once

#include "src/base/parallel_for.hpp"
#include "src/contact_solver/soft_step/blocks.hpp"
#include "src/contact_solver/soft_step/step_constants.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace soft_step {

/// The movable bodies of a step by block. Bodies without a place follow in blocks of their own,
/// which have no inner rows. Buffers grow and never shrink.
class BodyBlocks {
 public:
  /// @param mobile indices of the bodies that are not immovable, ascending
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
    const bool has_all_places = extent.without_place == 0;
    // The first body without a place starts a block.
    const std::size_t placed =
        has_all_places ? extent.end : block_count(extent.end) * kBodiesPerBlock;
    bodies_.resize(placed + extent.without_place);
    parallel_for(pool, bodies_.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
      std::ranges::fill(std::span(bodies_).subspan(first, last - first), kNoBody);
    });
    parallel_for(pool, mobile.size(), kBodiesPerChunk, [&](std::size_t first, std::size_t last) {
      for_movable(first, last, [&](std::uint32_t body) {
        if (places[body] != kNoPlace) bodies_[places[body]] = body;
      });
    });
    places_ = places;
    if (has_all_places) return;
    own_places_.assign(places.begin(), places.end());
    places_ = own_places_;
    auto next = static_cast<std::uint32_t>(placed);
    for_movable(0, mobile.size(), [&](std::uint32_t body) {
      if (places[body] != kNoPlace) return;
      own_places_[body] = next;
      bodies_[next++] = body;
    });
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
  /// Block of a movable body.
  std::uint32_t block(std::uint32_t body) const { return block_of(places_[body]); }

 private:
  static constexpr std::size_t kBodiesPerChunk = 16384;
  /// An unused place.
  static constexpr std::uint32_t kNoBody = 0xffffffffu;

  std::vector<std::uint32_t> bodies_;      ///< by place
  std::span<const std::uint32_t> places_;  ///< by body
  std::vector<std::uint32_t> own_places_;  ///< by body, if some bodies have no place
};

}  // namespace soft_step
}  // namespace JFPX_ABI
}  // namespace jfpx
