list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/coloring.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_cache.cpp
  ${CMAKE_CURRENT_LIST_DIR}/greedy_coloring.cpp
  ${CMAKE_CURRENT_LIST_DIR}/group_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/row_order.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/row_kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/row_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/soft_step_solver.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cuda/group_solver_cuda.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/row_kernels.cu)
# Chosen at run time, like the kernels of sphere_collider.
if(JFPX_PROCESSOR STREQUAL "x86_64")
  foreach(kernels IN ITEMS row_kernels_avx2 sphere_sweep_avx2)
    list(APPEND JFPX_SOURCES ${CMAKE_CURRENT_LIST_DIR}/cpu/${kernels}.cpp)
    set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/cpu/${kernels}.cpp
      PROPERTIES COMPILE_OPTIONS "-mavx2;-mpopcnt")
  endforeach()
endif()
