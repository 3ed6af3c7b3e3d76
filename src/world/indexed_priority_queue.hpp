/// A priority queue over the numbers 0..n-1 whose keys can change: largest key first, ties to the
/// lowest number, which is what a scan from the front would pick.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// A tournament (Knuth, The Art of Computer Programming 3, 5.2.3, trees of selection) of sixteen
/// players a match. Most changes leave a match's winner what it was and end there, where a binary
/// heap would move entries about; a match is lost only by the winner, and is played again within
/// one cache line. Grows, never shrinks.
class IndexedPriorityQueue {
 public:
  /// Replaces all keys, in O(n). Not empty; no NaN.
  void assign(std::span<const Real> keys);
  /// The number with the largest key, in O(log n).
  std::uint32_t top() const {
    std::uint32_t winner = 0;
    for (std::size_t round = count_; round-- > 1;) {
      winner = winner * kPlayers + rounds_[round].winner[winner];
    }
    return winner;
  }
  Real key(std::uint32_t number) const { return rounds_[0].key[number]; }
  /// Changes one key, in O(log n) at most.
  void update(std::uint32_t number, Real key) {
    rounds_[0].key[number] = key;
    std::uint32_t player = number;
    for (std::size_t round = 1; round < count_ && settle(round, player, key); ++round) {
      key = rounds_[round].key[player /= kPlayers];
    }
  }

 private:
  static constexpr std::uint32_t kPlayers = 16;

  /// Round 0 has the numbers as its players, each later round the winners of the one before. Full
  /// matches: players that are missing never win.
  struct Round {
    std::vector<Real> key;
    std::vector<std::uint8_t> winner;  ///< of the match that each player won; none in round 0
  };

  /// Brings the match of a player whose key has become `key` up to date. False if nothing changed
  /// for the rounds after it.
  bool settle(std::size_t round, std::uint32_t player, Real key) {
    const std::uint32_t match = player / kPlayers, seat = player % kPlayers;
    Real& best = rounds_[round].key[match];
    std::uint8_t& winner = rounds_[round].winner[match];
    if (seat != winner && (key < best || (key == best && seat > winner))) return false;
    if (seat == winner && key < best) {
      play(round, match);
    } else {
      best = key;
      winner = static_cast<std::uint8_t>(seat);
    }
    return true;
  }
  void play(std::size_t round, std::uint32_t match);

  std::vector<Round> rounds_;  ///< those beyond count_ are kept for their memory
  std::size_t count_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
