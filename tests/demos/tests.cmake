jfpx_add_test(demos_test SOURCES demos/demo_test.cpp LINK jfpx_demos)
