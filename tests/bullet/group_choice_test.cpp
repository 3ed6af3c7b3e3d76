/// The choice between Bullet's code and jfpx's for groups with little parallelism.
#include "src/bullet/solver/group_choice.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

constexpr std::size_t kManifolds = 100, kLanes = 8;

/// Solves groups with code of jfpx that takes much longer than Bullet's.
/// @return how many were left to Bullet
int solve(GroupChoice* choice, int groups, std::size_t manifolds, std::size_t blocks) {
  int left = 0;
  for (int i = 0; i < groups; ++i) {
    if (choice->leaves_to_bullet(manifolds)) {
      ++left;
      std::this_thread::sleep_for(std::chrono::microseconds(20));
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      choice->note_lanes(manifolds, manifolds, blocks, kLanes, 0);
    }
    choice->finished();
  }
  return left;
}

TEST(GroupChoice, MeasuresGroupsThatFillFewLanesAndLeavesThemToTheFaster) {
  GroupChoice choice;
  EXPECT_EQ(solve(&choice, 1, kManifolds, kManifolds), 0) << "jfpx solves the first group";
  const int left = solve(&choice, 40, kManifolds, kManifolds);
  EXPECT_GT(left, 20);
  EXPECT_LT(left, 40) << "both are measured";
  EXPECT_EQ(solve(&choice, 5, kManifolds, kManifolds), 5);
}

TEST(GroupChoice, KeepsGroupsThatFillTheLanes) {
  GroupChoice choice;
  EXPECT_EQ(solve(&choice, 40, kManifolds, 2 * kManifolds / kLanes), 0);
}

TEST(GroupChoice, MeasuresGroupsOfManyJoints) {
  GroupChoice choice;
  EXPECT_FALSE(choice.leaves_to_bullet(kManifolds));
  choice.note_lanes(kManifolds, kManifolds, kManifolds / kLanes, kLanes, kManifolds);
  choice.finished();
  EXPECT_TRUE(choice.leaves_to_bullet(kManifolds));
}

TEST(GroupChoice, IsMadeForEachSizeOfGroups) {
  GroupChoice choice;
  EXPECT_GT(solve(&choice, 20, kManifolds, kManifolds), 0);
  EXPECT_EQ(solve(&choice, 20, 8 * kManifolds, 8 * kManifolds / kLanes), 0);
  EXPECT_GT(solve(&choice, 20, kManifolds, kManifolds), 0);
  EXPECT_EQ(solve(&choice, 20, std::size_t{1} << 40, 1), 0);
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
