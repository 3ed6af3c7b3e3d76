/// Environment variables of launchers of MPI programs.
#include <jfpx/error.hpp>

#include "src/tool/ranks.hpp"

#include <fmt/format.h>

#include <cstdlib>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {
namespace {

/// The value of a variable, or -1 if it is not set.
long number_in_environment(const char* variable) {
  const char* const text = std::getenv(variable);
  return text != nullptr && *text != '\0' ? std::strtol(text, nullptr, 10) : -1;
}

}  // namespace

Launch launch() {
  // Open MPI; Hydra (MPICH, Intel MPI) and Slurm with PMI.
  for (const char* variable : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE"}) {
    const long size = number_in_environment(variable);
    if (size >= 0) return size > 1 ? Launch::together : Launch::alone;
  }
  const long rank = number_in_environment("PMIX_RANK");
  if (rank < 0) return Launch::alone;
  const long size = number_in_environment("SLURM_STEP_NUM_TASKS");
  if (rank > 0 || size > 1) return Launch::together;
  return size == 1 ? Launch::alone : Launch::unknown;
}

void require_one_process(const std::string& command) {
  if (launch() != Launch::together) return;
  throw InvalidArgument(
      fmt::format("jfpx {} runs as one process, but several were started together, as by mpirun; "
                  "only jfpx run uses several ranks",
                  command));
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
