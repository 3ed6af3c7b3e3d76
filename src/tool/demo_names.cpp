/// Classification of the names of scenes and demos.
#include "src/tool/demo_names.hpp"

#include "src/demos/demo.hpp"

#include <algorithm>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

template <class Entry>
bool has(std::span<const Entry> entries, const std::string& name) {
  return std::ranges::any_of(entries, [&](const Entry& entry) { return entry.name == name; });
}

}  // namespace

bool is_scene(const std::string& name) { return has(scenes::all(), name); }
bool is_demo(const std::string& name) { return has(demos::all(), name); }
bool is_only_a_demo(const std::string& name) { return is_demo(name) && !is_scene(name); }

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
