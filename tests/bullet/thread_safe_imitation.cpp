/// Imitates a Bullet library with BT_THREADSAFE by the effect that jfpx detects: replaces the
/// constructor of btDbvtBroadphase by one that reserves the ray test stacks of all threads.
#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <LinearMath/btThreads.h>

#include <dlfcn.h>

#define JFPX_CONSTRUCTOR "_ZN16btDbvtBroadphaseC1EP22btOverlappingPairCache"

extern "C" __attribute__((visibility("default"))) void jfpx_test_construct(
    btDbvtBroadphase* tree, btOverlappingPairCache* cache) __asm__(JFPX_CONSTRUCTOR);

void jfpx_test_construct(btDbvtBroadphase* tree, btOverlappingPairCache* cache) {
  using Constructor = void (*)(btDbvtBroadphase*, btOverlappingPairCache*);
  static const auto original = reinterpret_cast<Constructor>(dlsym(RTLD_NEXT, JFPX_CONSTRUCTOR));
  original(tree, cache);
  tree->m_rayTestStacks.resize(static_cast<int>(BT_MAX_THREAD_COUNT));
}
