jfpx_add_test(sphere_collider_x86_test
  SOURCES
    sphere_collider_test.cpp
    support/sphere_fixtures.cpp
    x86/sphere_collider_cases.cpp
    x86/sphere_collider_x86_test.cpp
    x86/thread_choice_test.cpp
    x86/thread_pool_test.cpp)
# Replaces operator new: a program of its own.
jfpx_add_test(sphere_collider_allocation_test
  SOURCES
    support/sphere_fixtures.cpp
    x86/allocation_test.cpp)
