/// Callbacks that log their calls, and a function of Bullet that is replaced.
#include "tests/bullet/random_world_globals.hpp"

#include "tests/bullet/stack_bytes.hpp"

#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>

#if defined(_WIN32)
#include <cstddef>
#include <windows.h>
#else
#include "src/bullet/preload/vtable.hpp"

#include <dlfcn.h>
#endif

#define JFPX_PROCESS_COLLISION                          \
  "_ZN23btConvexConvexAlgorithm16processCollisionEPK24" \
  "btCollisionObjectWrapperS2_RK16btDispatcherInfoP16btManifoldResult"

// The function of Bullet's library is replaced in its virtual table, for both worlds. Bullet's
// reads variables that it has not set: the points of a simplex without vertices, if GJK ends before
// its first one because a squared distance exceeds BT_LARGE_FLOAT (1e18 in float, 1e30 in double),
// and the fourth component of a normal, for a capsule and a sphere with the same centre. Here they
// are 0, whatever the process, the compiler or the other world has left on the stack.
namespace {

using ProcessCollision = void (*)(btConvexConvexAlgorithm*, const btCollisionObjectWrapper*,
                                  const btCollisionObjectWrapper*, const btDispatcherInfo&,
                                  btManifoldResult*);

inline void process_with_clear_stack(ProcessCollision original, btConvexConvexAlgorithm* algorithm,
                                     const btCollisionObjectWrapper* a,
                                     const btCollisionObjectWrapper* b,
                                     const btDispatcherInfo& info, btManifoldResult* result) {
  jfpx::bullet::fill_stack(0);
  original(algorithm, a, b, info, result);
  asm volatile("");  // no tail call: the frame must begin where fill_stack() did
}

}  // namespace

#if defined(_WIN32)
// Bullet is linked statically, and a member function is called as a function of the object is.
extern "C" {
extern void* g_vtable[] asm("_ZTV23btConvexConvexAlgorithm");
void original_process_collision(btConvexConvexAlgorithm*, const btCollisionObjectWrapper*,
                                const btCollisionObjectWrapper*, const btDispatcherInfo&,
                                btManifoldResult*) asm(JFPX_PROCESS_COLLISION);
}

namespace {

void process_collision(btConvexConvexAlgorithm* algorithm, const btCollisionObjectWrapper* a,
                       const btCollisionObjectWrapper* b, const btDispatcherInfo& info,
                       btManifoldResult* result) {
  process_with_clear_stack(original_process_collision, algorithm, a, b, info, result);
}

[[maybe_unused]] const bool g_is_replaced = [] {
  constexpr std::size_t kSlots = 7;  // offset, type, two destructors, and three functions
  for (std::size_t i = 2; i < kSlots; ++i) {
    if (g_vtable[i] != reinterpret_cast<void*>(original_process_collision)) continue;
    DWORD before = 0;
    if (VirtualProtect(&g_vtable[i], sizeof g_vtable[i], PAGE_READWRITE, &before) == 0)
      return false;
    g_vtable[i] = reinterpret_cast<void*>(process_collision);
    return true;
  }
  return false;
}();

}  // namespace
#else
[[gnu::visibility("default")]] void btConvexConvexAlgorithm::processCollision(
    const btCollisionObjectWrapper* a, const btCollisionObjectWrapper* b,
    const btDispatcherInfo& info, btManifoldResult* result) {
  static const auto original =
      reinterpret_cast<ProcessCollision>(dlsym(RTLD_NEXT, JFPX_PROCESS_COLLISION));
  process_with_clear_stack(original, this, a, b, info, result);
}

namespace {
/// Where symbol lookup does not replace it.
[[maybe_unused]] const bool g_is_replaced = jfpx::preload::replace_in_vtable(
    dlsym(RTLD_DEFAULT, "_ZTV23btConvexConvexAlgorithm"), dlsym(RTLD_NEXT, JFPX_PROCESS_COLLISION),
    dlsym(RTLD_DEFAULT, JFPX_PROCESS_COLLISION));
}  // namespace
#endif

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {
namespace {

bool on_added(btManifoldPoint& point, const btCollisionObjectWrapper* a, int part_a, int index_a,
              const btCollisionObjectWrapper* b, int part_b, int index_b) {
  log_event("added " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            " " + bits_of(point.m_distance1) + " " + bits_of(point.m_combinedFriction) + " " +
            std::to_string(part_a + part_b) + " " + std::to_string(index_a) + " " +
            std::to_string(index_b));
  point.m_combinedFriction *= btScalar(0.5);
  point.m_userPersistentData = const_cast<btCollisionObject*>(a->getCollisionObject());
  return true;
}
bool on_processed(btManifoldPoint& point, void* a, void* b) {
  log_event("processed " + name_of(static_cast<btCollisionObject*>(a)) + " " +
            name_of(static_cast<btCollisionObject*>(b)) + " " + bits_of(point.m_distance1));
  return true;
}
bool on_destroyed(void* data) {
  log_event("destroyed " + name_of(static_cast<btCollisionObject*>(data)));
  return true;
}
void on_started(btPersistentManifold* const& manifold) {
  log_event("started " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}
void on_ended(btPersistentManifold* const& manifold) {
  log_event("ended " + name_of(manifold->getBody0()) + " " + name_of(manifold->getBody1()) + " " +
            std::to_string(manifold->getNumContacts()));
}
btScalar sum_of_frictions(const btCollisionObject* a, const btCollisionObject* b) {
  log_event("combine " + name_of(a) + " " + name_of(b));
  return a->getFriction() + b->getFriction();
}
}  // namespace

void logging_near_callback(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                           const btDispatcherInfo& info) {
  log_event("near " + name_of(static_cast<btCollisionObject*>(pair.m_pProxy0->m_clientObject)) +
            " " + name_of(static_cast<btCollisionObject*>(pair.m_pProxy1->m_clientObject)));
  btCollisionDispatcher::defaultNearCallback(pair, dispatcher, info);
}

btScalar LoggingReport::addSingleResult(btManifoldPoint& point, const btCollisionObjectWrapper* a,
                                        int, int i, const btCollisionObjectWrapper* b, int, int j) {
  log_event("tested " + name_of(a->getCollisionObject()) + " " + name_of(b->getCollisionObject()) +
            " " + bits_of(point.m_distance1) + " " + std::to_string(i) + " " + std::to_string(j));
  return 0;
}

// set_verify() calls combine callbacks twice, as documented.
Globals::Globals(const RandomWorld& world) : allowed_(world.verify ? ~unsigned{kCombine} : ~0u) {
  gContactBreakingThreshold = world.breaking_threshold;
  gDeactivationTime = btScalar(0.15);  // runs are too short for two seconds
  set_callbacks(world.callbacks);
}

Globals::~Globals() {
  set_callbacks(0);
  gContactBreakingThreshold = breaking_threshold_;
  gDeactivationTime = deactivation_time_;
}

void Globals::set_callbacks(unsigned bits) {
  bits &= allowed_;
  gContactAddedCallback = (bits & kAdded) != 0 ? on_added : nullptr;
  gContactProcessedCallback = (bits & kProcessed) != 0 ? on_processed : nullptr;
  gContactDestroyedCallback = (bits & kDestroyed) != 0 ? on_destroyed : nullptr;
  gContactStartedCallback = (bits & kStarted) != 0 ? on_started : nullptr;
  gContactEndedCallback = (bits & kEnded) != 0 ? on_ended : nullptr;
  gCalculateCombinedFrictionCallback = (bits & kCombine) != 0 ? sum_of_frictions : friction_;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
