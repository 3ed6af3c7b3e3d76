/// Selection by predicted and measured times; see the header.
#include "src/base/time_chooser.hpp"

#include <algorithm>
#include <cassert>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Lower bound of a prediction [us], which keeps ratios finite.
constexpr double kMinPredictedUs = 1e-3;
/// Hysteresis: an alternative replaces the incumbent only if its time is below this fraction.
constexpr double kClearly = 0.93;
/// Uncounted calls when an alternative first runs at a size, because its buffers grow.
constexpr int kColdCalls = 2;
/// Minimum number of calls before the next switch: the cold calls, and three counted calls.
constexpr int kCallsToSettle = kColdCalls + 3;
/// Minimum duration of a trial, because a processor that waited for a GPU is slow at first. A trial
/// also has at least kCallsToSettle calls.
constexpr double kTrialUs = 300;
/// Alternatives whose predicted and measured times are both this many times longer are not tried.
constexpr double kTrialRatio = 2;
/// A trial whose result is within the factor kClose is prolonged by the factor kLonger. The cost is
/// small, because the times are close. A processor that waited for a GPU takes about a millisecond
/// to reach its full speed.
constexpr double kClose = 1.2;
constexpr int kLonger = 4;
/// Time between trials, in durations of a trial. A trial of an alternative that takes twice as long
/// wastes half of its time, which is 2 % of the total.
constexpr double kTrialsBetween = 25;
constexpr double kMaxPatience = 16;
/// A decision and its time measurement take 0.1 us, or several us if reading the clock is a system
/// call. Therefore several short calls share a decision.
constexpr double kDecisionEveryUs = 200;
constexpr double kMaxFollowing = 4095;
/// A change of the size by this factor discards the measurements.
constexpr double kOtherSize = 4;
/// Buffers grow by more than is needed.
constexpr double kSlack = 1.5;

}  // namespace

TimeChooser::TimeChooser(std::span<const Alternative> alternatives) {
  assert(!alternatives.empty() && alternatives.size() <= kMaxAlternatives);
  for (std::size_t i = 0; i < alternatives.size(); ++i) {
    candidates_[i].state = alternatives[i].dormant ? State::dormant : State::ready;
    candidates_[i].batched = alternatives[i].batched;
  }
}

TimeChooser::TimeChooser(std::size_t alternatives)
    : TimeChooser(std::span(std::array<Alternative, kMaxAlternatives>().data(), alternatives)) {}

std::size_t TimeChooser::cheapest(State state) const {
  std::size_t best = kNone;
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (candidates_[i].state != state) continue;
    if (best == kNone || candidates_[i].cost() < candidates_[best].cost()) best = i;
  }
  return best;
}

TimeChooser::Decision TimeChooser::choose(double size, std::span<const double> predicted_us) {
  size_ = size;
  for (std::size_t i = 0; i < predicted_us.size(); ++i) {
    candidates_[i].predicted_us = std::max(kMinPredictedUs, predicted_us[i]);
  }
  discard_measurements_of_other_sizes();
  decide();
  const double us = candidates_[current_].cost();
  const bool alone = stay_ > 0 || !candidates_[current_].batched;
  const int following =
      alone ? 0 : static_cast<int>(std::min(kMaxFollowing, kDecisionEveryUs / us));
  const double spent = us * (1 + following);
  for (Candidate& c : candidates_) c.waited_us += spent;
  const std::size_t dormant = cheapest(State::dormant);
  if (dormant != kNone) missed_us_ += std::max(0.0, spent * (1 - candidates_[dormant].cost() / us));
  return {current_, following};
}

void TimeChooser::decide() {
  if (stay_ > 0 && --stay_ > 0) return;
  const std::size_t best = cheapest(State::ready);
  const bool after_trial = current_ != incumbent_;
  const std::size_t tried = current_;
  current_ = incumbent_;
  if (incumbent_ == kNone) {
    take(best);
  } else if (best != incumbent_ &&
             candidates_[best].cost() < kClearly * candidates_[incumbent_].cost()) {
    if (candidates_[best].samples == 0) {
      start_trial(best, kCallsToSettle);
      return;
    }
    take(best);
  } else if (after_trial && !prolonged_ &&
             candidates_[tried].cost() < kClose * candidates_[incumbent_].cost()) {
    start_trial(tried, kLonger * trial_calls(candidates_[tried]));
    prolonged_ = true;
    return;
  } else if (after_trial) {
    candidates_[tried].patience = std::min(kMaxPatience, 2 * candidates_[tried].patience);
  } else if (const std::size_t rival = due_for_trial(); rival != kNone) {
    start_trial(rival, trial_calls(candidates_[rival]));
    return;
  }
  const auto ready =
      std::ranges::count_if(candidates_, [](auto& c) { return c.state == State::ready; });
  reason_ = ready == 1                                   ? Reason::fixed
            : best != incumbent_                         ? Reason::kept
            : candidates_[incumbent_].samples < kSamples ? Reason::predicted
                                                         : Reason::measured;
}

void TimeChooser::take(std::size_t alternative) {
  incumbent_ = current_ = alternative;
  stay_ = candidates_[alternative].samples == 0 ? kCallsToSettle : 0;
}

void TimeChooser::start_trial(std::size_t alternative, int calls) {
  current_ = alternative;
  stay_ = calls;
  prolonged_ = false;
  candidates_[alternative].waited_us = 0;
  reason_ = Reason::trial;
}

int TimeChooser::trial_calls(const Candidate& c) {
  return std::max(kCallsToSettle, static_cast<int>(kTrialUs / std::max(1.0, c.cost())));
}

std::size_t TimeChooser::due_for_trial() const {
  const double now = candidates_[incumbent_].cost();
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    const Candidate& c = candidates_[i];
    if (i == incumbent_ || c.state != State::ready) continue;
    if (std::min(c.predicted_us, c.cost()) >= kTrialRatio * now) continue;
    const double trial_us = c.cost() * trial_calls(c);
    if (c.waited_us >= kTrialsBetween * c.patience * trial_us) return i;
  }
  return kNone;
}

void TimeChooser::discard_measurements_of_other_sizes() {
  const double size = std::max(1.0, size_);
  if (size <= kOtherSize * regime_size_ && regime_size_ <= kOtherSize * size) return;
  regime_size_ = size;
  for (Candidate& c : candidates_) {
    c.samples = 0;
    c.correction = 1;
    c.waited_us = 0;
    c.patience = 1;
  }
  incumbent_ = current_ = kNone;
  stay_ = 0;
}

void TimeChooser::record(double us, double predicted_us) {
  Candidate& c = candidates_[current_];
  if (size_ > c.warm_size) {
    c.warm_size = kSlack * size_;
    c.cold_calls = kColdCalls;
  }
  if (c.cold_calls > 0) {
    --c.cold_calls;
    return;
  }
  c.ratios[c.samples++ % kSamples] = us / std::max(kMinPredictedUs, predicted_us);
  std::array<double, kSamples> sorted = c.ratios;
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(c.samples, kSamples));
  const auto quartile = sorted.begin() + (end - sorted.begin() - 1) / 4;
  std::nth_element(sorted.begin(), quartile, end);
  c.correction = *quartile;
}

void TimeChooser::wake() noexcept {
  for (Candidate& c : candidates_) {
    if (c.state == State::dormant) c.state = State::ready;
  }
  stay_ = 0;
}

void TimeChooser::remove(std::size_t alternative) noexcept {
  candidates_[alternative].state = State::removed;
  incumbent_ = current_ = kNone;
  stay_ = 0;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
