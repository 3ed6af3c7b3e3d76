jfpx_add_test(sphere_collider_x86_test
  SOURCES
    sphere_collider_test.cpp
    support/sphere_fixtures.cpp
    x86/sphere_collider_cases.cpp)
