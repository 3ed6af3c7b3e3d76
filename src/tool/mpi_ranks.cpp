/// Runs a command on the ranks of MPI.
#include <jfpx/mpi.hpp>

#include "src/tool/failure.hpp"
#include "src/tool/interrupts.hpp"
#include "src/tool/ranks.hpp"

#include <fmt/format.h>

#include <cstdio>
#include <exception>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

int run_on_ranks(const std::function<int(const std::shared_ptr<Communicator>&)>& run) {
  if (launch() == Launch::alone) return run(nullptr);
  const mpi::Session session;
  const auto communicator = std::make_shared<mpi::Communicator>();
  if (communicator->size() == 1) return run(nullptr);
  try {
    return run(communicator);
  } catch (const Interrupted&) {
    // All ranks are interrupted. The first that ends has the launcher kill the others, so rank 0
    // has to remove its partial files before.
    MPI_Barrier(MPI_COMM_WORLD);
    throw;
  } catch (...) {
    const int status =
        report_failure(std::current_exception(), fmt::format("rank {}: ", communicator->rank()));
    std::fflush(nullptr);
    MPI_Abort(MPI_COMM_WORLD, status);
    return status;  // never, but MPI_Abort() is not declared so
  }
}

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
