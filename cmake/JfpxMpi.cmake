# Finds MPI, of which jfpx::mpi uses the functions of C, and sets JFPX_HAS_MPI.
set(JFPX_HAS_MPI OFF)
if(JFPX_MPI STREQUAL "OFF")
  jfpx_without(mpi "JFPX_MPI=OFF")
endif()
set(MPI_CXX_SKIP_MPICXX ON) # the C++ bindings, which MPI 3 has removed
find_package(MPI 3.0 QUIET COMPONENTS CXX)
if(NOT MPI_CXX_FOUND)
  jfpx_without(mpi "MPI 3.0 or newer was not found"
    "On Debian and Ubuntu: sudo apt install libopenmpi-dev openmpi-bin, or scripts/setup.")
endif()
set(JFPX_HAS_MPI ON)
jfpx_summary(mpi on "MPI ${MPI_CXX_VERSION}")
