/// Search for a statically linked Bullet in the running program and its libraries. Depends on the
/// C library only.
#pragma once

#include <cstddef>
#include <cstring>
#include <dlfcn.h>
#include <link.h>

namespace jfpx::preload {

/// Finds the name that the type_info of btCollisionDispatcher refers to. It is in a file exactly if
/// the file contains Bullet compiled with RTTI, even without symbols.
class StaticBullet {
 public:
  /// @param text receives the path of a file that contains a Bullet that no symbol lookup reaches
  /// @return whether there is one
  static bool find(char* text, std::size_t size) {
    StaticBullet search{text, size, dlsym(RTLD_DEFAULT, "_ZTS21btCollisionDispatcher")};
    dlerror();  // clears the error of a missing symbol
    return dl_iterate_phdr(visit, &search) != 0;
  }

 private:
  static constexpr char kName[] = "21btCollisionDispatcher";

  StaticBullet(char* text, std::size_t size, const void* shared)
      : text_(text), size_(size), shared_(shared) {}

  static int visit(dl_phdr_info* info, std::size_t, void* self) {
    return static_cast<StaticBullet*>(self)->visit(*info) ? 1 : 0;
  }
  bool visit(const dl_phdr_info& info) {
    Dl_info own;
    if (dladdr(kName, &own) != 0 && info.dlpi_addr == reinterpret_cast<ElfW(Addr)>(own.dli_fbase)) {
      return false;  // contains the constant above
    }
    if (std::strstr(info.dlpi_name, "/libBullet") != nullptr) return false;
    for (int i = 0; i < info.dlpi_phnum; ++i) {
      const ElfW(Phdr)& part = info.dlpi_phdr[i];
      if (part.p_type != PT_LOAD || (part.p_flags & (PF_R | PF_W)) != PF_R) continue;
      if (!contains_name(reinterpret_cast<const char*>(info.dlpi_addr + part.p_vaddr),
                         part.p_filesz)) {
        continue;
      }
      std::strncpy(text_, info.dlpi_name[0] != '\0' ? info.dlpi_name : "the program", size_ - 1);
      text_[size_ - 1] = '\0';
      return true;
    }
    return false;
  }
  /// Ignores mangled names of functions and variables, which end in the name of the class.
  bool contains_name(const char* begin, std::size_t size) const {
    const char* const end = begin + size;
    for (const char* at = begin; at < end; ++at) {
      at = static_cast<const char*>(
          memmem(at, static_cast<std::size_t>(end - at), kName, sizeof kName));
      if (at == nullptr) return false;
      const bool is_mangled =
          at > begin && std::strchr("_SIVPRK", at[-1]) != nullptr && at[-1] != 0;
      if (!is_mangled && at != shared_) return true;
    }
    return false;
  }
  char* text_;
  std::size_t size_;
  const void* shared_;  ///< the name in a library whose functions symbol lookup reaches
};

}  // namespace jfpx::preload
