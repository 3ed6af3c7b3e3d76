/// libjfpx-bullet-preload.so: replaces dispatch, solver and AABB update of unmodified, dynamically
/// linked Bullet programs by those of jfpx.
///
/// With LD_PRELOAD, symbol lookup finds its definitions before Bullet's, also for the vtables in
/// Bullet's libraries. If these are linked with -Bsymbolic-functions, as on Ubuntu, this library
/// changes the vtables instead. This file depends on neither Bullet nor the C++ library, because it
/// is loaded into programs without them. The first call of one of the functions by Bullet loads the
/// engine of the matching precision.
#include "src/bullet/preload/preload_engine.hpp"
#include "src/bullet/preload/vtable.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <initializer_list>
#include <pthread.h>

#define JFPX_DISPATCH                                           \
  "_ZN21btCollisionDispatcher25dispatchAllCollisionPairsEP22bt" \
  "OverlappingPairCacheRK16btDispatcherInfoP12btDispatcher"
#define JFPX_SOLVE                                                                            \
  "_ZN35btSequentialImpulseConstraintSolver10solveGroupEPP17btCollisionObjectiPP20btPersiste" \
  "ntManifoldiPP17btTypedConstraintiRK19btContactSolverInfoP12btIDebugDrawP12btDispatcher"
#define JFPX_UPDATE_BOXES "_ZN16btCollisionWorld11updateAabbsEv"

#define JFPX_EXPORT extern "C" __attribute__((visibility("default")))

JFPX_EXPORT void jfpx_preload_dispatch(void* dispatcher, void* pair_cache, const void* info,
                                       void* argument) __asm__(JFPX_DISPATCH);
JFPX_EXPORT double jfpx_preload_solve(void* solver, void** bodies, int body_count, void** manifolds,
                                      int manifold_count, void** joints, int joint_count,
                                      const void* info, void* drawer,
                                      void* dispatcher) __asm__(JFPX_SOLVE);
JFPX_EXPORT void jfpx_preload_update_boxes(void* world) __asm__(JFPX_UPDATE_BOXES);

namespace {

using namespace jfpx::preload;

/// A function of Bullet that this library also defines. Resolved at its first call.
struct Function {
  const char* symbol;
  const char* part;  ///< its name in JFPX_PRELOAD_PARTS
  const char *library, *library_f64;
  const char* attempt_symbol;  ///< in the engine
  const char* vtable;          ///< symbol of the vtable of its class
  void* replacement;           ///< the definition in this library
  pthread_once_t found = PTHREAD_ONCE_INIT;
  void* original = nullptr;
  bool is_private = false;  ///< loaded with RTLD_LOCAL; other copies may exist
  const void* base = nullptr;
  void* attempt = nullptr;  ///< null if Bullet's function is always used
};
Function g_dispatch{.symbol = JFPX_DISPATCH,
                    .part = "dispatcher",
                    .library = JFPX_BULLET_COLLISION_F32,
                    .library_f64 = JFPX_BULLET_COLLISION_F64,
                    .attempt_symbol = kTryDispatch,
                    .vtable = "_ZTV21btCollisionDispatcher",
                    .replacement = reinterpret_cast<void*>(jfpx_preload_dispatch)};
Function g_solve{.symbol = JFPX_SOLVE,
                 .part = "solver",
                 .library = JFPX_BULLET_DYNAMICS_F32,
                 .library_f64 = JFPX_BULLET_DYNAMICS_F64,
                 .attempt_symbol = kTrySolve,
                 .vtable = "_ZTV35btSequentialImpulseConstraintSolver",
                 .replacement = reinterpret_cast<void*>(jfpx_preload_solve)};
Function g_update_boxes{.symbol = JFPX_UPDATE_BOXES,
                        .part = "world",
                        .library = JFPX_BULLET_COLLISION_F32,
                        .library_f64 = JFPX_BULLET_COLLISION_F64,
                        .attempt_symbol = kTryUpdateBoxes,
                        .vtable = "_ZTV16btCollisionWorld",
                        .replacement = reinterpret_cast<void*>(jfpx_preload_update_boxes)};

pthread_mutex_t g_mutex = PTHREAD_MUTEX_INITIALIZER;
PrintSummary g_print_summary = nullptr;
char g_reason[512] = "Bullet was not used";
thread_local Function* t_function = nullptr;
thread_local const void* t_caller = nullptr;

const char* file_name(const char* path) {
  const char* slash = std::strrchr(path, '/');
  return slash == nullptr ? path : slash + 1;
}

/// Whether JFPX_PRELOAD_PARTS lists the part or is not set.
bool is_enabled(const char* part) {
  const char* at = std::getenv("JFPX_PRELOAD_PARTS");
  if (at == nullptr || *at == '\0') return true;
  const std::size_t length = std::strlen(part);
  for (;; ++at) {
    const char* end = std::strchr(at, ',');
    const std::size_t item = end == nullptr ? std::strlen(at) : static_cast<std::size_t>(end - at);
    if (item == length && std::strncmp(at, part, length) == 0) return true;
    if (end == nullptr) return false;
    at = end;
  }
}

/// The definition that the caller's library would use without this library, if it is private.
void* private_definition(const char* symbol, const void* caller) {
  Dl_info info;
  if (dladdr(caller, &info) == 0) return nullptr;
  void* library = dlopen(info.dli_fname, RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return nullptr;
  // The handle is not closed, because the library is in use: it calls Bullet.
  return dlsym(library, symbol);
}

/// The next definition after the one in this library, for the caller.
void* definition(const char* symbol, const void* caller, bool* is_private) {
  void* next = dlsym(RTLD_NEXT, symbol);
  *is_private = next == nullptr;
  return next != nullptr ? next : private_definition(symbol, caller);
}

/// Replaces the functions in the vtables of their classes, unless symbol lookup has replaced them.
/// @param caller null: in the libraries with which the program was started
void replace_in_vtables(const void* caller) {
  for (const Function* function : {&g_dispatch, &g_solve, &g_update_boxes}) {
    // A program may have its own copy of the vtable, which the library then uses.
    void* vtable = dlsym(RTLD_DEFAULT, function->vtable);
    if (vtable == nullptr) vtable = private_definition(function->vtable, caller);
    if (vtable == nullptr) continue;
    bool is_private = false;
    const void* const original = definition(function->symbol, caller, &is_private);
    if (replace_in_vtable(vtable, original, function->replacement)) continue;
    std::snprintf(g_reason, sizeof g_reason, "left to Bullet: the %s's vtable can't be changed: %s",
                  function->part, std::strerror(errno));
  }
  dlerror();  // clears the errors of missing symbols
}
__attribute__((constructor)) void start() { replace_in_vtables(nullptr); }

/// The engine for the precision of the Bullet library that contains the function. Null, with a
/// reason in g_reason, if the engines were compiled for another version, whose class layout may
/// differ.
const char* engine_for(const Function& function, const void* address) {
  Dl_info info;
  if (dladdr(address, &info) == 0) return nullptr;
  const char* library = file_name(info.dli_fname);
  if (std::strcmp(library, function.library) == 0) return JFPX_ENGINE;
  if (std::strcmp(library, function.library_f64) == 0) return JFPX_ENGINE_F64;
  std::snprintf(g_reason, sizeof g_reason, "left to Bullet: %s is neither %s nor %s",
                info.dli_fname, function.library, function.library_f64);
  return nullptr;
}

/// The engine for the function and for all others that the caller can reach. All must use the same
/// engine, because Bullet's libraries share their classes.
const char* common_engine(const Function& function, const void* caller) {
  const char* engine = engine_for(function, function.original);
  for (const Function* other : {&g_dispatch, &g_solve, &g_update_boxes}) {
    bool is_private = false;
    const void* address = definition(other->symbol, caller, &is_private);
    if (address != nullptr && engine_for(*other, address) != engine) return nullptr;
  }
  return engine;
}

void load_engine(Function* function, const char* engine) {
  Dl_info self;
  dladdr(reinterpret_cast<const void*>(&g_mutex), &self);
  char path[4096];
  const int folder = static_cast<int>(file_name(self.dli_fname) - self.dli_fname);
  std::snprintf(path, sizeof path, "%.*s%s", folder, self.dli_fname, engine);
  void* handle = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    std::snprintf(g_reason, sizeof g_reason, "left to Bullet: %s", dlerror());
    return;
  }
  g_print_summary = reinterpret_cast<PrintSummary>(dlsym(handle, kPrintSummary));
  function->attempt = dlsym(handle, function->attempt_symbol);
}

void find_function() {
  Function& function = *t_function;
  function.original = definition(function.symbol, t_caller, &function.is_private);
  Dl_info info;
  if (function.original == nullptr || dladdr(function.original, &info) == 0) {
    // A caller reached the definition in this library, so Bullet's own must exist.
    std::fprintf(stderr, "jfpx preload: symbol %s of Bullet is not found\n", function.symbol);
    std::abort();
  }
  function.base = info.dli_fbase;
  pthread_mutex_lock(&g_mutex);
  replace_in_vtables(t_caller);  // Bullet may have been loaded after the program's start
  const char* engine = is_enabled(function.part) ? common_engine(function, t_caller) : nullptr;
  if (engine != nullptr) load_engine(&function, engine);
  pthread_mutex_unlock(&g_mutex);
}

/// The functions for a caller: `attempt`, which may be null, and `original`, used if the attempt
/// returns false.
template <class Attempt, class Original>
struct Choice {
  Attempt attempt;
  Original original;
};
template <class Attempt, class Original>
Choice<Attempt, Original> choose(Function* function, const void* caller) {
  t_function = function;
  t_caller = caller;
  pthread_once(&function->found, find_function);
  if (function->is_private) {
    void* callers = private_definition(function->symbol, caller);
    Dl_info library;
    if (callers != nullptr && callers != function->original && dladdr(callers, &library) != 0 &&
        library.dli_fbase != function->base) {
      return {nullptr, reinterpret_cast<Original>(callers)};  // a second Bullet in this process
    }
  }
  return {reinterpret_cast<Attempt>(function->attempt),
          reinterpret_cast<Original>(function->original)};
}

/// Prints the summary at exit if JFPX_PRELOAD_SUMMARY is set.
__attribute__((destructor)) void summarise() {
  const char* setting = std::getenv("JFPX_PRELOAD_SUMMARY");
  if (setting == nullptr || *setting == '\0' || std::strcmp(setting, "0") == 0) return;
  char prefix[256];
  std::snprintf(prefix, sizeof prefix, "jfpx preload: %s: ", program_invocation_short_name);
  if (g_print_summary != nullptr) {
    g_print_summary(prefix);
  } else {
    std::fprintf(stderr, "%s%s\n", prefix, g_reason);
  }
}

}  // namespace

void jfpx_preload_dispatch(void* dispatcher, void* pair_cache, const void* info, void* argument) {
  using Original = void (*)(void*, void*, const void*, void*);
  const auto [attempt, original] =
      choose<TryDispatch, Original>(&g_dispatch, __builtin_return_address(0));
  if (attempt != nullptr && attempt(dispatcher, pair_cache, info, argument)) return;
  original(dispatcher, pair_cache, info, argument);
}

/// Bullet's function returns a float or a double in the same register, which is passed through
/// unchanged; its value is always 0.
double jfpx_preload_solve(void* solver, void** bodies, int body_count, void** manifolds,
                          int manifold_count, void** joints, int joint_count, const void* info,
                          void* drawer, void* dispatcher) {
  using Original =
      double (*)(void*, void**, int, void**, int, void**, int, const void*, void*, void*);
  const auto [attempt, original] =
      choose<TrySolve, Original>(&g_solve, __builtin_return_address(0));
  if (attempt != nullptr && attempt(solver, bodies, body_count, manifolds, manifold_count, joints,
                                    joint_count, info, drawer, dispatcher)) {
    return 0;
  }
  return original(solver, bodies, body_count, manifolds, manifold_count, joints, joint_count, info,
                  drawer, dispatcher);
}

void jfpx_preload_update_boxes(void* world) {
  using Original = void (*)(void*);
  const auto [attempt, original] =
      choose<TryUpdateBoxes, Original>(&g_update_boxes, __builtin_return_address(0));
  if (attempt != nullptr && attempt(world)) return;
  original(world);
}
