jfpx_add_bench(sphere_collider_bench SOURCES
  sphere_collider/plain_loop.cpp
  sphere_collider/sphere_collider_bench.cpp)
set_source_files_properties(sphere_collider/plain_loop.cpp
  PROPERTIES COMPILE_OPTIONS "-O2;-fno-tree-vectorize")
if(JFPX_HAS_CUDA)
  jfpx_add_bench(cuda_bench
    SOURCES sphere_collider/cuda_bench.cpp sphere_collider/inputs.cpp
    LINK jfpx_cuda CUDA::cudart_static)
endif()
