jfpx_add_bench(rendering_bench SOURCES viewer/rendering_bench.cpp LINK jfpx_viewer)
