jfpx_add_bench(bullet_dispatch_bench SOURCES bullet/dispatch_bench.cpp LINK jfpx_bullet)
jfpx_add_bench(bullet_solver_bench SOURCES bullet/solver_bench.cpp LINK jfpx_bullet)
jfpx_add_bench(bullet_backends_bench SOURCES bullet/backends_bench.cpp LINK jfpx_bullet)
jfpx_add_bench(mixed_bench SOURCES bullet/mixed_bench.cpp LINK jfpx_bullet)
