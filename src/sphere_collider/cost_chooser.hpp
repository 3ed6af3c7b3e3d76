/// Chooses among ways to do a call, by a cost model and by what the last calls took.
#pragma once

#include <jfpx/cost_model.hpp>
#include <jfpx/sphere_collider.hpp>

#include <array>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {

/// Has no clock and computes nothing itself: it is told times and says who is next. For each way it
/// keeps the ratio of measured to predicted times; a way without measurements is taken at the
/// model's word, so that one which disappoints is left for one that may be better. What the model
/// or the last measurements hold to be at most twice as slow is tried from time to time, for at
/// most some hundredths of the time.
class JFPX_API CostChooser {
 public:
  struct Way {
    Backend backend;
    SphereAlgorithm algorithm;
    CostTerms terms;
    bool dormant = false;  ///< not to be used before wake()
  };
  struct Decision {
    std::size_t way;
    int following;  ///< calls with the same counts that need not ask, nor record()
  };

  /// @param ways at least one is not dormant
  /// @param asked_always choose() is called for each call: none follow
  explicit CostChooser(const std::vector<Way>& ways, bool asked_always = false);

  Decision choose(const ColliderWork& expected);
  /// What the call for which choose() was asked last had to do, and how long it took.
  void record(const ColliderWork& done, double us);

  const Way& way(std::size_t index) const { return ways_[index].way; }
  /// Why the last decision was taken.
  ChoiceReason reason() const noexcept { return reason_; }

  /// [us] that dormant ways would have saved since the beginning.
  double missed_us() const noexcept { return missed_us_; }
  void wake() noexcept;
  /// Never again. At least one way of another backend must be left.
  void remove(Backend backend);

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  static constexpr std::size_t kSamples = 5;

  struct Candidate {
    Way way;
    std::array<double, kSamples> ratios{};  ///< measured / predicted, the last ones
    std::size_t samples = 0;                ///< taken since the size changed
    double correction = 1;                  ///< their lower quartile: a clock errs upwards
    double warm_pairs = -1;                 ///< up to here its buffers have grown
    int cold_calls = 0;                     ///< that do not count
    double waited_us = 0;                   ///< time spent since its last trial
    double patience = 1;                    ///< grows with each trial that was in vain
  };

  static double cost(const Candidate& c, const ColliderWork& work);
  std::size_t cheapest(const ColliderWork& work, bool dormant) const;
  static int trial_calls(const Candidate& c, const ColliderWork& work);
  std::size_t due_for_trial(const ColliderWork& work) const;
  void forget_if_size_changed(const ColliderWork& work);
  void decide(const ColliderWork& work);
  void take(std::size_t way);
  void start_trial(std::size_t way, int calls);

  std::vector<Candidate> ways_;
  bool asked_always_;
  std::size_t incumbent_ = kNone;  ///< who computes
  std::size_t current_ = kNone;    ///< the incumbent, or who is on trial
  ChoiceReason reason_ = ChoiceReason::fixed;
  int stay_ = 0;              ///< decisions for which nothing changes
  bool prolonged_ = false;    ///< the last trial
  double regime_pairs_ = -1;  ///< size for which the ratios were measured
  double missed_us_ = 0;
};

}  // namespace JFPX_ABI
}  // namespace jfpx
