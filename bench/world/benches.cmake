jfpx_add_bench(world_bench SOURCES world/world_bench.cpp)
