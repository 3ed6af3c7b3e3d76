jfpx_add_test(demos_test SOURCES 
  demos/demo_test.cpp
  demos/input_script_test.cpp
  LINK jfpx_demos)
