/// Which names are demos.
#include "src/tool/demo_names.hpp"

#include "examples/demos/demo.hpp"

#include <algorithm>

namespace jfpx::inline JFPX_ABI::tool {

bool is_demo(const std::string& name) {
  return std::any_of(demos::all().begin(), demos::all().end(),
                     [&](const auto& entry) { return entry.name == name; });
}

bool is_only_a_demo(const std::string& name) {
  return is_demo(name) && std::none_of(scenes::all().begin(), scenes::all().end(),
                                       [&](const auto& entry) { return entry.name == name; });
}

}  // namespace jfpx::inline JFPX_ABI::tool
