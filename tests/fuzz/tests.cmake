# Fuzz targets, one program each and precision. With JFPX_FUZZ libFuzzer drives them (scripts/fuzz);
# everywhere, the inputs in corpus/ are a test.
set(JFPX_FUZZERS "")
function(jfpx_add_fuzzer label)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  string(TOLOWER ${label} name)
  set(main "")
  if(NOT JFPX_FUZZ)
    set(main fuzz/replay_main.cpp)
  endif()
  jfpx_add_executable(fuzz_${name} SOURCES fuzz/${name}_fuzz.cpp ${arg_SOURCES} ${main} LINK jfpx ${arg_LINK})
  foreach(suffix IN ITEMS "" "_f64")
    if(NOT JFPX_HAS_PRECISION${suffix})
      continue()
    endif()
    if(JFPX_FUZZ)
      target_link_options(fuzz_${name}${suffix} PRIVATE -fsanitize=fuzzer)
    endif()
    list(APPEND JFPX_FUZZERS fuzz_${name}${suffix})
    add_test(NAME Fuzz.${label}${suffix}
      COMMAND fuzz_${name}${suffix} -runs=0 ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/${name})
    set_tests_properties(Fuzz.${label}${suffix} PROPERTIES TIMEOUT 300)
  endforeach()
  set(JFPX_FUZZERS ${JFPX_FUZZERS} PARENT_SCOPE)
endfunction()

jfpx_add_fuzzer(Scene)
jfpx_add_fuzzer(Recording)
jfpx_add_fuzzer(Snapshot SOURCES fuzz/world_input.cpp)
jfpx_add_fuzzer(World SOURCES fuzz/world_input.cpp)
if(JFPX_HAS_BULLET)
  set(fuzzed_worlds
    bullet/live_random_world.cpp
    bullet/random_world.cpp
    bullet/random_world_globals.cpp
    bullet/random_world_run.cpp
    bullet/solver_world.cpp
    bullet/solver_world_run.cpp)
  jfpx_add_fuzzer(Dispatcher SOURCES ${fuzzed_worlds} LINK jfpx_bullet GTest::gtest)
  jfpx_add_fuzzer(Solver SOURCES ${fuzzed_worlds} LINK jfpx_bullet GTest::gtest)
endif()
add_test(NAME fuzz_script COMMAND
  ${CMAKE_CURRENT_SOURCE_DIR}/fuzz/script.sh ${PROJECT_SOURCE_DIR}/scripts/fuzz)
add_custom_target(fuzzers DEPENDS ${JFPX_FUZZERS})
