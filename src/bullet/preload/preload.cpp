/// libjfpx-bullet-preload.so: replaces dispatch, solver and AABB update of unmodified, dynamically
/// linked Bullet programs by those of jfpx.
///
/// With LD_PRELOAD, symbol lookup finds its definitions before Bullet's, also for the vtables in
/// Bullet's libraries. If these are linked with -Bsymbolic-functions, as on Ubuntu, this library
/// changes the vtables instead. This file depends on neither Bullet nor the C++ library, because it
/// is loaded into programs without them. The first call of one of the functions by Bullet loads the
/// engine of the matching precision.
#include "src/bullet/preload/own_stack.hpp"
#include "src/bullet/preload/preload_engine.hpp"
#include "src/bullet/preload/static_bullet.hpp"
#include "src/bullet/preload/vtable.hpp"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <fcntl.h>
#include <initializer_list>
#include <pthread.h>
#include <unistd.h>

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
char g_reason[512] = "";   ///< why no engine was loaded; empty if no function was called
FILE* g_stderr = nullptr;  ///< a copy of stderr, which programs may close before the summary
thread_local Function* t_function = nullptr;
thread_local const void* t_caller = nullptr;

const char* file_name(const char* path) {
  const char* slash = std::strrchr(path, '/');
  return slash == nullptr ? path : slash + 1;
}

/// Calls visit(item, length) for the items of a list that is separated by commas, until it returns
/// true. @return whether it has
template <class Visit>
bool any_item(const char* list, const Visit& visit) {
  for (const char* at = list;; ++at) {
    const std::size_t length = std::strcspn(at, ",");
    if (visit(at, length)) return true;
    at += length;
    if (*at == '\0') return false;
  }
}

/// JFPX_PRELOAD_PARTS; null if it is not set or names an unknown part, which is reported once.
const char* enabled_parts() {
  static bool s_is_reported = false;  // g_mutex is locked
  const char* const list = std::getenv("JFPX_PRELOAD_PARTS");
  if (list == nullptr || *list == '\0') return nullptr;
  const bool is_unknown = any_item(list, [](const char* item, std::size_t length) {
    for (const Function* known : {&g_dispatch, &g_solve, &g_update_boxes}) {
      if (std::strlen(known->part) == length && std::strncmp(item, known->part, length) == 0) {
        return false;
      }
    }
    return true;
  });
  if (!is_unknown) return list;
  if (!s_is_reported) {
    std::fprintf(stderr,
                 "jfpx preload: JFPX_PRELOAD_PARTS is \"%s\"; it must be a list of dispatcher, "
                 "solver and world. The value is ignored.\n",
                 list);
  }
  s_is_reported = true;
  return nullptr;
}

bool is_enabled(const char* part) {
  const char* const list = enabled_parts();
  return list == nullptr || any_item(list, [part](const char* item, std::size_t length) {
           return std::strlen(part) == length && std::strncmp(item, part, length) == 0;
         });
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
bool wants_summary() {
  const char* setting = std::getenv("JFPX_PRELOAD_SUMMARY");
  return setting != nullptr && *setting != '\0' && std::strcmp(setting, "0") != 0;
}

__attribute__((constructor)) void start() {
  replace_in_vtables(nullptr);
  // A high number, so that files that the program opens have the numbers that they have without.
  constexpr int kLowestCopy = 200;
  if (!wants_summary()) return;
  const int copy = fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, kLowestCopy);
  if (copy >= 0) g_stderr = fdopen(copy, "w");
}

/// Whether the library of Bullet is of the precision that its name denotes. Only the libraries of
/// Debian have a name for each precision.
bool has_precision_of_name(const char* path, bool is_double) {
  void* const library = dlopen(path, RTLD_LAZY | RTLD_NOLOAD);
  if (library == nullptr) return true;
  constexpr const char* kFunctions[] = {"_ZN15btConvex2dShape9setMarginEf",
                                        "_ZN15btConvex2dShape9setMarginEd"};
  const bool has_other = dlsym(library, kFunctions[is_double ? 0 : 1]) != nullptr;
  dlclose(library);
  dlerror();
  return !has_other;
}

/// The engine for the precision of the Bullet library that contains the function. Null, with a
/// reason in g_reason, if the engines were compiled for another version, whose class layout may
/// differ.
const char* engine_for(const Function& function, const void* address) {
  Dl_info info;
  if (dladdr(address, &info) == 0) return nullptr;
  const char* library = file_name(info.dli_fname);
  const bool is_double = std::strcmp(library, function.library_f64) == 0;
  if (is_double || std::strcmp(library, function.library) == 0) {
    if (has_precision_of_name(info.dli_fname, is_double)) {
      return is_double ? JFPX_ENGINE_F64 : JFPX_ENGINE;
    }
    std::snprintf(g_reason, sizeof g_reason,
                  "left to Bullet: %s is Bullet in %s, and jfpx was built with Bullet in %s under "
                  "this name",
                  info.dli_fname, is_double ? "float" : "double", is_double ? "double" : "float");
    return nullptr;
  }
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
    if (address == nullptr) continue;
    const char* const others = engine_for(*other, address);
    if (others == engine) continue;
    if (engine != nullptr && others != nullptr) {
      std::snprintf(g_reason, sizeof g_reason,
                    "left to Bullet: the program has libraries of Bullet in float and in double");
    }
    return nullptr;
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
  if (is_enabled(function.part)) {
    const char* engine = common_engine(function, t_caller);
    if (engine != nullptr) load_engine(&function, engine);
  } else if (g_reason[0] == '\0') {
    std::snprintf(g_reason, sizeof g_reason,
                  "left to Bullet: JFPX_PRELOAD_PARTS contains no part that the program uses");
  }
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
  pthread_once(&function->found, [] { OwnStack::call([] { find_function(); }); });
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
  if (!wants_summary()) return;
  char prefix[256];
  std::snprintf(prefix, sizeof prefix, "jfpx preload: %s: ", program_invocation_short_name);
  const bool is_closed = fileno(stderr) < 0 || fcntl(fileno(stderr), F_GETFD) < 0;
  FILE* const to = is_closed ? g_stderr : stderr;
  if (to == nullptr) return;
  char file[256];
  if (g_print_summary != nullptr) {
    g_print_summary(to, prefix);
  } else if (g_reason[0] != '\0') {
    std::fprintf(to, "%s%s\n", prefix, g_reason);
  } else if (StaticBullet::find(file, sizeof file)) {
    std::fprintf(to, "%sleft to Bullet, which is statically linked in %s\n", prefix, file);
  } else {
    std::fprintf(to, "%sno shared library of Bullet was used\n", prefix);
  }
  std::fflush(to);
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
