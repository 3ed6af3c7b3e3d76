/// Tests whether an object is of exactly one class, not of a class derived from it.
///
/// A user-defined class that is compiled with -fno-rtti has no type_info: its vtable contains a
/// null pointer, which type_info::operator== would dereference. Such a class counts as foreign. A
/// class of Bullet also counts as foreign if such code provides its vtable to the whole program,
/// which costs time but changes no bit.
#pragma once

#include <jfpx/config.hpp>

#include <typeinfo>

namespace jfpx {
inline namespace JFPX_ABI {
namespace bullet {

/// The type_info in the vtable of the object, which may be null. Inner loops compare its address
/// with &typeid(Exact): a copy of the class in another library then counts as foreign. The vtable
/// of Exact must be in Bullet's library only, not in every library that uses it.
template <class Object>
const std::type_info* type_info_of(const Object& object) {
  const std::type_info* type = &typeid(object);
  asm("" : "+r"(type));  // the compiler may otherwise assume that it is not null
  return type;
}

template <class Exact, class Object>
bool is_exactly(const Object& object) {
  const std::type_info* type = type_info_of(object);
  return type != nullptr && *type == typeid(Exact);
}

}  // namespace bullet
}  // namespace JFPX_ABI
}  // namespace jfpx
