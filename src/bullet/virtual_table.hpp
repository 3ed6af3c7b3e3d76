/// Access to the virtual tables of objects, by the Itanium C++ ABI that g++ and clang implement.
#pragma once

#include <jfpx/config.hpp>

#include <cstddef>
#include <cstring>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The function that a call of the virtual member function executes for this object. In this ABI, a
/// pointer to a virtual member function is the offset of the function in the table plus one.
template <class Member>
const void* virtual_function(const void* object, Member member) {
  std::ptrdiff_t offset;
  std::memcpy(&offset, &member, sizeof offset);
  const char* table;
  std::memcpy(&table, object, sizeof table);
  const void* function;
  std::memcpy(&function, table + (offset - 1), sizeof function);
  return function;
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
