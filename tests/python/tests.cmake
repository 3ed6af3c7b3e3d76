# The tests of the Python package, with pytest where it is there.
execute_process(COMMAND ${Python_EXECUTABLE} -c "import numpy, pytest" ERROR_QUIET RESULT_VARIABLE status)
if(status)
  message(STATUS "The tests of the Python package are left out: ${Python_EXECUTABLE} has no numpy or no pytest; run scripts/setup")
  return()
endif()
add_test(NAME Python.Package COMMAND ${Python_EXECUTABLE} -m pytest -q -p no:cacheprovider --durations=3
  ${CMAKE_CURRENT_SOURCE_DIR}/python)
set(environment "PYTHONPATH=${PROJECT_BINARY_DIR}/python" PYTHONDONTWRITEBYTECODE=1)
if(JFPX_TOOL)
  list(APPEND environment "JFPX_COMMAND=$<TARGET_FILE:jfpx_tool>")
endif()
set_tests_properties(Python.Package PROPERTIES TIMEOUT 300 ENVIRONMENT "${environment}")
