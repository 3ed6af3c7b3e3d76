jfpx_add_test(sphere_collider_cuda_test
  SOURCES
    sphere_collider_test.cpp
    support/sphere_fixtures.cpp
    cuda/sphere_collider_cases.cpp)
jfpx_add_test(cuda_filter_test
  SOURCES
    cuda/filter_test.cpp
    support/sphere_fixtures.cpp)
jfpx_add_test(cuda_test
  SOURCES
    cuda/cuda_test.cpp
    cuda/cuda_fault_test.cpp
    cuda/cuda_few_test.cpp
    cuda/cuda_huge_test.cpp
    cuda/group_solver_test.cpp
    support/sphere_fixtures.cpp
  LINK jfpx_cuda CUDA::cudart_static)
jfpx_add_test(cuda_pair_tests_test
  SOURCES
    cuda/pair_tests.cu
    cuda/pair_tests_test.cpp
  LINK CUDA::cudart_static)
