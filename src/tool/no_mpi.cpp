/// Replaces mpi_ranks.cpp in builds without MPI.
#include <jfpx/error.hpp>

#include "src/tool/ranks.hpp"

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

int run_on_ranks(const std::function<int(const std::shared_ptr<Communicator>&)>& run) {
  if (launch() != Launch::together) return run(nullptr);
  throw InvalidArgument(
      "several processes were started together, as by mpirun, but this program is built without "
      "MPI; install MPI (libopenmpi-dev) and configure with -DJFPX_MPI=ON");
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
