/// Tests of the tree of bounding spheres against all pairs, and of worlds with each broad phase.
#include <jfpx/error.hpp>

#include "src/collide/bounding_sphere.hpp"
#include "src/collide/sphere_pair.hpp"
#include "src/thesis/contact_search.hpp"
#include "src/thesis/free_motion.hpp"
#include "src/thesis/sphere_hierarchy.hpp"
#include "src/world/thesis_table.hpp"
#include "tests/collide/contact_oracle.hpp"
#include "tests/world/random_bodies.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace jfpx {
namespace {

using test::operator""_r;
using test::kInfinity;
using test::kNan;

using Spheres = std::map<SphereHierarchy::Leaf, SphereInstance>;

std::vector<SpherePair> all_touching(const Spheres& spheres) {
  std::vector<SpherePair> pairs;
  for (auto a = spheres.begin(); a != spheres.end(); ++a) {
    for (auto b = std::next(a); b != spheres.end(); ++b) {
      if (detail::test_sphere_pair(a->second, b->second).touching != 0) {
        pairs.push_back({a->first, b->first});
      }
    }
  }
  return pairs;
}

/// Spheres of one of several kinds: of similar size, over decades of sizes, in a line, coincident,
/// far from the origin, tiny.
SphereInstance random_sphere(Random* random, std::uint64_t kind) {
  const Vec3 p = random->uniform_in_box({-1, -1, -1}, {1, 1, 1});
  const Real r = random->uniform(0.01_r, 0.2_r);
  if (kind == 0) return {p, r};
  if (kind == 1) return {p * 100, static_cast<Real>(std::pow(10.0, random->uniform(-3, 1)))};
  if (kind == 2) return {{p.x * 50, 0, 0}, r};
  if (kind == 3) return {{1, 2, 3}, r};
  if (kind == 4) return {Vec3{1e7_r, -1e7_r, 1e7_r} + p * 10, r};
  const Real tiny = std::numeric_limits<Real>::min();
  return {p * (tiny * 8), tiny};
}
constexpr std::uint64_t kKinds = 6;

void expect_all_pairs(const SphereHierarchy& tree, const Spheres& spheres) {
  ASSERT_EQ(tree.size(), spheres.size());
  std::vector<SpherePair> found;
  tree.find_pairs(&found);
  ASSERT_EQ(found, all_touching(spheres));
}

void expect_balanced(const SphereHierarchy& tree) {
  if (tree.size() == 0) return;
  ASSERT_LE(tree.depth(), 2.5 * std::log2(static_cast<double>(tree.size())) + 2);
}

TEST(SphereHierarchy, FindsAllPairsThroughInsertionsMovesAndRemovals) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (std::uint64_t round = 0; round < 60; ++round) {
    const std::uint64_t kind = round % kKinds;
    SphereHierarchy tree(round % 4 == 0 ? 0 : 0.3_r);
    Spheres spheres;
    for (int n = 0; n < 300; ++n) {
      const std::uint64_t action = random.below(n < 150 ? 4 : 8);
      if (action < 3 || spheres.empty()) {
        const SphereInstance sphere = random_sphere(&random, kind);
        const SphereHierarchy::Leaf leaf = tree.insert(sphere);
        ASSERT_TRUE(spheres.emplace(leaf, sphere).second);
        continue;
      }
      const auto chosen =
          std::next(spheres.begin(), static_cast<std::ptrdiff_t>(random.below(spheres.size())));
      if (action < 5) {
        tree.remove(chosen->first);
        spheres.erase(chosen);
      } else {
        const SphereInstance other = random_sphere(&random, kind);
        if (action < 7) {
          chosen->second.centre += (other.centre - chosen->second.centre) * 0.01_r;
        } else {
          chosen->second = other;
        }
        tree.update(chosen->first, chosen->second);
        ASSERT_EQ(tree.sphere(chosen->first), chosen->second);
      }
      if (n % 30 == 0) {
        ASSERT_NO_FATAL_FAILURE(expect_all_pairs(tree, spheres));
      }
      ASSERT_NO_FATAL_FAILURE(expect_balanced(tree));
    }
    ASSERT_NO_FATAL_FAILURE(expect_all_pairs(tree, spheres));
    const SphereInstance query = random_sphere(&random, kind);
    std::vector<SphereHierarchy::Leaf> found, expected;
    tree.find_touching(query, &found);
    for (const auto& [leaf, sphere] : spheres) {
      if (detail::test_sphere_pair(sphere, query).touching != 0) expected.push_back(leaf);
    }
    ASSERT_EQ(found, expected);
  }
}

TEST(SphereHierarchy, FindsAllPairsBuiltAsAWholeOrOneByOne) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  for (const std::size_t size : {0u, 1u, 2u, 3u, 4u, 5u, 33u, 1000u}) {
    for (std::uint64_t kind = 0; kind < kKinds; ++kind) {
      std::vector<SphereInstance> list;
      Spheres spheres;
      SphereHierarchy at_once, one_by_one;
      for (std::uint32_t i = 0; i < size; ++i) {
        list.push_back(random_sphere(&random, kind));
        spheres.emplace(i, list.back());
      }
      at_once.assign(list);
      ASSERT_NO_FATAL_FAILURE(expect_all_pairs(at_once, spheres));
      spheres.clear();
      for (const SphereInstance& sphere : list) spheres.emplace(one_by_one.insert(sphere), sphere);
      ASSERT_NO_FATAL_FAILURE(expect_all_pairs(one_by_one, spheres));
      ASSERT_NO_FATAL_FAILURE(expect_balanced(one_by_one));
    }
  }
}

TEST(SphereHierarchy, StaysShallowForSpheresInALineOrAtOnePoint) {
  SphereHierarchy line, place;
  for (int i = 0; i < 20000; ++i) line.insert({{static_cast<Real>(3 * i), 0, 0}, 1});
  for (int i = 0; i < 5000; ++i) place.insert({{7, 7, 7}, 1});
  expect_balanced(line);
  expect_balanced(place);
}

TEST(SphereHierarchy, FollowsSmallMovesWithoutChange) {
  SphereHierarchy tree(0.5_r);
  const auto leaf = tree.insert({{0, 0, 0}, 1});
  tree.insert({{9, 0, 0}, 1});
  EXPECT_FALSE(tree.update(leaf, {{0.4_r, 0, 0}, 1}));
  EXPECT_TRUE(tree.update(leaf, {{7.5_r, 0, 0}, 1}));
  std::vector<SpherePair> pairs;
  tree.find_pairs(&pairs);
  EXPECT_EQ(pairs.size(), 1u);
}

TEST(SphereHierarchy, RefusesInvalidSpheres) {
  SphereHierarchy tree;
  const auto leaf = tree.insert({{0, 0, 0}, 1});
  for (const SphereInstance& bad :
       {SphereInstance{{kNan, 0, 0}, 1}, SphereInstance{{0, kInfinity, 0}, 1},
        SphereInstance{{0, 0, 0}, 0}, SphereInstance{{0, 0, 0}, -1},
        SphereInstance{{0, 0, 0}, kNan}, SphereInstance{{0, 0, 0}, kInfinity}}) {
    EXPECT_THROW(tree.insert(bad), InvalidArgument);
    EXPECT_THROW(tree.update(leaf, bad), InvalidArgument);
    EXPECT_THROW(tree.assign({&bad, 1}), InvalidArgument);
    EXPECT_EQ(tree.size(), 0u);  // after a bad list
    ASSERT_EQ(tree.insert({{0, 0, 0}, 1}), leaf);
  }
  tree.remove(leaf);
  EXPECT_THROW(tree.remove(leaf), InvalidArgument);  // twice
  EXPECT_THROW(tree.sphere(leaf), InvalidArgument);
  EXPECT_THROW(tree.update(99, {{}, 1}), InvalidArgument);
  EXPECT_THROW(SphereHierarchy(-1), InvalidArgument);
  EXPECT_THROW(SphereHierarchy{kNan}, InvalidArgument);
}

TEST(SphereHierarchy, NumbersTooLargeToSquareLoseNoPair) {
  const Real huge = square_root(std::numeric_limits<Real>::max());
  SphereHierarchy tree;
  const auto first = tree.insert({{4 * huge, 0, 0}, 1});
  const auto second = tree.insert({{4 * huge, 1, 0}, 1});
  tree.insert({{-4 * huge, 0, 0}, huge});
  std::vector<SpherePair> pairs;
  tree.find_pairs(&pairs);
  EXPECT_EQ(pairs, (std::vector<SpherePair>{{std::min(first, second), std::max(first, second)}}));
}

TEST(Erratum, E32_a_hierarchy_lives_grows_and_loses_its_leaves) {
  // The original crashed at the first use and freed one child twice.
  EXPECT_EQ(detail::growth({{0, 0, 0}, 2}, {{1, 0, 0}, 0.5_r}), 0);  // inside
  // A sphere around radius 1 at 0 and radius 1 at 4 has radius 3; the growth is 9 - 1.
  EXPECT_NEAR(detail::growth({{0, 0, 0}, 1}, {{4, 0, 0}, 1}), 8, 600 * double{kEpsilon});
  SphereHierarchy tree;
  std::vector<SphereHierarchy::Leaf> leaves;
  for (int i = 0; i < 100; ++i) leaves.push_back(tree.insert({{static_cast<Real>(i), 0, 0}, 1}));
  for (const auto leaf : leaves) tree.remove(leaf);
  EXPECT_EQ(tree.size(), 0u);
  EXPECT_EQ(tree.depth(), -1);
}

TEST(Erratum, E33_pairs_inside_one_child_are_reported) {
  // Two pairs far from each other: each pair is one child of the root.
  SphereHierarchy tree;
  std::vector<SphereHierarchy::Leaf> leaves;
  for (const Real x : {Real(0), Real(1), Real(100), Real(101)}) {
    leaves.push_back(tree.insert({{x, 0, 0}, 1}));
  }
  std::vector<SpherePair> pairs;
  tree.find_pairs(&pairs);
  EXPECT_EQ(pairs, (std::vector<SpherePair>{{leaves[0], leaves[1]}, {leaves[2], leaves[3]}}));
}

/// Replaces the filter of one body, and ignores a pair or ceases to ignore it.
void change_filters(Random* random, BodyStore* bodies) {
  const auto any_body = [&] { return bodies->ids()[random->below(bodies->ids().size())].index; };
  const auto bits = [&] { return static_cast<std::uint32_t>(random->below(8)); };
  bodies->set_filter(any_body(), {bits(), ~bits()});
  const BodyPair pair{any_body(), any_body()};
  if (pair.a != pair.b) bodies->set_pair_ignored(pair, random->below(3) > 0);
}

TEST(BroadPhase, AllWaysFindTheSameContactsThroughInsertionsAndRemovals) {
  const std::uint64_t seed = test::fresh_seed();
  SCOPED_TRACE(test::trace(seed));
  Random random(seed);
  std::size_t contacts = 0;
  for (int round = 0; round < 30; ++round) {
    BodyStore bodies(0.01_r, SleepSettings{});
    std::vector<ContactFinder> ways;
    for (const BroadPhase way :
         {BroadPhase::cells, BroadPhase::hierarchy, BroadPhase::brute_force}) {
      ways.emplace_back(make_broad_phase(make_sphere_collider(), way), SimdLevel::automatic);
    }
    for (int change = 0; change < 40; ++change) {
      const bool remove = bodies.ids().size() > 2 && random.below(3) == 0;
      if (remove) {
        bodies.remove(bodies.ids()[random.below(bodies.ids().size())]);
      } else {
        bodies.add(test::random_body(&random, 2));
      }
      if (round % 2 != 0) change_filters(&random, &bodies);
      for (ContactFinder& way : ways) way.set_bodies(bodies);
      for (int move = 0; move < 3; ++move) {
        for (const BodyId id : bodies.ids()) {
          if (!bodies.movable(id.index)) continue;
          thesis::displace(&bodies, id.index,
                           random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * 0.1_r,
                           random.uniform_in_box({-1, -1, -1}, {1, 1, 1}) * 0.1_r);
        }
        const std::vector<Contact> expected = test::ContactOracle(bodies).contacts();
        for (ContactFinder& way : ways) {
          std::vector<Contact> found;
          thesis::ContactSearch().find_contacts(bodies, &way, &found);
          ASSERT_EQ(found, expected) << round << ", change " << change;
        }
        contacts += expected.size();
      }
    }
  }
  EXPECT_GT(contacts, 10000u);
}

/// The squares of the edges are 0 in float.
TEST(BroadPhase, BoxesMayBeAsSmallAsRealAllows) {
  for (const BroadPhase way : {BroadPhase::cells, BroadPhase::hierarchy, BroadPhase::brute_force}) {
    for (const Real half :
         {Real(1e-15), Real(1e-22), Real(1e-30), std::numeric_limits<Real>::min()}) {
      BodyDef body = test::ball({0, 1, 0});
      body.shape = Compound{{{.shape = Sphere{1}}, {.shape = Box{{half, half, half}}}}};
      Scene scene;
      scene.bodies = {body, test::ball({1, 1, 0}), test::ground()};
      WorldSettings settings;
      settings.broad_phase = way;
      World world(scene, settings);
      for (int n = 0; n < 3; ++n) EXPECT_GT(world.step().contacts, 0u) << half;
    }
  }
}

TEST(BroadPhase, WorldsHaveTheSameBitsWithEveryBroadPhase) {
  Random random(5);
  Scene scene;
  for (int i = 0; i < 150; ++i) {
    BodyDef def = test::random_body(&random, 4);
    def.position.y += 5;
    if (i % 5 == 0) def.filter = {.category = 2, .mask = 1};  // touch no body of their kind
    if (def.mass > 0) scene.bodies.push_back(def);
  }
  scene.ignored_pairs = {{1, 2}, {7, 3}, {0, 50}};
  scene.bodies.push_back(test::ground());
  for (const Solver solver : test::kSolvers) {
    SCOPED_TRACE(to_string(solver));
    scene.solver = solver;
    std::uint64_t expected = 0;
    for (const BroadPhase way :
         {BroadPhase::cells, BroadPhase::hierarchy, BroadPhase::brute_force}) {
      WorldSettings settings;
      settings.broad_phase = way;
      World world(scene, settings);
      for (int n = 0; n < 100; ++n) {
        world.step();
        if (n == 30) world.remove(world.bodies()[17]);
        if (n == 60) world.add(test::ball({0, 9, 0}));
      }
      if (expected == 0) expected = world.state_hash();
      EXPECT_EQ(world.state_hash(), expected) << static_cast<int>(way);
    }
  }
  WorldSettings settings;
  settings.broad_phase = static_cast<BroadPhase>(3);
  EXPECT_THROW(World(scene, settings), InvalidArgument);
}

}  // namespace
}  // namespace jfpx
