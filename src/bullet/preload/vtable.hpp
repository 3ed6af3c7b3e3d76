/// Replacement of virtual functions where symbol lookup does not replace them: in libraries linked
/// with -Bsymbolic-functions, such as Ubuntu's Bullet. Depends on the C library only.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dlfcn.h>
#include <link.h>
#include <sys/mman.h>
#include <unistd.h>

namespace jfpx::preload {

/// Replaces a function in a vtable; has no effect if the vtable does not contain it. The page of
/// the entry remains writable. During the replacement, other threads call either function.
/// @param vtable,original null: no effect
/// @return false if the system does not allow it
inline bool replace_in_vtable(void* vtable, const void* original, void* replacement) {
  if (vtable == nullptr || original == nullptr) return true;
  Dl_info info;
  void* symbol = nullptr;
  if (dladdr1(vtable, &info, &symbol, RTLD_DL_SYMENT) == 0 || symbol == nullptr) return true;
  void** const slots = static_cast<void**>(vtable);
  const std::size_t size = static_cast<const ElfW(Sym)*>(symbol)->st_size / sizeof *slots;
  for (std::size_t i = 0; i < size; ++i) {
    if (slots[i] != original) continue;
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    char* const slot = reinterpret_cast<char*>(&slots[i]);
    char* const start = slot - reinterpret_cast<std::uintptr_t>(slot) % page;
    if (mprotect(start, page, PROT_READ | PROT_WRITE) != 0) return false;
    __atomic_store_n(&slots[i], replacement, __ATOMIC_RELAXED);
  }
  return true;
}

}  // namespace jfpx::preload
