jfpx_add_test(world_parts_test SOURCES
  world/body_store_test.cpp
  world/collide_test.cpp
  world/contact_resolver_test.cpp
  world/indexed_heap_test.cpp
  world/power_test.cpp)
jfpx_add_test(world_test SOURCES
  world/motion_test.cpp
  world/rest_test.cpp
  world/world_test.cpp)
