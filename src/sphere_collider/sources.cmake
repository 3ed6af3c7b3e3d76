list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/automatic_sphere_collider.cpp
  ${CMAKE_CURRENT_LIST_DIR}/backend.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_list.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cost_cache.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cost_model.cpp
  ${CMAKE_CURRENT_LIST_DIR}/periodic.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sphere_collider.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/cell_grid.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/cell_sweep.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/contact_writer.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_baseline.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/lattice.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/nearest.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_bins.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_cutoffs.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_kernels_baseline.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_system.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbors.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/sphere_collider_cpu.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cuda/all_pairs.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/array_collider.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/array_search.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/array_search_parts.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/contact_arrays.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/device_search.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/device_sphere_collider.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/fused_search.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/grid.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/grid_one_launch.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/pair_list.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/pair_list_search.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/periodic_images.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/periodic_search.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/scan.cu
  ${CMAKE_CURRENT_LIST_DIR}/cuda/sphere_collider_cuda.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cuda/systems.cu)
# These sources alone use instruction sets that the baseline does not include; base/cpu.hpp selects among
# them at run time. cpu/kernels.hpp explains why they must not share inline functions with other sources.
set_source_files_properties(
  ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_baseline.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_kernels_baseline.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
if(JFPX_PROCESSOR STREQUAL "x86_64")
  list(APPEND JFPX_SOURCES
    ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_avx2.cpp
    ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_avx512.cpp
    ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_kernels_avx2.cpp)
  set_source_files_properties(
    ${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_avx2.cpp
    ${CMAKE_CURRENT_LIST_DIR}/cpu/neighbor_kernels_avx2.cpp
    PROPERTIES COMPILE_OPTIONS "${JFPX_AVX2_FLAGS}")
  # g++ 12 reports an uninitialized value in its own _mm512_undefined_epi32() (GCC bug 105593).
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/cpu/kernels_avx512.cpp
    PROPERTIES COMPILE_OPTIONS "${JFPX_AVX512_FLAGS};$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>")
endif()
