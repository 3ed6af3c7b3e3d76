jfpx_add_test(world_parts_test THESIS INTERNAL SOURCES
  world/blocks_test.cpp
  world/body_store_test.cpp
  world/compound_test.cpp
  world/fixed_trees_test.cpp
  world/gyroscopic_test.cpp
  world/neighbor_list_test.cpp
  world/query_tree_test.cpp
  world/swept_bounds_test.cpp
  world/warp_items_test.cpp)
jfpx_add_test(ranks_test INTERNAL SOURCES world/ranks_test.cpp)
jfpx_add_test(device_world_test THESIS INTERNAL SOURCES world/device_world_test.cpp)
if(JFPX_HAS_CUDA)
  set(cuda_runtime CUDA::cudart_static)
endif()
# Compiling the programs of the device for the host takes most of the time, so these two share them.
jfpx_add_test(device_states_test THESIS INTERNAL
  SOURCES
    world/automatic_device_test.cpp
    world/device_states_test.cpp
  LINK ${cuda_runtime})
jfpx_add_test(device_queue_test INTERNAL SOURCES world/device_queue_test.cpp LINK ${cuda_runtime})
foreach(target IN ITEMS device_states_test device_states_test_f64 device_queue_test device_queue_test_f64)
  if(TARGET ${target}) # not in shared libraries, nor in one precision
    target_compile_definitions(${target} PRIVATE JFPX_HAS_CUDA=$<BOOL:${JFPX_HAS_CUDA}>)
  endif()
endforeach()
if(JFPX_HAS_CUDA)
  jfpx_add_test(device_fault_test INTERNAL SOURCES world/device_fault_test.cpp LINK jfpx_cuda CUDA::cudart_static)
endif()
jfpx_add_test(world_test THESIS SOURCES
  world/box_test.cpp
  world/buoyancy_test.cpp
  world/capsule_world_test.cpp
  world/closest_body_test.cpp
  world/contact_events_test.cpp
  world/contact_forces_test.cpp
  world/contact_changes_test.cpp
  world/contact_generator_test.cpp
  world/conveyor_test.cpp
  world/cylinder_world_test.cpp
  world/erratum_test.cpp
  world/filter_test.cpp
  world/force_registry_test.cpp
  world/force_test.cpp
  world/frame_joint_test.cpp
  world/hit_events_test.cpp
  world/joint_test.cpp
  world/joint_world_test.cpp
  world/kinematic_test.cpp
  world/mixed_test.cpp
  world/motion_locks_test.cpp
  world/motion_test.cpp
  world/debug_draw_test.cpp
  world/property_test.cpp
  world/replace_test.cpp
  world/query_test.cpp
  world/recorded_world_test.cpp
  world/recording_test.cpp
  world/rest_test.cpp
  world/sensor_test.cpp
  world/shape_cast_test.cpp
  world/snapshot_test.cpp
  world/vector_width_test.cpp
  world/world_test.cpp)
jfpx_add_test(character_test SOURCES world/character_test.cpp)
jfpx_add_test(trajectory_test SOURCES world/trajectory_test.cpp)
jfpx_add_test(portable_files_test THESIS SOURCES world/portable_files_test.cpp)
set_source_files_properties(world/portable_files_test.cpp PROPERTIES
  COMPILE_DEFINITIONS "JFPX_FILES=\"${CMAKE_CURRENT_SOURCE_DIR}/world/files/\"")
jfpx_add_test(quality_test THESIS SOURCES
  world/box_rest_test.cpp
  world/continuous_collision_test.cpp
  world/heightfield_world_test.cpp
  world/mesh_world_test.cpp
  world/equilibrium_test.cpp
  world/free_rotation_test.cpp
  world/friction_test.cpp
  world/heap_test.cpp
  world/hull_world_test.cpp
  world/impact_test.cpp
  world/oracle_test.cpp
  world/seams_test.cpp
  world/stack_test.cpp)
jfpx_add_test(concurrency_test THESIS SOURCES world/concurrency_test.cpp)
jfpx_add_test(soak_test THESIS SOURCES world/soak_test.cpp)
# These replace operator new: programs of their own.
jfpx_add_test(allocation_test THESIS SOURCES world/allocation_test.cpp)
jfpx_add_test(out_of_memory_test THESIS SOURCES
  support/failing_new.cpp
  world/out_of_memory_test.cpp)

jfpx_add_executable(pinned_hashes SOURCES world/pinned_hashes.cpp LINK jfpx jfpx_demos)
foreach(suffix IN ITEMS "" "_f64")
  if(NOT JFPX_HAS_PRECISION${suffix})
    continue()
  endif()
  add_test(NAME PinnedHashes${suffix} COMMAND pinned_hashes${suffix})
  add_test(NAME PinnedHashes.WithAnyNumberOfThreads${suffix} COMMAND pinned_hashes${suffix} 2 3 4 5 6 7 8)
endforeach()
# Builds the engine with two compilers, at two optimization levels each: scripts/check compilers. Takes five minutes on
# two idle cores, and much longer on busy ones.
add_test(NAME PinnedHashes.WithEveryCompiler CONFIGURATIONS Compilers
  COMMAND ${CMAKE_COMMAND} -DBINARY_DIR=${PROJECT_BINARY_DIR}/flavours
    -DCONFIG_DIR=${PROJECT_BINARY_DIR}/include -DLAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}
    -P ${CMAKE_CURRENT_LIST_DIR}/flavours/run.cmake)
set_tests_properties(PinnedHashes.WithEveryCompiler PROPERTIES TIMEOUT 2400 PROCESSORS 2)
