/// The choice itself, against machines that are simulated: no clock, so exact bounds.
#include "src/sphere_collider/cost_chooser.hpp"

#include <jfpx/random.hpp>

#include "tests/support/sphere_fixtures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

namespace jfpx {
inline namespace JFPX_ABI {
namespace test {
namespace {

using Ways = std::vector<CostChooser::Way>;

ColliderWork work_of(double n) { return {.spheres = n, .pairs = n * (n - 1) / 2}; }

Ways ways_with(std::initializer_list<double> call_us) {
  Ways ways;
  for (const double us : call_us) {
    ways.push_back({Backend::cpu, SphereAlgorithm::all_pairs, {.call_us = us}});
  }
  return ways;
}

/// A machine whose ways take `true_us` each; counts what is done on it.
struct Machine {
  std::vector<double> true_us;
  std::function<double(double)> clock = [](double us) { return us; };
  double spent_us = 0;
  std::vector<int> calls = std::vector<int>(true_us.size());
  int switches = 0, decisions = 0;
  std::size_t last = 0;

  void run(CostChooser& chooser, int count, const ColliderWork& work = work_of(1000)) {
    while (count > 0) {
      const CostChooser::Decision decision = chooser.choose(work);
      const int together = std::min(count, 1 + decision.following);
      count -= together;
      spent_us += together * true_us[decision.way];
      switches += decision.way != last;
      last = decision.way;
      calls[decision.way] += together;
      ++decisions;
      chooser.record(work, clock(true_us[decision.way]));
    }
  }
};

TEST(CostChooser, TakesTheModelAtItsWordAtFirst) {
  CostChooser chooser(ways_with({50, 20, 90}));
  EXPECT_EQ(chooser.choose(work_of(1000)).way, 1u);
  EXPECT_EQ(chooser.reason(), ChoiceReason::predicted);
}

TEST(CostChooser, OneWayIsNoChoice) {
  CostChooser chooser(ways_with({50}));
  Machine machine{{500}};
  machine.run(chooser, 1000);
  EXPECT_EQ(chooser.reason(), ChoiceReason::fixed);
}

TEST(CostChooser, CostsAtMostThreeHundredthsWhereTheModelIsRight) {
  Random random(base_seed());
  for (int k = 0; k < 100; ++k) {
    Machine machine;
    Ways ways;
    for (int i = 0; i < 4; ++i) {
      const double us = static_cast<double>(random.uniform(1, 100));
      ways.push_back({Backend::cpu, SphereAlgorithm::all_pairs, {.call_us = us}});
      machine.true_us.push_back(us);
    }
    machine.calls.resize(4);
    CostChooser chooser(ways);
    machine.run(chooser, 5000);
    const double best = *std::min_element(machine.true_us.begin(), machine.true_us.end());
    ASSERT_LE(machine.spent_us, 1.03 * 5000 * best) << seed_note();
  }
}

// Each way takes from half to twice what the model says, and a clock that now and then is ten times
// late. In the long run no more than a tenth is lost against who knew.
TEST(CostChooser, FindsTheFastestWayWhereTheModelIsWrongByTwo) {
  Random random(base_seed());
  for (int k = 0; k < 200; ++k) {
    Machine machine;
    Ways ways;
    for (int i = 0; i < 4; ++i) {
      const double us = static_cast<double>(random.uniform(1, 100));
      ways.push_back({Backend::cpu, SphereAlgorithm::all_pairs, {.call_us = us}});
      machine.true_us.push_back(us * std::exp2(static_cast<double>(random.uniform(-1, 1))));
    }
    machine.calls.resize(4);
    machine.clock = [&](double us) {
      const double noise = static_cast<double>(random.uniform(1, Real(1.03)));
      return us * (random.below(20) == 0 ? 10 : noise);
    };
    CostChooser chooser(ways);
    machine.run(chooser, 20000);
    const double best = *std::min_element(machine.true_us.begin(), machine.true_us.end());
    ASSERT_LE(machine.spent_us, 1.1 * 20000 * best) << "machine " << k << ", " << seed_note();
  }
}

TEST(CostChooser, ASlowCallNowAndThenChangesNothing) {
  CostChooser chooser(ways_with({50, 150}));
  Machine machine{{50, 150}};
  int n = 0;
  machine.clock = [&](double us) { return ++n % 4 == 0 ? 20 * us : us; };
  machine.run(chooser, 2000);
  EXPECT_EQ(machine.calls[1], 0);
  EXPECT_EQ(chooser.reason(), ChoiceReason::measured);
}

TEST(CostChooser, LeavesAWayThatDisappointsForOneThatMayBeBetter) {
  CostChooser chooser(ways_with({50, 100}));
  Machine machine{{300, 100}};
  machine.run(chooser, 100);
  EXPECT_EQ(machine.last, 1u);
  EXPECT_LE(machine.calls[0], 5) << "two calls grow buffers, three count, then it is left";
}

TEST(CostChooser, DoesNotSwitchForALittle) {
  CostChooser chooser(ways_with({50, 50}));
  Machine machine{{51, 49}};
  machine.run(chooser, 90);  // no trial yet: that would wait for a hundred calls
  EXPECT_EQ(machine.switches, 0);
  machine.run(chooser, 10000);
  EXPECT_EQ(chooser.way(0).terms, chooser.way(1).terms);
  EXPECT_LE(machine.calls[1], 10000 / 25) << "trials only";
}

// As a processor that waited for a GPU: for a millisecond it takes 1.15 times as long.
TEST(CostChooser, TriesLongerWhereTheOutcomeIsClose) {
  CostChooser chooser(ways_with({20, 20}));
  double on_other = 0;  // [us] since the first way had a turn
  Machine machine{{19, 16}};
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

TEST(CostChooser, SaysWhenAnotherIsBetterByTooLittle) {
  CostChooser chooser(ways_with({50, 55}));
  Machine machine{{54, 51}};  // measured against predicted: 54 against 55, then 54 against 51
  machine.run(chooser, 300);
  EXPECT_EQ(machine.last, 0u);
  EXPECT_EQ(chooser.reason(), ChoiceReason::kept);
}

TEST(CostChooser, ForgetsWhatItMeasuredForOtherSizes) {
  CostChooser chooser(ways_with({50, 100}));
  Machine slow{{300, 100}};
  slow.run(chooser, 100);
  ASSERT_EQ(slow.last, 1u);
  EXPECT_EQ(chooser.choose(work_of(1500)).way, 1u) << "9/4 of the pairs";
  EXPECT_EQ(chooser.choose(work_of(2100)).way, 0u) << "more than four times the pairs";
}

TEST(CostChooser, DecidesCallsOfAMicrosecondTogether) {
  CostChooser chooser(ways_with({1, 5}));
  Machine machine{{1, 5}};
  machine.run(chooser, 1000);
  // The first five are decided alone, then one in 201: 200 us of calls go without.
  EXPECT_LE(machine.decisions, 5 + 1000 / 200 + 1);
  EXPECT_GE(machine.decisions, 5 + 1000 / 300);
}

TEST(CostChooser, CountsWhatDormantWaysWouldHaveSaved) {
  Ways ways = ways_with({50, 20, 10});
  ways[2].dormant = true;
  ways[2].backend = Backend::cuda;
  CostChooser chooser(ways);
  Machine machine{{50, 20, 10}};
  machine.run(chooser, 100);
  EXPECT_EQ(machine.calls[2], 0);
  // Ten a call; what is held is counted ahead, 200 us or 10 calls of 20.
  EXPECT_NEAR(chooser.missed_us(), 100 * 10, 10 * 10);
  chooser.wake();
  EXPECT_EQ(chooser.choose(work_of(1000)).way, 2u);
  chooser.remove(Backend::cuda);
  EXPECT_EQ(chooser.choose(work_of(1000)).way, 1u);
}

TEST(CostChooser, WorksWithCostsOfZeroAndSizesOfAnyKind) {
  CostChooser chooser(ways_with({0, 0}));
  for (const double n : {0.0, 1.0, 2.0, 1e9, 0.0, 4294967295.0}) {
    for (int i = 0; i < 10; ++i) {
      chooser.choose(work_of(n));
      chooser.record(work_of(n), 0);
    }
  }
  EXPECT_LT(chooser.choose(work_of(5)).way, 2u);
}

}  // namespace
}  // namespace test
}  // namespace JFPX_ABI
}  // namespace jfpx
