jfpx_add_test(base_test INTERNAL SOURCES
  base/file_test.cpp
  base/growable_array_test.cpp
  base/math_test.cpp
  base/page_layout_test.cpp
  base/power_test.cpp
  base/thread_pool_test.cpp
  base/time_chooser_test.cpp)
