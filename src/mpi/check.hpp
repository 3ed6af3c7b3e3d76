/// Conversion of error codes of MPI to exceptions.
#pragma once

#include <jfpx/error.hpp>

#include <mpi.h>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace mpi {

/// @param call name of the function of MPI
/// @throws Error if the code is not MPI_SUCCESS
inline void check(int code, const char* call) {
  if (code == MPI_SUCCESS) return;
  char text[MPI_MAX_ERROR_STRING] = "";
  int length = 0;
  std::string reason = "error " + std::to_string(code);
  if (MPI_Error_string(code, text, &length) == MPI_SUCCESS) {
    reason.assign(text, static_cast<std::size_t>(length));
  }
  throw Error(std::string(call) + " failed: " + reason);
}

}  // namespace mpi
}  // namespace JFPX_ABI
}  // namespace jfpx
