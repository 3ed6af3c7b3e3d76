jfpx_add_bench(cuda_bench
  SOURCES cuda/cuda_bench.cpp cuda/inputs.cpp
  LINK jfpx_cuda CUDA::cudart_static)
