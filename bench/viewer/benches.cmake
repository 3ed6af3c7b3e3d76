jfpx_add_bench(rendering_bench SOURCES viewer/rendering_bench.cpp LINK jfpx_viewer)
jfpx_add_bench(drawing_bench SOURCES viewer/drawing_bench.cpp LINK jfpx_viewer)
