/// The file of a program that is about to be executed.
#pragma once

#include <jfpx/config.hpp>

#include <string>
#include <vector>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// What the run-time linker will do with a program. A script, and a file that cannot be read, has
/// the defaults.
struct ProgramFile {
  bool loads_libraries = true;         ///< false: statically linked
  bool ignores_preload = false;        ///< executed with the rights of another user or group
  bool is_of_this_machine = true;      ///< false: for example a 32-bit program
  std::vector<std::string> libraries;  ///< that it is linked with
};

/// @param name is searched in PATH as execvp() does.
ProgramFile read_program_file(const std::string& name);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
