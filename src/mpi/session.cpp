/// Initialization of MPI.
#include <jfpx/mpi.hpp>

#include "src/mpi/check.hpp"

#include <exception>

namespace jfpx {
inline namespace JFPX_ABI {
namespace mpi {

Session::Session() : exceptions_(std::uncaught_exceptions()) {
  int finalized = 0, initialized = 0;
  check(MPI_Finalized(&finalized), "MPI_Finalized");
  if (finalized != 0) throw Error("MPI has been finalized; it can be initialized once");
  check(MPI_Initialized(&initialized), "MPI_Initialized");
  if (initialized != 0) return;
  int provided = MPI_THREAD_SINGLE;
  check(MPI_Init_thread(nullptr, nullptr, MPI_THREAD_FUNNELED, &provided), "MPI_Init_thread");
  owns_ = true;
  if (provided < MPI_THREAD_FUNNELED) {
    MPI_Finalize();
    throw Error("this MPI does not support programs with threads (MPI_THREAD_FUNNELED)");
  }
}

Session::~Session() {
  int finalized = 0;
  if (!owns_ || std::uncaught_exceptions() > exceptions_) return;
  if (MPI_Finalized(&finalized) == MPI_SUCCESS && finalized == 0) MPI_Finalize();
}

}  // namespace mpi
}  // namespace JFPX_ABI
}  // namespace jfpx
