list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/coloring.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/cpu/row_kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/cpu/row_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/group_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/row_order.cpp
  ${CMAKE_CURRENT_LIST_DIR}/soft_step/contact_cache.cpp
  ${CMAKE_CURRENT_LIST_DIR}/soft_step/cpu/soft_step_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/soft_step/greedy_coloring.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/cuda/group_solver_cuda.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sequential_impulse/cuda/row_kernels.cu)
# Chosen at run time, like the kernels of sphere_collider.
if(JFPX_PROCESSOR STREQUAL "x86_64")
  foreach(kernels IN ITEMS sequential_impulse/cpu/row_kernels_avx2 soft_step/cpu/sweeps_avx2)
    list(APPEND JFPX_SOURCES ${CMAKE_CURRENT_LIST_DIR}/${kernels}.cpp)
    set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/${kernels}.cpp
      PROPERTIES COMPILE_OPTIONS "${JFPX_AVX2_FLAGS}")
  endforeach()
endif()
