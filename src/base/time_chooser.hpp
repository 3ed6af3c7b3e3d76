/// Selection of the fastest alternative for a recurring task, from predicted and measured times.
#pragma once

#include <jfpx/config.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace jfpx {
inline namespace JFPX_ABI {

/// Uses no clock and executes nothing: the caller supplies predicted and measured times. For each
/// alternative it multiplies predictions by the recent ratio of measured to predicted times. An
/// alternative that is only predicted to be faster is tried before it replaces a measured one.
/// Alternatives whose predicted or measured time is less than twice the best time are tried again
/// periodically, for at most a few percent of the total time.
///
/// For an alternative without a known cost, the prediction should be proportional to the work and
/// shorter than any possible time: it is then tried early and never ruled out.
///
/// Does not allocate memory. Not thread-safe.
class JFPX_API TimeChooser {
 public:
  static constexpr std::size_t kMaxAlternatives = 4;

  struct Alternative {
    bool dormant = false;  ///< not selected before wake()
    bool batched = false;  ///< one decision may cover several short calls, see Decision::following
  };
  struct Decision {
    std::size_t alternative;
    int following;  ///< further calls of the same size that need neither choose() nor record()
  };
  enum class Reason : std::uint8_t {
    fixed,      ///< only one alternative is available
    predicted,  ///< it is predicted to be the fastest
    measured,   ///< measurements confirm that it is the fastest
    kept,       ///< another may be faster, but not by enough to switch
    trial,      ///< executed for a few calls to measure it
  };

  /// @param alternatives 1 to kMaxAlternatives, of which at least one is not dormant
  explicit TimeChooser(std::span<const Alternative> alternatives);
  /// @param alternatives as above, with default properties
  explicit TimeChooser(std::size_t alternatives);

  /// Selects the alternative for the next call.
  /// @param size of the problem, in any unit; a change by more than a factor of four discards the
  ///   measurements
  /// @param predicted_us [us] by alternative
  Decision choose(double size, std::span<const double> predicted_us);
  /// Records the time of the call for which choose() was last called. May be omitted if the call
  /// was not executed or not timed.
  /// @param us [us] measured
  /// @param predicted_us [us] prediction for the alternative and the work that was done
  void record(double us, double predicted_us);

  /// Reason for the last decision.
  Reason reason() const noexcept { return reason_; }

  /// [us] Total time that the fastest dormant alternative would have saved so far.
  double missed_us() const noexcept { return missed_us_; }
  /// Makes the dormant alternatives available.
  void wake() noexcept;
  /// Excludes an alternative permanently. At least one other must remain available.
  void remove(std::size_t alternative) noexcept;

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  static constexpr std::size_t kSamples = 5;

  enum class State : std::uint8_t { ready, dormant, removed };

  struct Candidate {
    State state = State::removed;
    bool batched = false;
    int cold_calls = 0;                     ///< remaining calls whose times are ignored
    double predicted_us = 0;                ///< for the next call
    std::array<double, kSamples> ratios{};  ///< the last ratios of measured to predicted times
    std::size_t samples = 0;                ///< measurements since the size changed
    double correction = 1;  ///< lower quartile of the ratios: disturbances only prolong times
    double warm_size = -1;  ///< largest size for which the buffers have grown
    double waited_us = 0;   ///< total time of all calls since its last trial
    double patience = 1;    ///< factor of the time to the next trial; unsuccessful trials double it

    double cost() const { return predicted_us * correction; }
  };

  std::size_t cheapest(State state) const;
  static int trial_calls(const Candidate& c);
  std::size_t due_for_trial() const;
  void discard_measurements_of_other_sizes();
  void decide();
  void take(std::size_t alternative);
  void start_trial(std::size_t alternative, int calls);

  std::array<Candidate, kMaxAlternatives> candidates_;
  std::size_t incumbent_ = kNone;  ///< the alternative in use
  std::size_t current_ = kNone;    ///< the incumbent, or the alternative on trial
  Reason reason_ = Reason::fixed;
  bool prolonged_ = false;   ///< whether the last trial was prolonged
  int stay_ = 0;             ///< decisions during which the selection does not change
  double size_ = 0;          ///< argument of the last choose()
  double regime_size_ = -1;  ///< size at which the current measurements began
  double missed_us_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
