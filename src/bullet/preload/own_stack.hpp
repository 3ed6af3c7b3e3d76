/// Calls of functions on a large stack. Depends on the C library only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <sys/mman.h>
#include <ucontext.h>

namespace jfpx::preload {

/// A call on a stack of its own: loading a library or reading a file takes more stack than some
/// programs give their threads. Another thread cannot make these calls, because the calling thread
/// may hold the lock of the run-time linker.
class OwnStack {
 public:
  /// Calls the function, on the stack of the caller if there is no memory.
  /// @param body must not throw
  template <class Body>
  static void call(const Body& body) {
    call([](const void* function) { (*static_cast<const Body*>(function))(); }, &body);
  }

 private:
  using Function = void (*)(const void* argument);
  struct Memory {
    ucontext_t caller, callee;  // a kilobyte each
    Function function;
    const void* argument;
    alignas(16) char stack[std::size_t{1} << 20];
  };

  static void call(Function function, const void* argument) {
    void* const pages = mmap(nullptr, sizeof(Memory), PROT_READ | PROT_WRITE,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (pages == MAP_FAILED) {
      function(argument);
      return;
    }
    auto* const memory = static_cast<Memory*>(pages);
    memory->function = function;
    memory->argument = argument;
    getcontext(&memory->callee);
    memory->callee.uc_stack.ss_sp = memory->stack;
    memory->callee.uc_stack.ss_size = sizeof memory->stack;
    memory->callee.uc_link = &memory->caller;
    // The arguments of the entry are of type int.
    const auto address = reinterpret_cast<std::uintptr_t>(memory);
    makecontext(&memory->callee, reinterpret_cast<void (*)()>(enter), 2,
                static_cast<unsigned>(address >> 32), static_cast<unsigned>(address));
    swapcontext(&memory->caller, &memory->callee);
    munmap(pages, sizeof(Memory));
  }
  static void enter(unsigned high, unsigned low) {
    const auto address = std::uintptr_t{high} << 32 | low;
    const auto* const memory = reinterpret_cast<const Memory*>(address);
    memory->function(memory->argument);
  }
};

}  // namespace jfpx::preload
