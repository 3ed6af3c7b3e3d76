set(JFPX_X86_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cell_grid.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cell_sweep.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_writer.cpp
  ${CMAKE_CURRENT_LIST_DIR}/cpu.cpp
  ${CMAKE_CURRENT_LIST_DIR}/kernels_avx2.cpp
  ${CMAKE_CURRENT_LIST_DIR}/kernels_avx512.cpp
  ${CMAKE_CURRENT_LIST_DIR}/kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/kernels_sse2.cpp
  ${CMAKE_CURRENT_LIST_DIR}/row_kernels_avx2.cpp
  ${CMAKE_CURRENT_LIST_DIR}/row_kernels_scalar.cpp
  ${CMAKE_CURRENT_LIST_DIR}/row_solver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sphere_collider_x86.cpp
  ${CMAKE_CURRENT_LIST_DIR}/thread_pool.cpp)
# Instruction sets beyond the baseline, for these sources only; chosen at run time (cpu.hpp). Why
# they may not share inline functions with others: kernels.hpp.
set_source_files_properties(
  ${CMAKE_CURRENT_LIST_DIR}/kernels_avx2.cpp
  ${CMAKE_CURRENT_LIST_DIR}/row_kernels_avx2.cpp
  PROPERTIES COMPILE_OPTIONS "-mavx2;-mpopcnt")
# g++ 12 sees an uninitialised value in its own _mm512_undefined_epi32() (GCC bug 105593).
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/kernels_avx512.cpp
  PROPERTIES COMPILE_OPTIONS "-mavx512f;-mavx512bw;-mavx512dq;-mavx512vl;-mpopcnt;$<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>")
