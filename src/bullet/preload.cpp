/// libjfpx-bullet-preload.so: gives unmodified, dynamically linked Bullet programs jfpx's dispatch.
///
/// Listed in LD_PRELOAD, its definition of btCollisionDispatcher::dispatchAllCollisionPairs comes
/// before Bullet's in symbol lookup, also for the vtable inside Bullet's library, which is not
/// linked with -Bsymbolic. This file needs no Bullet and no C++ library, because it is loaded into
/// programs that have neither; the engine of the right precision is loaded at the first dispatch.
#include "src/bullet/preload_engine.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <pthread.h>

#define JFPX_DISPATCH                                           \
  "_ZN21btCollisionDispatcher25dispatchAllCollisionPairsEP22bt" \
  "OverlappingPairCacheRK16btDispatcherInfoP12btDispatcher"

namespace {

using namespace jfpx::preload;
using Dispatch = void (*)(void* dispatcher, void* pair_cache, const void* info, void* argument);

/// The Bullet of this process, found at the first dispatch.
struct Bullet {
  Dispatch dispatch = nullptr;
  bool is_private = false;  ///< loaded with RTLD_LOCAL, so that others may exist beside it
  const void* base = nullptr;
  TryDispatch try_dispatch = nullptr;  ///< null if left to Bullet as a whole
  PrintSummary print_summary = nullptr;
  char reason[512] = "Bullet's dispatcher was not used";
};
Bullet g_bullet;
pthread_once_t g_found = PTHREAD_ONCE_INIT;
thread_local const void* t_caller = nullptr;

const char* file_name(const char* path) {
  const char* slash = std::strrchr(path, '/');
  return slash == nullptr ? path : slash + 1;
}

/// The definition that the caller's library would use without this one, if it is no global one.
Dispatch private_dispatch(const void* caller) {
  Dl_info info;
  if (dladdr(caller, &info) == 0) return nullptr;
  void* library = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return nullptr;
  // The handle is kept: a library that calls the dispatcher is in use.
  return reinterpret_cast<Dispatch>(dlsym(library, JFPX_DISPATCH));
}

/// The engine for the precision of the given Bullet library; null if it is not one that the engines
/// were compiled for, whose classes may be laid out in another way.
const char* engine_for(const char* library) {
  if (std::strcmp(library, JFPX_BULLET_SONAME) == 0) return JFPX_ENGINE;
  if (std::strcmp(library, JFPX_BULLET_SONAME_F64) == 0) return JFPX_ENGINE_F64;
  return nullptr;
}

void load_engine(const char* library) {
  const char* engine = engine_for(file_name(library));
  if (engine == nullptr) {
    std::snprintf(g_bullet.reason, sizeof g_bullet.reason,
                  "left to Bullet: %s is neither " JFPX_BULLET_SONAME
                  " nor " JFPX_BULLET_SONAME_F64,
                  library);
    return;
  }
  Dl_info self;
  dladdr(reinterpret_cast<const void*>(&g_bullet), &self);
  char path[4096];
  const int folder = static_cast<int>(file_name(self.dli_fname) - self.dli_fname);
  std::snprintf(path, sizeof path, "%.*s%s", folder, self.dli_fname, engine);
  void* handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    std::snprintf(g_bullet.reason, sizeof g_bullet.reason, "left to Bullet: %s", dlerror());
    return;
  }
  g_bullet.print_summary = reinterpret_cast<PrintSummary>(dlsym(handle, kPrintSummary));
  g_bullet.try_dispatch = reinterpret_cast<TryDispatch>(dlsym(handle, kTryDispatch));
}

void find_bullet() {
  g_bullet.dispatch = reinterpret_cast<Dispatch>(dlsym(RTLD_NEXT, JFPX_DISPATCH));
  if (g_bullet.dispatch == nullptr) {
    g_bullet.is_private = true;
    g_bullet.dispatch = private_dispatch(t_caller);
  }
  Dl_info info;
  if (g_bullet.dispatch == nullptr ||
      dladdr(reinterpret_cast<const void*>(g_bullet.dispatch), &info) == 0) {
    // Somebody called the function that is defined here, so a definition behind it must exist.
    std::fprintf(stderr, "jfpx preload: Bullet's dispatchAllCollisionPairs can't be found\n");
    std::abort();
  }
  g_bullet.base = info.dli_fbase;
  load_engine(info.dli_fname);
}

/// Reports at exit when the environment asks for it.
__attribute__((destructor)) void summarise() {
  const char* asked = std::getenv("JFPX_PRELOAD_SUMMARY");
  if (asked == nullptr || *asked == '\0' || std::strcmp(asked, "0") == 0) return;
  char prefix[256];
  std::snprintf(prefix, sizeof prefix, "jfpx preload: %s: ", program_invocation_short_name);
  if (g_bullet.print_summary != nullptr) {
    g_bullet.print_summary(prefix);
  } else {
    std::fprintf(stderr, "%s%s\n", prefix, g_bullet.reason);
  }
}

}  // namespace

extern "C" __attribute__((visibility("default"))) void jfpx_preload_dispatch(
    void* dispatcher, void* pair_cache, const void* info, void* argument) __asm__(JFPX_DISPATCH);

void jfpx_preload_dispatch(void* dispatcher, void* pair_cache, const void* info, void* argument) {
  t_caller = __builtin_return_address(0);
  pthread_once(&g_found, find_bullet);
  if (g_bullet.is_private) {
    const Dispatch callers = private_dispatch(t_caller);
    Dl_info library;
    if (callers != nullptr && callers != g_bullet.dispatch &&
        dladdr(reinterpret_cast<const void*>(callers), &library) != 0 &&
        library.dli_fbase != g_bullet.base) {
      callers(dispatcher, pair_cache, info, argument);  // a second Bullet in this process
      return;
    }
  }
  if (g_bullet.try_dispatch != nullptr &&
      g_bullet.try_dispatch(dispatcher, pair_cache, info, argument)) {
    return;
  }
  g_bullet.dispatch(dispatcher, pair_cache, info, argument);
}
