/// Chooses among ways to do a call, by a cost model and by what the last calls took.
#include "src/sphere_collider/cost_chooser.hpp"

#include <algorithm>
#include <utility>

namespace jfpx {
inline namespace JFPX_ABI {
namespace {

/// Who is not faster by this much is not switched to: hysteresis.
constexpr double kClearly = 0.93;
/// Calls that do not count when a way is new to a size: they grow buffers.
constexpr int kColdCalls = 2;
/// Calls after a switch before the next: those, and three that count.
constexpr int kCallsToSettle = kColdCalls + 3;
/// A trial lasts so long, since a processor that waited for a GPU is slow at first, but at least
/// as many calls as it takes to settle.
constexpr double kTrialUs = 300;
constexpr double kTrialRatio = 2;
/// One whose outcome is closer than this goes on so many times as long, which costs little because
/// it is close: a processor that waited for a GPU takes a millisecond to be as fast as it can.
constexpr double kClose = 1.2;
constexpr int kLonger = 4;
/// Time between trials, in trials: of one that takes twice as long half is lost, two hundredths of
/// all.
constexpr double kTrialsBetween = 25;
constexpr double kMaxPatience = 64;
/// Deciding and timing takes 0.1 us, and some us where reading the clock is a call of the system:
/// calls that take little are decided together.
constexpr double kDecisionEveryUs = 200;
constexpr double kMaxFollowing = 4095;
/// Where the pairs change by this, what was measured before is forgotten.
constexpr double kOtherSize = 4;
/// Buffers grow by some more than is needed.
constexpr double kSlack = 1.5;

}  // namespace

CostChooser::CostChooser(const std::vector<Way>& ways, bool asked_always)
    : asked_always_(asked_always) {
  for (const Way& way : ways) ways_.push_back({.way = way});
}

double CostChooser::cost(const Candidate& c, const ColliderWork& work) {
  constexpr double kLeast = 1e-3;  // so that ratios are finite
  return std::max(kLeast, microseconds(c.way.terms, work)) * c.correction;
}

std::size_t CostChooser::cheapest(const ColliderWork& work, bool dormant) const {
  std::size_t best = kNone;
  for (std::size_t i = 0; i < ways_.size(); ++i) {
    if (ways_[i].way.dormant != dormant) continue;
    if (best == kNone || cost(ways_[i], work) < cost(ways_[best], work)) best = i;
  }
  return best;
}

CostChooser::Decision CostChooser::choose(const ColliderWork& expected) {
  forget_if_size_changed(expected);
  decide(expected);
  const double us = cost(ways_[current_], expected);
  // No call to a device takes so little.
  const bool alone = asked_always_ || stay_ > 0 || ways_[current_].way.backend != Backend::cpu;
  const int following =
      alone ? 0 : static_cast<int>(std::min(kMaxFollowing, kDecisionEveryUs / us));
  const double spent = us * (1 + following);
  for (Candidate& c : ways_) c.waited_us += spent;
  const std::size_t dormant = cheapest(expected, true);
  if (dormant != kNone) {
    missed_us_ += std::max(0.0, spent * (1 - cost(ways_[dormant], expected) / us));
  }
  return {current_, following};
}

void CostChooser::decide(const ColliderWork& work) {
  if (stay_ > 0 && --stay_ > 0) return;
  const std::size_t best = cheapest(work, false);
  const bool after_trial = current_ != incumbent_;
  const std::size_t tried = current_;
  current_ = incumbent_;
  if (incumbent_ == kNone ||
      (best != incumbent_ && cost(ways_[best], work) < kClearly * cost(ways_[incumbent_], work))) {
    take(best);
  } else if (after_trial && !prolonged_ &&
             cost(ways_[tried], work) < kClose * cost(ways_[incumbent_], work)) {
    prolonged_ = true;
    start_trial(tried, kLonger * trial_calls(ways_[tried], work));
    return;
  } else if (after_trial) {
    ways_[tried].patience = std::min(kMaxPatience, 2 * ways_[tried].patience);
  } else if (const std::size_t rival = due_for_trial(work); rival != kNone) {
    prolonged_ = false;
    start_trial(rival, trial_calls(ways_[rival], work));
    return;
  }
  const auto ready = std::ranges::count_if(ways_, [](auto& c) { return !c.way.dormant; });
  reason_ = ready == 1                             ? ChoiceReason::fixed
            : best != incumbent_                   ? ChoiceReason::kept
            : ways_[incumbent_].samples < kSamples ? ChoiceReason::predicted
                                                   : ChoiceReason::measured;
}

void CostChooser::take(std::size_t way) {
  incumbent_ = current_ = way;
  stay_ = ways_[way].samples == 0 ? kCallsToSettle : 0;
}

void CostChooser::start_trial(std::size_t way, int calls) {
  current_ = way;
  stay_ = calls;
  ways_[way].waited_us = 0;
  reason_ = ChoiceReason::trial;
}

int CostChooser::trial_calls(const Candidate& c, const ColliderWork& work) {
  return std::max(kCallsToSettle, static_cast<int>(kTrialUs / std::max(1.0, cost(c, work))));
}

std::size_t CostChooser::due_for_trial(const ColliderWork& work) const {
  const double now = cost(ways_[incumbent_], work);
  for (std::size_t i = 0; i < ways_.size(); ++i) {
    if (i == incumbent_ || ways_[i].way.dormant) continue;
    const double us = cost(ways_[i], work);
    if (std::min(1.0, 1 / ways_[i].correction) * us >= kTrialRatio * now) continue;
    const double trial_us = us * trial_calls(ways_[i], work);
    if (ways_[i].waited_us >= kTrialsBetween * ways_[i].patience * trial_us) return i;
  }
  return kNone;
}

void CostChooser::forget_if_size_changed(const ColliderWork& work) {
  const double pairs = std::max(1.0, work.pairs);
  if (pairs <= kOtherSize * regime_pairs_ && regime_pairs_ <= kOtherSize * pairs) return;
  regime_pairs_ = pairs;
  for (Candidate& c : ways_) {
    c.samples = 0;
    c.correction = 1;
    c.waited_us = 0;
    c.patience = 1;
  }
  incumbent_ = current_ = kNone;
  stay_ = 0;
}

void CostChooser::record(const ColliderWork& done, double us) {
  Candidate& c = ways_[current_];
  if (done.pairs > c.warm_pairs) {
    c.warm_pairs = kSlack * done.pairs;
    c.cold_calls = kColdCalls;
  }
  if (c.cold_calls > 0) {
    --c.cold_calls;
    return;
  }
  c.correction = 1;
  c.ratios[c.samples++ % kSamples] = us / cost(c, done);
  std::array<double, kSamples> sorted = c.ratios;
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(c.samples, kSamples));
  const auto quartile = sorted.begin() + (end - sorted.begin() - 1) / 4;
  std::nth_element(sorted.begin(), quartile, end);
  c.correction = *quartile;
}

void CostChooser::wake() noexcept {
  for (Candidate& c : ways_) c.way.dormant = false;
  stay_ = 0;
}

void CostChooser::remove(Backend backend) {
  std::erase_if(ways_, [&](const Candidate& c) { return c.way.backend == backend; });
  incumbent_ = current_ = kNone;
  stay_ = 0;
}

}  // namespace JFPX_ABI
}  // namespace jfpx
