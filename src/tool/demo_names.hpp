/// Classification of the names of scenes and demos.
#pragma once

#include <jfpx/config.hpp>

#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

bool is_scene(const std::string& name);
bool is_demo(const std::string& name);
/// True for a demo that is not also a scene.
bool is_only_a_demo(const std::string& name);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
