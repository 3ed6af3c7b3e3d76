/// A program on the ranks of MPI, by the installed library.
#include <jfpx/mpi.hpp>

#include <cstdio>

int main() {
  const jfpx::mpi::Session session;
  const jfpx::mpi::Communicator ranks;
  std::printf("rank %u of %u\n", ranks.rank(), ranks.size());
}
