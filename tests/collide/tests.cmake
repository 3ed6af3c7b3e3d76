jfpx_add_test(collide_test INTERNAL SOURCES
  collide/box_pair_test.cpp
  collide/capsule_test.cpp
  collide/closest_points_test.cpp
  collide/collide_test.cpp
  collide/contact_points_test.cpp
  collide/core_sweep_test.cpp
  collide/heightfield_test.cpp
  collide/hull_contact_test.cpp
  collide/hull_faces_test.cpp
  collide/hull_kernels_test.cpp
  collide/hull_test.cpp
  collide/pair_oracle_test.cpp
  collide/round_contact_test.cpp
  collide/shape_cast_test.cpp
  collide/triangle_mesh_test.cpp)
# Has private names of the other tests.
set_source_files_properties(collide/box_pair_test.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
if(JFPX_HAS_CUDA)
  jfpx_add_test(cuda_pair_tests_test
    SOURCES
      collide/pair_tests.cu
      collide/pair_tests_test.cpp
    LINK CUDA::cudart_static)
endif()
