# Sanitizers check the type of an object, which needs RTTI.
set(no_rtti "")
if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  set(no_rtti bullet/no_rtti_test.cpp bullet/no_rtti_unit.cpp)
  set_source_files_properties(bullet/no_rtti_unit.cpp PROPERTIES
    COMPILE_OPTIONS "-fno-rtti" SKIP_PRECOMPILE_HEADERS ON)
endif()
jfpx_add_test(bullet_contract_test INTERNAL SOURCES
  ${no_rtti}
  bullet/bullet_modules_test.cpp
  bullet/compound_commit_test.cpp
  bullet/concave_commit_test.cpp
  bullet/contact_callbacks_test.cpp
  bullet/device_traffic_test.cpp
  bullet/group_choice_test.cpp
  bullet/islands_test.cpp
  bullet/pair_table_test.cpp
  bullet/parallel_quick_sort_test.cpp
  bullet/plane_gap_test.cpp
  bullet/replaced_test.cpp
  bullet/situations_test.cpp
  bullet/convex_distance_test.cpp
  bullet/sphere_plane_test.cpp
  bullet/stats_test.cpp
  bullet/unordered_commit_test.cpp
  bullet/user_code_test.cpp
  LINK jfpx_bullet jfpx_scenes)
# Has private names of other tests.
set_source_files_properties(bullet/convex_distance_test.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
jfpx_add_test(bullet_verify_test INTERNAL SOURCES
  bullet/fused_test.cpp
  bullet/fused_unit.cpp
  bullet/scene_world_test.cpp
  bullet/verify_test.cpp
  LINK jfpx_bullet)
# After the options that linking jfpx::bullet adds. Every ARM64 processor has FMA.
set(fused -O3 -ffp-contract=fast)
if(JFPX_PROCESSOR STREQUAL "x86_64")
  list(APPEND fused -mfma)
endif()
set_source_files_properties(bullet/fused_unit.cpp PROPERTIES
  COMPILE_OPTIONS "${fused}" SKIP_PRECOMPILE_HEADERS ON)
jfpx_add_test(bullet_trajectory_test SOURCES
  bullet/mt_classes_test.cpp
  bullet/program_test.cpp
  bullet/terrain_test.cpp
  bullet/trajectory_test.cpp
  LINK jfpx_bullet)
jfpx_add_test(bullet_random_worlds_test SOURCES
  bullet/random_worlds_test.cpp
  LINK bullet_test_worlds)
set_source_files_properties(bullet/random_worlds_test.cpp PROPERTIES
  COMPILE_DEFINITIONS "JFPX_DISPATCHER_CORPUS=\"${CMAKE_CURRENT_SOURCE_DIR}/fuzz/corpus/dispatcher/\"")
jfpx_add_test(bullet_solver_test SOURCES
  bullet/joint_without_rtti.cpp
  bullet/soft_body_test.cpp
  bullet/solver_test.cpp
  LINK bullet_test_worlds)
set_source_files_properties(bullet/joint_without_rtti.cpp PROPERTIES
  COMPILE_OPTIONS "-fno-rtti" SKIP_PRECOMPILE_HEADERS ON)
# Bullet's headers of soft bodies have a variable `seed`.
set_source_files_properties(bullet/soft_body_test.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
jfpx_add_test(bullet_gpu_island_solver_test SOURCES
  bullet/gpu_island_solver_test.cpp
  LINK bullet_test_worlds)
if(JFPX_HAS_CUDA)
  jfpx_add_test(bullet_solver_cuda_test SOURCES
    bullet/solver_cuda_test.cpp
    support/sphere_fixtures.cpp
    LINK bullet_test_worlds jfpx_cuda CUDA::cudart_static)
endif()
jfpx_add_test(bullet_algorithm_test SOURCES
  bullet/algorithm_test.cpp
  LINK bullet_test_worlds)
jfpx_add_test(bullet_soak_test SOURCES bullet/soak_test.cpp LINK jfpx_bullet)
# Too few worlds would fail by chance.
add_test(NAME soak_refuses_few_steps COMMAND ${PROJECT_SOURCE_DIR}/scripts/soak --steps 19999)
set_tests_properties(soak_refuses_few_steps PROPERTIES PASS_REGULAR_EXPRESSION "it must be at least 20000")
# A separate program, because it replaces operator new.
jfpx_add_test(bullet_out_of_memory_test SOURCES
  bullet/out_of_memory_test.cpp
  support/failing_new.cpp
  LINK jfpx_bullet)

# A separate program, because it replaces Bullet's allocator.
jfpx_add_test(bullet_aabb_update_test INTERNAL SOURCES
  bullet/aabb_update_test.cpp
  bullet/arena.cpp
  LINK jfpx_bullet)
# A separate program, because it replaces a constructor of Bullet.
jfpx_add_test(bullet_thread_safe_library_test SOURCES
  bullet/thread_safe_imitation.cpp
  bullet/thread_safe_library_test.cpp
  LINK jfpx_bullet ${CMAKE_DL_LIBS})

# Unsupported configurations of Bullet are rejected with a helpful message.
function(jfpx_add_guard_test name text)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/bullet_guard.cpp)
  file(WRITE ${source} "#include <jfpx/bullet/constraint_solver.hpp>
#include <jfpx/bullet/dispatcher.hpp>
#include <jfpx/bullet/dynamics_world.hpp>
")
  set(includes ${PROJECT_SOURCE_DIR}/include ${PROJECT_BINARY_DIR}/include ${JFPX_BULLET_F32_INCLUDE_DIRS} ${JFPX_BULLET_F64_INCLUDE_DIRS})
  list(TRANSFORM includes PREPEND -I)
  add_test(NAME bullet_guard_${name} COMMAND sh -c
    "\"${CMAKE_CXX_COMPILER}\" -std=c++20 -fsyntax-only ${ARGN} \"$@\" 2>&1 && echo compiles" guard ${includes} ${source})
  set_tests_properties(bullet_guard_${name} PROPERTIES PASS_REGULAR_EXPRESSION "${text}")
endfunction()
jfpx_add_guard_test(vectors "keeps the bits of Bullet's scalar code" -DBT_USE_SSE)
jfpx_add_guard_test(double "this build mixes the two" -DBT_USE_DOUBLE_PRECISION)
jfpx_add_guard_test(float "this build mixes the two" -DJFPX_DOUBLE_PRECISION)
jfpx_add_guard_test(none "^compiles")
jfpx_add_guard_test(threads "^compiles" -DBT_THREADSAFE=1)
jfpx_add_guard_test(exceptions "^compiles" "-fno-exceptions -fno-rtti")

add_test(NAME Bullet.OnePrecisionIsEnough COMMAND ${CMAKE_CURRENT_SOURCE_DIR}/bullet/find_bullet/check.sh)

# A library with BT_THREADSAFE from the sources of the installed version, for the same programs.
if(JFPX_BULLET_SOURCE)
  include(bullet/thread_safe_build.cmake)
endif()

# The library serves programs of both precisions.
if(JFPX_TOOL AND TARGET jfpx_bullet_preload AND JFPX_BULLET_F32_FOUND AND JFPX_BULLET_F64_FOUND)
  jfpx_add_executable(bullet_stock_program SOURCES bullet/stock_program.cpp
    LINK jfpx_bullet3rd Threads::Threads)
  jfpx_add_executable(bullet_environment_program SOURCES bullet/environment_program.cpp
    LINK jfpx_bullet3rd Threads::Threads)
  # A program as its developers may build it. A sanitizer build of this project is one, too.
  # clang links the run-time library statically, which then is the first of the program.
  set(with_asan "")
  include(CheckCXXCompilerFlag)
  set(CMAKE_REQUIRED_LINK_OPTIONS -fsanitize=address)
  check_cxx_compiler_flag(-fsanitize=address JFPX_COMPILER_HAS_ASAN)
  unset(CMAKE_REQUIRED_LINK_OPTIONS)
  if(JFPX_COMPILER_HAS_ASAN AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    jfpx_add_executable(bullet_asan_program SOURCES bullet/stock_program.cpp
      LINK jfpx_bullet3rd Threads::Threads)
    foreach(target IN ITEMS bullet_asan_program bullet_asan_program_f64)
      target_compile_options(${target} PRIVATE -fsanitize=address)
      target_link_options(${target} PRIVATE -fsanitize=address)
    endforeach()
    set(with_asan bullet_asan_program bullet_asan_program_f64)
  endif()
  jfpx_add_test(bullet_preload_test SOURCES bullet/preload_test.cpp)
  add_library(vtable_library SHARED bullet/vtable_library.cpp)
  target_include_directories(vtable_library PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_options(vtable_library PRIVATE -Wl,-Bsymbolic-functions,-z,relro,-z,now)
  jfpx_add_test(vtable_test SINGLE SOURCES bullet/vtable_test.cpp LINK vtable_library)
  foreach(suffix IN ITEMS "" "_f64")
    set(other _f64)
    set(precision F32)
    if(suffix)
      set(other "")
      set(precision F64)
    endif()
    set(collision ${JFPX_BULLET_${precision}_LINK_LIBRARIES})
    set(dynamics ${collision})
    list(FILTER collision INCLUDE REGEX "BulletCollision")
    list(FILTER dynamics INCLUDE REGEX "BulletDynamics")
    jfpx_test_runs(bullet_preload_test${suffix}
      jfpx_tool jfpx_tool_f64 jfpx_bullet_preload bullet_stock_program bullet_stock_program_f64
      bullet_environment_program bullet_environment_program_f64 ${with_asan})
    if(with_asan)
      target_compile_definitions(bullet_preload_test${suffix} PRIVATE
        JFPX_ASAN_PROGRAM="$<TARGET_FILE:bullet_asan_program${suffix}>")
    endif()
    target_compile_definitions(bullet_preload_test${suffix} PRIVATE
      JFPX_TOOL_PATH="$<TARGET_FILE:jfpx_tool${suffix}>"
      JFPX_STOCK_PROGRAM="$<TARGET_FILE:bullet_stock_program${suffix}>"
      JFPX_ENVIRONMENT_PROGRAM="$<TARGET_FILE:bullet_environment_program${suffix}>"
      JFPX_OTHER_STOCK_PROGRAM="$<TARGET_FILE:bullet_stock_program${other}>"
      JFPX_BULLET_COLLISION="${collision}" JFPX_BULLET_DYNAMICS="${dynamics}")
  endforeach()
endif()

# The examples run and print the expected output.
if(JFPX_EXAMPLES)
  foreach(suffix IN ITEMS "" "_f64")
    if(NOT JFPX_HAS_PRECISION${suffix})
      continue()
    endif()
    add_test(NAME bullet_algorithm${suffix} COMMAND bullet_algorithm${suffix})
    set_tests_properties(bullet_algorithm${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "1 contact at a distance of -0.5\n$")
    add_test(NAME bullet_app${suffix} COMMAND bullet_app${suffix})
    set_tests_properties(bullet_app${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "[1-9][0-9]* of 120 dispatches in batches; [1-9][0-9]* contacts")
    add_test(NAME bullet_check${suffix} COMMAND bullet_check${suffix})
    set_tests_properties(bullet_check${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "no difference; [1-9][0-9]* contacts compared with SphereCollider, 0 different\n$")
    add_test(NAME bullet_parallel${suffix} COMMAND bullet_parallel${suffix})
    set_tests_properties(bullet_parallel${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "contacts by (cpu|cuda) \\(.*\n.*: both times\n$")
    set(callbacks "$<TARGET_FILE:bullet_callbacks${suffix}>")
    add_test(NAME bullet_callbacks${suffix} COMMAND sh -c
      "\"${callbacks}\" && [ \"$(\"${callbacks}\")\" = \"$(\"${callbacks}\" stock)\" ]")
  endforeach()
endif()
