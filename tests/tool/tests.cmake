jfpx_add_test(tool_test SOURCES tool/calibrate_test.cpp tool/tool_test.cpp
  LINK jfpx_demos nlohmann_json::nlohmann_json)
jfpx_add_test(scene_file_test SOURCES tool/interrupts_test.cpp tool/scene_file_test.cpp LINK jfpx_command_line)
jfpx_add_test(cost_fit_test SOURCES
  tool/cost_fit_test.cpp
  ${PROJECT_SOURCE_DIR}/src/tool/cost_fit.cpp
  support/sphere_fixtures.cpp)
foreach(suffix IN ITEMS "" "_f64")
  jfpx_test_runs(tool_test${suffix} jfpx_tool jfpx_tool_f64)
  # Quoted, because a shell runs the command.
  target_compile_definitions(tool_test${suffix} PRIVATE
    "JFPX_TOOL_PATH=\"\\\"$<TARGET_FILE:jfpx_tool${suffix}>\\\"\""
    JFPX_HAS_BULLET=$<BOOL:${JFPX_HAS_BULLET}>
    JFPX_HAS_MPI=$<BOOL:${JFPX_HAS_MPI}>)
  target_compile_definitions(scene_file_test${suffix} PRIVATE JFPX_HAS_ASSIMP=$<BOOL:${JFPX_HAS_ASSIMP}>)
endforeach()

if(JFPX_HAS_BULLET)
  add_test(NAME CompareSample COMMAND
    ${PROJECT_SOURCE_DIR}/tests/docs/compare_sample.sh $<TARGET_FILE:jfpx_tool>)
  # A reduced matrix of scripts/identity.
  add_test(NAME identity COMMAND ${PROJECT_SOURCE_DIR}/scripts/identity
    --jfpx $<TARGET_FILE:jfpx_tool> --spheres 6 --steps 10 --threads "1 3")
  set_tests_properties(identity PROPERTIES PASS_REGULAR_EXPRESSION "all 36 comparisons are identical")
endif()
add_test(NAME identity_counts_killed_comparisons COMMAND ${PROJECT_SOURCE_DIR}/scripts/identity
  --jfpx ${CMAKE_CURRENT_SOURCE_DIR}/tool/killer.sh --only "overlap" --precision float --threads 1)
set_tests_properties(identity_counts_killed_comparisons PROPERTIES PASS_REGULAR_EXPRESSION "2 of 2 comparisons FAILED")

# The list of docs/conformance.md. Programs that are cross-compiled: scripts/check arm.
if(JFPX_PRECISIONS STREQUAL "both" AND NOT CMAKE_CROSSCOMPILING)
  add_test(NAME Conformance COMMAND ${PROJECT_SOURCE_DIR}/scripts/conformance --build ${PROJECT_BINARY_DIR})
  set_tests_properties(Conformance PROPERTIES TIMEOUT 300)
endif()
