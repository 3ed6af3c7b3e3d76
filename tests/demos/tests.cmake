jfpx_add_test(demos_test SOURCES 
  demos/demo_test.cpp
  demos/flight_test.cpp
  demos/fountain_test.cpp
  demos/gunnery_test.cpp
  demos/input_script_test.cpp
  LINK jfpx_demos)
foreach(target IN ITEMS demos_test demos_test_f64)
  target_compile_definitions(${target} PRIVATE
    JFPX_INPUTS="${PROJECT_SOURCE_DIR}/src/demos/inputs/")
endforeach()
