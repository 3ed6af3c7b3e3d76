/// Processes that a launcher of MPI programs, for example mpirun, has started together.
#pragma once

#include <jfpx/communicator.hpp>

#include <functional>
#include <memory>
#include <string>

namespace jfpx {
inline namespace JFPX_ABI {
namespace tool {

/// How this process was started, by the environment variables of launchers.
enum class Launch : std::uint8_t {
  alone,     ///< by no launcher, or as the only process
  together,  ///< with others
  unknown,   ///< by one that does not name the number of processes, with rank 0
};
Launch launch();

/// @throws InvalidArgument if a launcher has started this process together with others, which would
///   do the same @param command the name of a command that runs as one process
void require_one_process(const std::string& command);

/// Calls `run` with the communicator of the processes that were started together, or with null if
/// there is one process. All processes call this. If `run` throws anything but Interrupted in one
/// of several processes, prints a message with its rank and ends all of them by MPI_Abort().
/// @return the result of `run`
/// @throws InvalidArgument in a build without MPI, if there are several processes
int run_on_ranks(const std::function<int(const std::shared_ptr<Communicator>&)>& run);

}  // namespace tool
}  // namespace JFPX_ABI
}  // namespace jfpx
