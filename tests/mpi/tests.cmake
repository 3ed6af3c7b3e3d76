# Programs that mpirun starts on several ranks. They do not run beside other tests: ranks that wait for each other poll, which
# takes long on busy cores.
if(NOT MPIEXEC_EXECUTABLE)
  if(JFPX_MPI STREQUAL "ON")
    message(FATAL_ERROR "mpiexec, which the tests of MPI need, was not found. On Debian and Ubuntu: sudo apt install openmpi-bin, "
      "or scripts/setup.")
  endif()
  return()
endif()
set(mpiexec ${MPIEXEC_EXECUTABLE} ${MPIEXEC_PREFLAGS} ${MPIEXEC_NUMPROC_FLAG})
# Open MPI, in version 4 and in version 5: more ranks than cores, also as root, without ranks bound to the first cores, where
# other tests may run, and without access to the memory of other processes, which containers deny.
set(mpi_environment
  OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
  OMPI_MCA_hwloc_base_binding_policy=none OMPI_MCA_btl_vader_single_copy_mechanism=none
  PRTE_ALLOW_RUN_AS_ROOT=1 PRTE_ALLOW_RUN_AS_ROOT_CONFIRM=1 PRTE_MCA_rmaps_default_mapping_policy=:oversubscribe
  PRTE_MCA_hwloc_default_binding_policy=none)

jfpx_add_executable(communicator_test SOURCES mpi/communicator_test.cpp LINK jfpx_mpi)
set(suffix _f64)
set(example_hash 48e537f7c8757793)
if(JFPX_HAS_PRECISION)
  set(suffix "")
  set(example_hash 3ebbae878116831b)
  set_target_properties(communicator_test_f64 PROPERTIES EXCLUDE_FROM_ALL ON) # does not depend on the precision
endif()
foreach(ranks IN ITEMS 1 2 3 5)
  add_test(NAME Mpi.Communicator.${ranks} COMMAND ${mpiexec} ${ranks} $<TARGET_FILE:communicator_test${suffix}>)
  set_tests_properties(Mpi.Communicator.${ranks} PROPERTIES TIMEOUT 60 RUN_SERIAL ON ENVIRONMENT "${mpi_environment}"
    PASS_REGULAR_EXPRESSION "^${ranks} ranks have exchanged messages")
endforeach()
# A rank that ends by an exception ends the others.
add_test(NAME Mpi.EndsAllRanksAfterAnException COMMAND ${mpiexec} 3 $<TARGET_FILE:communicator_test${suffix}> 1)
set_tests_properties(Mpi.EndsAllRanksAfterAnException PROPERTIES TIMEOUT 30 RUN_SERIAL ON ENVIRONMENT "${mpi_environment}" WILL_FAIL ON)

if(JFPX_EXAMPLES)
  foreach(ranks IN ITEMS 1 3)
    add_test(NAME Mpi.Example.${ranks} COMMAND ${mpiexec} ${ranks} $<TARGET_FILE:ranks${suffix}>)
    set_tests_properties(Mpi.Example.${ranks} PROPERTIES TIMEOUT 60 RUN_SERIAL ON ENVIRONMENT "${mpi_environment}"
      PASS_REGULAR_EXPRESSION "^${ranks} ranks, hash ${example_hash}")
  endforeach()
endif()
if(JFPX_TOOL)
  set(others "")
  if(JFPX_PRECISIONS STREQUAL "both")
    set(others double)
  endif()
  add_test(NAME Mpi.RunHasTheOutputOfOneProcess COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/mpi/run_test.sh
    ${PROJECT_BINARY_DIR}/mpi-test "${others}" $<TARGET_FILE:jfpx_tool${suffix}> ${mpiexec})
  set_tests_properties(Mpi.RunHasTheOutputOfOneProcess PROPERTIES TIMEOUT 240 RUN_SERIAL ON ENVIRONMENT "${mpi_environment}")
endif()
