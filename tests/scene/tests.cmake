jfpx_add_test(scene_test THESIS SOURCES
  scene/inertia_test.cpp
  scene/scene_test.cpp)
jfpx_add_test(scene_parts_test INTERNAL SOURCES
  scene/inertia_tensor_test.cpp
  scene/scene_validate_test.cpp)
