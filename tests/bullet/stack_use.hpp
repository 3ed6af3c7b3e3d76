/// Measurement of the stack that a call takes.
#pragma once

#include <jfpx/config.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <pthread.h>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// Calls the function on another thread. @return the number of bytes of its stack that were written
inline std::size_t stack_use(const std::function<void()>& function) {
  constexpr unsigned char kUnused = 0xa5;
  constexpr std::size_t kBytes = std::size_t{1} << 20, kAlignment = 4096;
  std::vector<unsigned char> memory(kBytes + kAlignment, kUnused);
  const auto address = reinterpret_cast<std::uintptr_t>(memory.data());
  unsigned char* const stack = memory.data() + (kAlignment - address % kAlignment);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack, kBytes);
  pthread_t thread;
  const auto run = [](void* call) -> void* {
    (*static_cast<const std::function<void()>*>(call))();
    return nullptr;
  };
  const int error =
      pthread_create(&thread, &attributes, run, const_cast<std::function<void()>*>(&function));
  if (error != 0) return 0;
  pthread_join(thread, nullptr);
  const auto used = [](unsigned char byte) { return byte != kUnused; };
  return static_cast<std::size_t>(stack + kBytes - std::find_if(stack, stack + kBytes, used));
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
