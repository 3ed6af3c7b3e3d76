jfpx_add_bench(sphere_collider_bench SOURCES x86/plain_loop.cpp x86/sphere_collider_bench.cpp)
set_source_files_properties(x86/plain_loop.cpp
  PROPERTIES COMPILE_OPTIONS "-O2;-fno-tree-vectorize")
