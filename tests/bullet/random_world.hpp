/// Random Bullet worlds as plain values: generated from a seed, run with two dispatchers side by
/// side, and shrunk while they still fail.
#pragma once

#include "tests/bullet/twin_worlds.hpp"
#include "tests/support/bytes.hpp"

#include <cstdint>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

enum class ShapeKind : std::uint8_t { sphere, box, plane, compound, capsule, mesh, heights };

enum BodyTrait : unsigned {
  kKinematic = 1u << 0,       ///< moves by its velocity, which nothing changes
  kSensor = 1u << 1,          ///< CF_NO_CONTACT_RESPONSE
  kCustomMaterial = 1u << 2,  ///< CF_CUSTOM_MATERIAL_CALLBACK
  kSoftContact = 1u << 3,     ///< contact stiffness and damping
  kFrictionAnchor = 1u << 4,
  kContinuous = 1u << 5,    ///< swept sphere for continuous collision
  kNoSleep = 1u << 6,       ///< DISABLE_DEACTIVATION
  kSleepy = 1u << 7,        ///< high sleeping thresholds
  kAnisotropic = 1u << 8,   ///< anisotropic friction
  kLateComer = 1u << 9,     ///< not in the world at first
  kMargin = 1u << 10,       ///< an own collision margin and contact processing threshold
  kSharesShape = 1u << 11,  ///< one shape object for all spheres of its size; a compound of one
                            ///< child
  kTraitCount = 12,
};

struct RandomBody {
  bool used = true;  ///< shrinking takes bodies out without renumbering the others
  ShapeKind shape = ShapeKind::sphere;
  Real size = 1;  ///< radius, half side, half height, cell of a terrain: [m]
  Vec3 position, velocity, spin;
  Vec3 normal = {0, 1, 0};  ///< of a plane, before its body turns
  Real offset = 0;          ///< of a plane, along its normal: [m]
  Real mass = 1;            ///< 0 is static
  unsigned traits = 0;
  int group = 0, mask = 0;  ///< Bullet's defaults where group is 0
  Real friction = Real(0.5), restitution = 0, rolling = 0;
};

struct RandomJoint {
  std::size_t a = 0, b = 0;
  bool collide = false;        ///< whether the two bodies collide with each other
  Real breaking = Real(1e30);  ///< impulse that breaks it
};

enum class EventKind : std::uint8_t {
  teleport,
  toggle,      ///< takes the body out of the world or puts it in
  radius,      ///< of a sphere: setUnscaledRadius
  scale,       ///< setLocalScaling
  reshape,     ///< to a box and back, with the pairs cleaned
  push,        ///< sets velocities
  activation,  ///< forces an activation state
  ignore,      ///< toggles the ignore list of two bodies
  traits,      ///< toggles sensor and custom material flags
  filter,      ///< other group and mask
  gravity,     ///< of the world
  callbacks,   ///< other global callbacks
  dispatch,    ///< an extra dispatch of the world's pairs
  continuous,  ///< toggles DISPATCH_CONTINUOUS
  order,       ///< toggles m_deterministicOverlappingPairs
  contact_test,
  contact_pair_test,
  deform,  ///< changes heights of a terrain and adapts its tree
};
inline constexpr std::uint64_t kEventKinds = 18;

struct RandomEvent {
  int step = 0;  ///< happens before this step
  EventKind kind = EventKind::teleport;
  std::size_t a = 0, b = 0;  ///< bodies
  Vec3 v;
  Real x = 0;
  unsigned bits = 0;
};

/// The global callbacks and the near callback that are set.
enum CallbackBit : unsigned {
  kAdded = 1u << 0,
  kProcessed = 1u << 1,
  kDestroyed = 1u << 2,
  kStarted = 1u << 3,
  kEnded = 1u << 4,
  kCombine = 1u << 5,
  kNear = 1u << 6,
  kAllCallbacks = (1u << 7) - 1,
};

enum class BroadphaseKind : std::uint8_t { tree, simple, sweep, sorted_pairs };

struct RandomWorld {
  std::uint64_t seed = 0;
  int steps = 0;
  Real scale = 1;  ///< typical radius
  Real dt = Real(1) / 60;
  int sub_steps = 0;
  Vec3 gravity;
  BroadphaseKind broadphase = BroadphaseKind::tree;
  bool deterministic = false, split_islands = true, verify = false;
  std::size_t minimum_batch = 0;
  unsigned threads = 1;  ///< of our dispatcher
  int pool = 64;         ///< manifolds and algorithms before Bullet allocates
  Real breaking_threshold = Real(0.02);
  unsigned callbacks = 0;
  std::vector<RandomBody> bodies;
  std::vector<RandomJoint> joints;
  std::vector<RandomEvent> events;

  std::size_t used_bodies() const;
};

/// The same world for the same seed, in both precisions as far as numbers allow.
RandomWorld make_random_world(std::uint64_t seed);
RandomWorld make_random_world(test::Bytes& bytes);  ///< from the bytes of a fuzzer
/// A complete description of the world in readable form.
std::ostream& operator<<(std::ostream& out, const RandomWorld& world);

using MakeDispatcher = std::unique_ptr<btCollisionDispatcher> (*)(btCollisionConfiguration*,
                                                                  const RandomWorld&);
/// Bullet's dispatcher, and ours with the options of the world.
std::unique_ptr<btCollisionDispatcher> make_stock(btCollisionConfiguration*, const RandomWorld&);
std::unique_ptr<btCollisionDispatcher> make_ours(btCollisionConfiguration*, const RandomWorld&);

struct Failure {
  int step = 0;
  std::string what;
};
struct RunTotals {
  std::uint64_t steps = 0, batches = 0, written = 0, touching = 0, convex_pairs = 0, verified = 0,
                events = 0, sphere_concaves = 0, concave_pairs = 0, compound_pairs = 0;
};

/// Steps two worlds side by side, one of them with `ours`; compares all that first_difference()
/// sees and the logs of all callbacks after each step.
std::optional<Failure> run(const RandomWorld& world, RunTotals* totals,
                           MakeDispatcher ours = make_ours);

/// Removes steps, bodies, joints, events and settings as long as the world fails.
RandomWorld shrink(RandomWorld world, MakeDispatcher ours = make_ours);

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
