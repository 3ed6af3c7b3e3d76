jfpx_add_test(base_test INTERNAL SOURCES
  base/build_test.cpp
  base/math_test.cpp
  base/power_test.cpp
  base/thread_choice_test.cpp
  base/thread_pool_test.cpp)
