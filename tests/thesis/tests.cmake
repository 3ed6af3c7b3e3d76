jfpx_add_test(thesis_parts_test THESIS INTERNAL SOURCES
  thesis/broad_phase_test.cpp
  thesis/contact_resolver_test.cpp
  thesis/free_motion_test.cpp
  thesis/indexed_priority_queue_test.cpp)
jfpx_add_test(thesis_test THESIS SOURCES
  thesis/intersect_test.cpp
  thesis/particle_test.cpp
  thesis/worst_first_motion_test.cpp
  thesis/worst_first_test.cpp)
