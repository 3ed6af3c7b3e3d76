/// The dispatcher's counters, its fallbacks with reasons, and detection of planted errors.
#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
#include <jfpx/error.hpp>

#include "src/bullet/dispatch/convex_check.hpp"
#include "tests/bullet/twin_worlds.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

/// Forwards to a real collider, then lets a test modify the results or fail.
class SpoiledCollider : public SphereCollider {
 public:
  using Spoil = std::function<void(std::vector<PairContact>*)>;
  explicit SpoiledCollider(Spoil spoil) : spoil_(std::move(spoil)) {}

  ContactSpan find_contacts(std::span<const SphereInstance> spheres) override {
    return good_->find_contacts(spheres);
  }
  std::span<const PairContact> find_touching(std::span<const SphereInstance> spheres,
                                             std::span<const SpherePair> pairs) override {
    const auto touching = good_->find_touching(spheres, pairs);
    touching_.assign(touching.begin(), touching.end());
    spoil_(&touching_);
    return touching_;
  }
  Backend backend() const noexcept override { return Backend::cpu; }
  SphereAlgorithm algorithm() const noexcept override { return SphereAlgorithm::automatic; }
  ChoiceReason reason() const noexcept override { return ChoiceReason::kept; }

 private:
  Spoil spoil_;
  std::unique_ptr<SphereCollider> good_ = make_sphere_collider({.backend = Backend::cpu});
  std::vector<PairContact> touching_;
};

TwinOptions with_collider(SpoiledCollider::Spoil spoil, bool verify = false) {
  TwinOptions options;
  options.ours = [=](btCollisionConfiguration* c) {
    return std::make_unique<CollisionDispatcher>(
        c, std::make_unique<SpoiledCollider>(spoil),
        DispatcherOptions{.minimum_batch = 0, .verify = verify});
  };
  return options;
}

/// Four spheres in a row, each touching the next, and a far one above a box that touches the first.
/// Pairs of the broadphase: 3 of spheres, 1 with the box.
void add_row(BulletWorld& w) {
  w.world.setGravity(btVector3(0, 0, 0));
  for (int i = 0; i < 4; ++i) {
    w.add_sphere(btScalar(0.5), btVector3(btScalar(i) * btScalar(0.99), 0, 0));
  }
  w.add_sphere(btScalar(0.5), btVector3(0, 10, 0));
  w.add(w.keep(new btBoxShape(btVector3(btScalar(0.1), btScalar(0.1), btScalar(0.1)))),
        btVector3(0, btScalar(0.55), 0), 0);
}

TEST(DispatchStats, CountPairsOfAKnownRow) {
  Twins twins;
  twins.both(add_row);
  ASSERT_TRUE(twins.step());
  EXPECT_EQ(twins.stats().dispatches, 1u);
  EXPECT_EQ(twins.stats().batches, 1u);
  EXPECT_EQ(twins.stats().pairs, 4u);
  EXPECT_EQ(twins.stats().sphere_pairs, 3u);
  EXPECT_EQ(twins.stats().touching, 3u);
  EXPECT_EQ(twins.stats().written, 0u) << "the algorithms are new: Bullet makes and runs them";
  ASSERT_TRUE(twins.dispatch());
  EXPECT_EQ(twins.stats().batches, 2u);
  EXPECT_EQ(twins.stats().written, 3u);
  EXPECT_GT(twins.stats().prepare_ms, 0.0);
  EXPECT_GT(twins.stats().commit_ms, 0.0);

  twins.ours().ours()->reset_stats();
  EXPECT_EQ(twins.stats().dispatches, 0u);
  EXPECT_EQ(twins.stats().pairs, 0u);
}

TEST(DispatchStats, MinimumBatchIsTheSmallestBatch) {
  for (const std::size_t minimum : {3u, 4u, 5u}) {
    Twins twins;
    twins.both(add_row);
    twins.ours().ours()->set_minimum_batch(minimum);
    ASSERT_EQ(twins.ours().ours()->minimum_batch(), minimum);
    ASSERT_TRUE(twins.step());
    EXPECT_EQ(twins.stats().batches, minimum <= 4 ? 1u : 0u);
    EXPECT_EQ(twins.stats().last_fallback, minimum <= 4 ? Fallback::none : Fallback::small_batch);
  }
}

TEST(DispatchStats, WorldsWithoutSpheresAreLeftToBullet) {
  Twins twins;
  twins.both([](BulletWorld& w) {
    auto* box = w.keep(new btBoxShape(btVector3(1, 1, 1)));
    for (int i = 0; i < 5; ++i) w.add(box, btVector3(0, btScalar(i), 0));
    w.add_sphere(1, btVector3(0, 2, 0));
  });
  ASSERT_TRUE(twins.step(5));
  EXPECT_EQ(twins.stats().last_fallback, Fallback::no_spheres);
  EXPECT_EQ(twins.stats().fallbacks[static_cast<std::size_t>(Fallback::no_spheres)], 5u);
}

TEST(DispatchStats, EveryFallbackHasItsOwnText) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < kFallbackCount; ++i) {
    texts.emplace_back(to_string(static_cast<Fallback>(i)));
  }
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::unique(texts.begin(), texts.end()), texts.end());
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "unknown"), 0);
}

TEST(DispatchStats, EveryOrderReasonHasItsOwnText) {
  std::vector<std::string> texts;
  for (std::size_t i = 0; i < kOrderReasonCount; ++i) {
    texts.emplace_back(to_string(static_cast<OrderReason>(i)));
  }
  std::sort(texts.begin(), texts.end());
  EXPECT_EQ(std::unique(texts.begin(), texts.end()), texts.end());
  EXPECT_EQ(std::count(texts.begin(), texts.end(), "unknown"), 0);
}

TEST(FailingCollider, IsReplacedAndTheBitsStay) {
  int calls = 0;
  Twins twins(with_collider([&](std::vector<PairContact>*) {
    if (++calls == 10) throw DeviceError("the device is gone");
  }));
  twins.both([](BulletWorld& w) { add_heap(w, 50, 51); });
  ASSERT_TRUE(twins.step(5));
  EXPECT_EQ(twins.ours().ours()->reason(), ChoiceReason::kept) << "the reason of the collider";
  ASSERT_TRUE(twins.step(25));
  EXPECT_EQ(twins.ours().ours()->reason(), ChoiceReason::fixed);
  EXPECT_EQ(calls, 10) << "it must not be called again";
  EXPECT_EQ(twins.stats().batches, 30u) << "the CPU must replace it in the same dispatch";
  EXPECT_EQ(twins.stats().device_failure, "the device is gone");
  EXPECT_EQ(twins.stats().last_fallback, Fallback::none);
  EXPECT_EQ(twins.ours().ours()->backend(), Backend::cpu);
  twins.ours().ours()->reset_stats();
  EXPECT_EQ(twins.stats().device_failure, "the device is gone");
}

TEST(FailingCollider, OfTheFirstDispatchLeavesNoTrace) {
  Twins twins(with_collider([](std::vector<PairContact>*) { throw DeviceError(""); }));
  twins.both(add_row);
  ASSERT_TRUE(twins.step(5));
  EXPECT_EQ(twins.stats().batches, 5u);
  EXPECT_EQ(twins.stats().device_failure, "unknown");
  EXPECT_EQ(twins.stats().failure, "");
}

bool ignore_contact(btManifoldPoint&, const btCollisionObjectWrapper*, int, int,
                    const btCollisionObjectWrapper*, int, int) {
  return false;
}

/// A GPU returns a different NaN for an invalid operation than the CPU.
TEST(OddCollider, MayReturnDifferentNaNs) {
  constexpr btScalar kInf = std::numeric_limits<btScalar>::infinity();
  constexpr btScalar kNan = std::numeric_limits<btScalar>::quiet_NaN();
  const std::vector<btScalar> values = {0, kInf, -kInf, kNan, btScalar(0.5)};
  int nans = 0;
  const auto negate_nans = [&](std::vector<PairContact>* touching) {
    for (PairContact& c : *touching) {
      for (Real* x : {&c.normal.x, &c.normal.y, &c.normal.z, &c.distance}) {
        if (*x == *x) continue;
        ++nans;
        *x = -*x;
      }
    }
  };
  for (const bool observed : {false, true}) {  // both ways of writing contacts
    gContactAddedCallback = observed ? ignore_contact : nullptr;
    Twins twins(with_collider(negate_nans, true));
    twins.both([&](BulletWorld& w) {
      w.world.setGravity(btVector3(0, 0, 0));
      for (std::size_t i = 0; i < values.size(); ++i) {
        w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
      }
      if (observed) w.bodies[0]->setCollisionFlags(btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
    });
    ASSERT_TRUE(twins.dispatch());
    twins.both([&](BulletWorld& w) {
      for (std::size_t i = 0; i < values.size(); ++i) {
        w.bodies[i]->getWorldTransform().setOrigin(btVector3(values[i], 0, values[(i * 2) % 5]));
      }
    });
    const bool same = twins.dispatch();
    gContactAddedCallback = nullptr;
    ASSERT_TRUE(same) << "observed: " << observed;
    EXPECT_GT(twins.stats().verified, 0u);
    EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
  }
  EXPECT_GT(nans, 0);
}

/// Of two NaNs an operation returns the first, and compilers exchange operands.
TEST(Verify, IgnoresTheSignOfANaN) {
  constexpr btScalar kInf = std::numeric_limits<btScalar>::infinity();
  constexpr btScalar kNan = std::numeric_limits<btScalar>::quiet_NaN();
  const std::vector<btScalar> values = {kNan, -kNan, kInf, -kInf, btScalar(0.5)};
  const std::size_t count = values.size() * values.size() * values.size();
  Twins twins(with_collider([](std::vector<PairContact>*) {}, true));
  twins.both([&](BulletWorld& w) {
    for (std::size_t i = 0; i < count; ++i) w.add_sphere(btScalar(0.5), btVector3(0, 0, 0));
  });
  ASSERT_TRUE(twins.dispatch());
  twins.both([&](BulletWorld& w) {
    for (std::size_t i = 0; i < count; ++i) {
      w.bodies[i]->getWorldTransform().setOrigin(
          btVector3(values[i % 5], values[i / 5 % 5], values[i / 25]));
    }
  });
  ASSERT_TRUE(twins.dispatch());
  EXPECT_EQ(twins.stats().verified, count * (count - 1) / 2);
  EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
}

TEST(FailingCollider, NullAndTooManyThreadsAreErrors) {
  btDefaultCollisionConfiguration configuration;
  EXPECT_THROW(
      CollisionDispatcher(&configuration, make_sphere_collider(), {.collider = {.threads = 257}}),
      InvalidArgument);
  EXPECT_THROW(CollisionDispatcher(&configuration, std::unique_ptr<SphereCollider>()),
               InvalidArgument);
}

/// The bits of one value of the first touching pair are changed by one.
template <class Value>
void flip_last_bit(Value* value) {
  using Bits = std::conditional_t<sizeof(Value) == 8, std::uint64_t, std::uint32_t>;
  *value = std::bit_cast<Value>(static_cast<Bits>(std::bit_cast<Bits>(*value) ^ 1u));
}
/// Returns the first touching pair of spheres. Pairs with a box have a NaN, and their values are
/// not read.
std::vector<PairContact>::iterator first_of_spheres(std::vector<PairContact>* touching) {
  return std::find_if(touching->begin(), touching->end(),
                      [](const PairContact& c) { return c.distance == c.distance; });
}
template <class Change>
SpoiledCollider::Spoil in_first_touching(Change change) {
  return [change](std::vector<PairContact>* touching) {
    const auto first = first_of_spheres(touching);
    if (first != touching->end()) change(&*first);
  };
}
void lose_first_touching(std::vector<PairContact>* touching) {
  const auto first = first_of_spheres(touching);
  if (first != touching->end()) touching->erase(first);
}

struct PlantedError {
  const char* name;
  SpoiledCollider::Spoil spoil;
};
const PlantedError kPlantedErrors[] = {
    {"normal.x", in_first_touching([](PairContact* c) { flip_last_bit(&c->normal.x); })},
    {"normal.y", in_first_touching([](PairContact* c) { flip_last_bit(&c->normal.y); })},
    {"normal.z", in_first_touching([](PairContact* c) { flip_last_bit(&c->normal.z); })},
    {"distance", in_first_touching([](PairContact* c) { flip_last_bit(&c->distance); })},
    {"touching", lose_first_touching},
};

TEST(Verify, FindsEveryPlantedError) {
  for (const PlantedError& error : kPlantedErrors) {
    SCOPED_TRACE(error.name);
    Twins twins(with_collider(error.spoil, true));
    twins.both(add_row);
    // The first dispatch runs Bullet's new algorithms; the collider's results are checked from the
    // second on.
    for (int i = 0; i < 2; ++i) {
      twins.ours().dispatcher->dispatchAllCollisionPairs(twins.ours().world.getPairCache(),
                                                         twins.ours().world.getDispatchInfo(),
                                                         twins.ours().dispatcher.get());
      if (i == 0) twins.ours().world.performDiscreteCollisionDetection();
    }
    EXPECT_GT(twins.stats().mismatches, 0u);
    EXPECT_TRUE(twins.stats().first_mismatch.starts_with(error.name))
        << twins.stats().first_mismatch;
  }
}

/// A sphere that rests on a box and on a plane, with points of several steps.
TEST(Verify, RecomputesSpheresOnBoxesAndPlanes) {
  Twins twins(with_collider([](std::vector<PairContact>*) {}, true));
  twins.both([](BulletWorld& w) {
    w.add(w.keep(new btBoxShape(btVector3(5, 1, 5))), btVector3(0, -1, 0), 0);
    w.add(w.keep(new btStaticPlaneShape(btVector3(1, 3, 0).normalized(), btScalar(-0.5))),
          btVector3(0, 0, 0), 0);
    for (int i = 0; i < 5; ++i) {
      w.add_sphere(btScalar(0.5), btVector3(btScalar(i) * btScalar(1.1), btScalar(0.6), 0));
    }
  });
  ASSERT_TRUE(twins.step(60));
  EXPECT_GE(twins.stats().sphere_boxes, 5u * 50u);
  EXPECT_GE(twins.stats().sphere_planes, 5u * 50u);
  EXPECT_GE(twins.stats().verified, twins.stats().sphere_boxes + twins.stats().sphere_planes);
  EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
}

TEST(Verify, FindsEveryPlantedErrorOfAPointThatPersists) {
  BulletWorld w(std::make_unique<btDefaultCollisionConfiguration>(), TwinOptions().stock,
                TwinOptions().broadphase());
  w.add(w.keep(new btBoxShape(btVector3(5, 1, 5))), btVector3(0, -1, 0), 0);
  w.add_sphere(btScalar(0.5), btVector3(0, btScalar(0.49), 0));
  for (int i = 0; i < 5; ++i) w.world.stepSimulation(btScalar(1) / 60, 0);
  ASSERT_EQ(w.dispatcher->getNumManifolds(), 1);
  btPersistentManifold* manifold = w.dispatcher->getManifoldByIndexInternal(0);
  const btPersistentManifold before = *manifold;
  const btBroadphasePair& pair = *w.world.getPairCache()->getOverlappingPairArrayPtr();
  const auto process = [&] {
    w.dispatcher->dispatchAllCollisionPairs(w.world.getPairCache(), w.world.getDispatchInfo(),
                                            w.dispatcher.get());
  };
  const auto difference = [&] {
    const auto found = check_update(*pair.m_algorithm, w.world.getDispatchInfo(), *w.bodies[0],
                                    *w.bodies[1], before, manifold);
    return found ? found->field : "";
  };
  process();
  ASSERT_GT(manifold->getNumContacts(), 0);
  EXPECT_EQ(difference(), "");
  EXPECT_EQ(difference(), "") << "the manifold must be unchanged";
  btManifoldPoint& point = manifold->getContactPoint(0);
  flip_last_bit(&point.m_distance1);
  EXPECT_EQ(difference(), "m_distance1");
  flip_last_bit(&point.m_distance1);
  flip_last_bit(&point.m_localPointB.m_floats[1]);
  EXPECT_EQ(difference(), "m_localPointB.y");
  flip_last_bit(&point.m_localPointB.m_floats[1]);
  ++point.m_lifeTime;
  EXPECT_EQ(difference(), "m_lifeTime");
  manifold->setNumContacts(0);
  EXPECT_EQ(difference(), "number of points");
}

TEST(Verify, FindsNothingInACorrectWorld) {
  Twins twins(with_collider([](std::vector<PairContact>*) {}, true));
  twins.both([](BulletWorld& w) { add_heap(w, 50, 52); });
  ASSERT_TRUE(twins.step(30));
  EXPECT_GT(twins.stats().verified, 1000u);
  EXPECT_EQ(twins.stats().mismatches, 0u) << twins.stats().first_mismatch;
}

TEST(FirstDifference, SeesAPlantedErrorOfTheColliderInTheManifold) {
  for (const PlantedError& error : kPlantedErrors) {
    SCOPED_TRACE(error.name);
    Twins twins(with_collider(error.spoil));
    twins.both(add_row);
    for (BulletWorld* w : {&twins.stock(), &twins.ours()}) {
      w->world.performDiscreteCollisionDetection();
      w->world.performDiscreteCollisionDetection();
    }
    const auto difference = first_difference(twins.stock().world, twins.ours().world, 1);
    ASSERT_TRUE(difference);
    EXPECT_EQ(difference->what, "manifold");
  }
}

}  // namespace
}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
