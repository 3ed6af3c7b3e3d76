/// One thread or several, for work that comes again and again: by what it took.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <array>
#include <cstdint>

namespace jfpx {
inline namespace JFPX_ABI {

/// Work whose threads share data gains from more of them on one machine and loses on another, where
/// the data travels between caches. Has no clock: it is told what the work cost. Both ways are
/// tried first, then the cheaper is taken; the other has another trial from time to time, the
/// seldomer the more often it was in vain.
class ThreadChoice {
 public:
  bool several() const noexcept { return on_trial() ? !several_ : several_; }

  /// @param cost of the work for which several() was asked, in time for each unit of work
  void record(double cost) noexcept {
    const bool was_trial = on_trial(), was_several = several();
    Way& way = ways_[was_several ? 1 : 0];
    way.costs[way.count++ % kSamples] = cost;
    if (!was_trial) {
      --until_trial_;
      return;
    }
    if (way.count % kSamples != 0) return;  // the trial goes on
    // A clock errs upwards. What is not clearly better is not worth the change.
    const bool better = way.cheapest() < kClearly * ways_[was_several ? 0 : 1].cheapest();
    if (better) several_ = was_several;
    patience_ = better ? kShortest : std::min(2 * patience_, kLongest);
    until_trial_ = patience_;
  }

 private:
  static constexpr std::uint32_t kSamples = 3, kShortest = 64, kLongest = 4096;
  static constexpr double kClearly = 0.9;

  struct Way {
    std::array<double, kSamples> costs{};
    std::uint32_t count = 0;
    double cheapest() const { return *std::min_element(costs.begin(), costs.end()); }
  };

  bool on_trial() const noexcept { return until_trial_ == 0; }

  Way ways_[2];  ///< one thread, several
  bool several_ = true;
  std::uint32_t until_trial_ = kSamples, patience_ = kShortest;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
