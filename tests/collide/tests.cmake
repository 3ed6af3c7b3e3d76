jfpx_add_test(collide_test INTERNAL SOURCES
  collide/box_pair_test.cpp
  collide/collide_test.cpp
  collide/intersect_test.cpp
  collide/pair_oracle_test.cpp)
if(JFPX_HAS_CUDA)
  jfpx_add_test(cuda_pair_tests_test
    SOURCES
      collide/pair_tests.cu
      collide/pair_tests_test.cpp
    LINK CUDA::cudart_static)
endif()
