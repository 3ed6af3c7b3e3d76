/// The selection by predicted and measured times, on simulated machines. No clock is involved, so
/// all bounds are exact.
#include "src/base/time_chooser.hpp"

#include <jfpx/random.hpp>

#include "tests/support/seed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Alternatives = std::vector<TimeChooser::Alternative>;
using Reason = TimeChooser::Reason;

constexpr double kSize = 1000;

Alternatives batched(std::size_t count) {
  return Alternatives(count, TimeChooser::Alternative{.batched = true});
}

/// A machine whose alternatives take `true_us` each; counts the calls that it executes.
struct Machine {
  std::vector<double> predicted_us, true_us;
  std::function<double(double)> clock = [](double us) { return us; };
  double spent_us = 0;
  std::vector<int> calls = std::vector<int>(true_us.size());
  int switches = 0, decisions = 0;
  std::size_t last = 0;

  void run(TimeChooser& chooser, int count, double size = kSize) {
    while (count > 0) {
      const TimeChooser::Decision decision = chooser.choose(size, predicted_us);
      const std::size_t chosen = decision.alternative;
      const int together = std::min(count, 1 + decision.following);
      count -= together;
      spent_us += together * true_us[chosen];
      switches += chosen != last;
      last = chosen;
      calls[chosen] += together;
      ++decisions;
      chooser.record(clock(true_us[chosen]), predicted_us[chosen]);
    }
  }
};

std::size_t choice(TimeChooser& chooser, const std::vector<double>& predicted_us,
                   double size = kSize) {
  return chooser.choose(size, predicted_us).alternative;
}

TEST(TimeChooser, StartsWithTheSmallestPrediction) {
  TimeChooser chooser(3);
  EXPECT_EQ(choice(chooser, {50, 20, 90}), 1u);
  EXPECT_EQ(chooser.reason(), Reason::predicted);
}

TEST(TimeChooser, OneAlternativeIsFixed) {
  TimeChooser chooser(1);
  Machine machine{{50}, {500}};
  machine.run(chooser, 1000);
  EXPECT_EQ(chooser.reason(), Reason::fixed);
}

TEST(TimeChooser, CostsAtMostFourHundredthsWhereTheModelIsRight) {
  const Seed seed;
  Random random(seed);
  for (int k = 0; k < 100; ++k) {
    Machine machine;
    for (int i = 0; i < 4; ++i) {
      machine.true_us.push_back(static_cast<double>(random.uniform(1, 100)));
    }
    machine.predicted_us = machine.true_us;
    machine.calls.resize(4);
    TimeChooser chooser(batched(4));
    machine.run(chooser, 5000);
    const double best = *std::min_element(machine.true_us.begin(), machine.true_us.end());
    ASSERT_LE(machine.spent_us, 1.04 * 5000 * best);
  }
}

// Each alternative takes between half and twice its predicted time, and one measurement in 20 is
// ten times too long. In the long run no more than a tenth is lost against the best alternative.
TEST(TimeChooser, FindsTheFastestWayWhereTheModelIsWrongByTwo) {
  constexpr double kLongRunUs = 1e5;  // at least 20 000 calls
  const Seed seed;
  Random random(seed);
  for (int k = 0; k < 200; ++k) {
    Machine machine;
    for (int i = 0; i < 4; ++i) {
      const double us = static_cast<double>(random.uniform(1, 100));
      machine.predicted_us.push_back(us);
      machine.true_us.push_back(us * std::exp2(static_cast<double>(random.uniform(-1, 1))));
    }
    machine.calls.resize(4);
    machine.clock = [&](double us) {
      const double noise = static_cast<double>(random.uniform(1, Real(1.03)));
      return us * (random.below(20) == 0 ? 10 : noise);
    };
    TimeChooser chooser(batched(4));
    const double best = *std::min_element(machine.true_us.begin(), machine.true_us.end());
    const int count = static_cast<int>(std::max(20'000.0, kLongRunUs / best));
    machine.run(chooser, count);
    ASSERT_LE(machine.spent_us, 1.1 * count * best) << "machine " << k;
  }
}

TEST(TimeChooser, IgnoresOccasionalSlowCalls) {
  TimeChooser chooser(batched(2));
  Machine machine{{50, 150}, {50, 150}};
  int n = 0;
  machine.clock = [&](double us) { return ++n % 4 == 0 ? 20 * us : us; };
  machine.run(chooser, 2000);
  EXPECT_EQ(machine.calls[1], 0);
  EXPECT_EQ(chooser.reason(), Reason::measured);
}

TEST(TimeChooser, LeavesAnAlternativeThatIsSlowerThanPredicted) {
  TimeChooser chooser(batched(2));
  Machine machine{{50, 100}, {300, 100}};
  machine.run(chooser, 100);
  EXPECT_EQ(machine.last, 1u);
  EXPECT_LE(machine.calls[0], 5) << "two calls grow buffers, three are counted, then it is left";
}

TEST(TimeChooser, AnAlternativeThatIsOnlyPredictedToBeFasterIsTriedFirst) {
  TimeChooser chooser(2);
  Machine machine{{50, 60}, {72, 71}};
  machine.run(chooser, 5);
  EXPECT_EQ(machine.calls[1], 0);
  machine.run(chooser, 1);
  EXPECT_EQ(machine.last, 1u);
  EXPECT_EQ(chooser.reason(), Reason::trial);
  machine.run(chooser, 100);
  EXPECT_EQ(machine.last, 0u) << "the gain is too small to switch";
}

TEST(TimeChooser, DoesNotSwitchForASmallGain) {
  TimeChooser chooser(batched(2));
  Machine machine{{50, 50}, {51, 49}};
  machine.run(chooser, 90);  // the first trial takes place after more than a hundred calls
  EXPECT_EQ(machine.switches, 0);
  machine.run(chooser, 10000);
  EXPECT_LE(machine.calls[1], 10000 / 25) << "trials only";
}

// Like a processor that waited for a GPU: it takes 1.15 times as long for a millisecond.
TEST(TimeChooser, TriesLongerWhereTheOutcomeIsClose) {
  TimeChooser chooser(batched(2));
  double on_other = 0;  // [us] without a call of the first alternative
  Machine machine{{20, 20}, {19, 16}};
  const auto run = [&](int count) {
    for (int i = 0; i < count; ++i) {
      machine.clock = [&](double us) {
        on_other = machine.last == 1 ? on_other + us : 0;
        return machine.last == 1 && on_other < 1000 ? 1.15 * us : us;
      };
      machine.run(chooser, 1);
    }
  };
  run(3000);
  EXPECT_GT(machine.calls[1], 2 * machine.calls[0]);
}

TEST(TimeChooser, ReportsThatAnotherIsBetterByTooLittle) {
  TimeChooser chooser(batched(2));
  Machine machine{{50, 55}, {54, 51}};  // 54 measured against 55 predicted, then against 51
  machine.run(chooser, 300);
  EXPECT_EQ(machine.last, 0u);
  EXPECT_EQ(chooser.reason(), Reason::kept);
}

TEST(TimeChooser, DiscardsMeasurementsOfOtherSizes) {
  TimeChooser chooser(batched(2));
  Machine slow{{50, 100}, {300, 100}};
  slow.run(chooser, 100);
  ASSERT_EQ(slow.last, 1u);
  EXPECT_EQ(choice(chooser, {50, 100}, 2.25 * kSize), 1u);
  EXPECT_EQ(choice(chooser, {50, 100}, 4.4 * kSize), 0u) << "more than four times the size";
}

TEST(TimeChooser, OneDecisionCoversManyShortCalls) {
  TimeChooser chooser(batched(2));
  Machine machine{{1, 5}, {1, 5}};
  machine.run(chooser, 1000);
  // The first five calls are decided one by one, then one in 201: a decision covers 200 us.
  EXPECT_LE(machine.decisions, 5 + 1000 / 200 + 1);
  EXPECT_GE(machine.decisions, 5 + 1000 / 300);
}

TEST(TimeChooser, DecidesEachCallUnlessBatched) {
  TimeChooser chooser(2);
  Machine machine{{1, 5}, {1, 5}};
  machine.run(chooser, 1000);
  EXPECT_EQ(machine.decisions, 1000);
}

TEST(TimeChooser, CountsWhatDormantAlternativesWouldHaveSaved) {
  Alternatives alternatives = batched(3);
  alternatives[2] = {.dormant = true};
  TimeChooser chooser(alternatives);
  Machine machine{{50, 20, 10}, {50, 20, 10}};
  machine.run(chooser, 100);
  EXPECT_EQ(machine.calls[2], 0);
  // 10 us per call. Calls that share a decision are counted in advance: 200 us, or 10 calls.
  EXPECT_NEAR(chooser.missed_us(), 100 * 10, 10 * 10);
  chooser.wake();
  EXPECT_EQ(choice(chooser, machine.predicted_us), 2u);
  chooser.remove(2);
  EXPECT_EQ(choice(chooser, machine.predicted_us), 1u);
  chooser.wake();
  EXPECT_EQ(choice(chooser, machine.predicted_us), 1u) << "removed permanently";
}

TEST(TimeChooser, WorksWithCostsOfZeroAndSizesOfAnyKind) {
  TimeChooser chooser(batched(2));
  for (const double size : {0.0, 1.0, 2.0, 1e18, 0.0, 9e18}) {
    for (int i = 0; i < 10; ++i) {
      choice(chooser, {0, 0}, size);
      chooser.record(0, 0);
    }
  }
  EXPECT_LT(choice(chooser, {0, 0}, 5), 2u);
}

// The following tests have no real predictions, only a lower bound: like sweeps with several
// threads (alternative 0) or one.

/// Executes `count` calls of a millisecond times `together` or `alone`; returns the mean factor.
double run_unpredicted(TimeChooser& chooser, int count, double alone, double together) {
  Machine machine{{1e-3, 1e-3}, {1e3 * together, 1e3 * alone}};
  machine.run(chooser, count);
  return machine.spent_us / (1e3 * count);
}

TEST(TimeChooser, CostsLittleMoreThanTheCheaperWay) {
  for (const double together : {0.5, 0.8, 1.3, 4.0}) {
    TimeChooser chooser(2);
    EXPECT_LT(run_unpredicted(chooser, 2000, 1, together), 1.06 * std::min(1.0, together))
        << together;
    EXPECT_LT(run_unpredicted(chooser, 20'000, 1, together), 1.01 * std::min(1.0, together))
        << together;
  }
}

TEST(TimeChooser, SwitchesWhenTheOtherBecomesFaster) {
  TimeChooser chooser(2);
  run_unpredicted(chooser, 100'000, 1, 2);
  ASSERT_EQ(choice(chooser, {1e-3, 1e-3}), 1u);
  run_unpredicted(chooser, 4200, 1, 0.5);
  EXPECT_LT(run_unpredicted(chooser, 1000, 1, 0.5), 0.55);
}

TEST(TimeChooser, IsStableWithANoisyClock) {
  const Seed seed;
  Random random(seed);
  TimeChooser chooser(2);
  int trials = 0;
  for (int i = 0; i < 20'000; ++i) {
    if (choice(chooser, {1e-3, 1e-3}) == 1) {
      ++trials;
      ASSERT_EQ(chooser.reason(), Reason::trial) << "call " << i;
    }
    // Equal times, measured with an error of up to five percent, and rarely a much larger one.
    const double error =
        0.0005 * static_cast<double>(random.below(100)) + (random.below(400) == 0 ? 5 : 0);
    chooser.record(1e3 * (1 + error), 1e-3);
  }
  EXPECT_LT(trials, 20'000 / 50);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
