list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/automatic_device.cpp
  ${CMAKE_CURRENT_LIST_DIR}/body_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/body_store.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_context.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_events.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_finder.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_list.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts_by_body.cpp
  ${CMAKE_CURRENT_LIST_DIR}/device_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/fixed_trees.cpp
  ${CMAKE_CURRENT_LIST_DIR}/force_context.cpp
  ${CMAKE_CURRENT_LIST_DIR}/force_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/force_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/forces.cpp
  ${CMAKE_CURRENT_LIST_DIR}/ignored_pairs.cpp
  ${CMAKE_CURRENT_LIST_DIR}/joint_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/joint_store.cpp
  ${CMAKE_CURRENT_LIST_DIR}/neighbor_list.cpp
  ${CMAKE_CURRENT_LIST_DIR}/query_tree.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recorded_calls.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recorded_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recording.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshot_file.cpp
  ${CMAKE_CURRENT_LIST_DIR}/soft_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/state_hash.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step_view.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sub_shape_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/thesis_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_access.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_joints.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_on_device.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_queue.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_properties.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_queries.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_snapshot.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cuda/world_cuda.cu)
# Has private names of recording.cpp.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/snapshot_file.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
