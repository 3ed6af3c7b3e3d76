/// The matches.
#include "src/world/indexed_priority_queue.hpp"

#include <array>
#include <bit>
#include <limits>

namespace jfpx {
inline namespace JFPX_ABI {

void IndexedPriorityQueue::assign(std::span<const Real> keys) {
  constexpr Real kNobody = -std::numeric_limits<Real>::infinity();
  const auto full = [](std::size_t players) {
    return (players + kPlayers - 1) / kPlayers * kPlayers;
  };
  count_ = 1;
  for (std::size_t left = keys.size(); left > 1; left = full(left) / kPlayers) ++count_;
  if (rounds_.size() < count_) rounds_.resize(count_);
  rounds_[0].key.assign(keys.begin(), keys.end());
  rounds_[0].key.resize(full(keys.size()), kNobody);
  for (std::size_t round = 1; round < count_; ++round) {
    const std::size_t matches = rounds_[round - 1].key.size() / kPlayers;
    rounds_[round].key.assign(full(matches), kNobody);
    rounds_[round].winner.assign(full(matches), 0);
    for (std::uint32_t match = 0; match < matches; ++match) play(round, match);
  }
}

/// The winner of match `match` among the players of the round before becomes a player of `round`.
void IndexedPriorityQueue::play(std::size_t round, std::uint32_t match) {
  const Real* key = &rounds_[round - 1].key[std::size_t{match} * kPlayers];
  Real best[kPlayers / 2];
  for (std::uint32_t i = 0; i < kPlayers / 2; ++i) {
    best[i] = key[i] > key[i + kPlayers / 2] ? key[i] : key[i + kPlayers / 2];
  }
  for (std::uint32_t half = kPlayers / 4; half > 0; half /= 2) {
    for (std::uint32_t i = 0; i < half; ++i) {
      best[i] = best[i] > best[i + half] ? best[i] : best[i + half];
    }
  }
  // The lowest seat with that key, again without branches.
  std::array<std::uint8_t, kPlayers> lost;
  for (std::uint32_t i = 0; i < kPlayers; ++i) lost[i] = key[i] == best[0] ? 0 : 0xff;
  const auto eights = std::bit_cast<std::array<std::uint64_t, 2>>(lost);
  const int low = std::countr_one(eights[0]) / 8, high = std::countr_one(eights[1]) / 8;
  const int seat = low < 8 ? low : 8 + high % 8;
  rounds_[round].key[match] = best[0];
  rounds_[round].winner[match] = static_cast<std::uint8_t>(seat);
}

}  // namespace JFPX_ABI
}  // namespace jfpx
