list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/bodies/body_store.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bodies/ignored_pairs.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bodies/partition.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bodies/state_hash.cpp
  ${CMAKE_CURRENT_LIST_DIR}/bodies/sub_shape_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/contact_context.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/contact_events.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/contact_finder.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/contact_list.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/contacts_by_body.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/fixed_trees.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contacts/neighbor_list.cpp
  ${CMAKE_CURRENT_LIST_DIR}/device/automatic_device.cpp
  ${CMAKE_CURRENT_LIST_DIR}/device/device_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/forces/force_context.cpp
  ${CMAKE_CURRENT_LIST_DIR}/forces/force_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/forces/forces.cpp
  ${CMAKE_CURRENT_LIST_DIR}/forces/step_view.cpp
  ${CMAKE_CURRENT_LIST_DIR}/joints/joint_state.cpp
  ${CMAKE_CURRENT_LIST_DIR}/joints/joint_store.cpp
  ${CMAKE_CURRENT_LIST_DIR}/queries/query_tree.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recording/recorded_calls.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recording/recorded_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recording/recording.cpp
  ${CMAKE_CURRENT_LIST_DIR}/recording/trajectory.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshots/body_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshots/contact_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshots/force_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshots/joint_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/snapshots/snapshot_file.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step/continuous_collision.cpp
  ${CMAKE_CURRENT_LIST_DIR}/step/soft_step.cpp
  ${CMAKE_CURRENT_LIST_DIR}/thesis_table.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_joints.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_on_device.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_properties.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_queries.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_queue.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_snapshot.cpp
  ${CMAKE_CURRENT_LIST_DIR}/world_state.cpp)
list(APPEND JFPX_CUDA_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/cuda/world_cuda.cu)
# Has private names of recording/recording.cpp.
set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/snapshots/snapshot_file.cpp PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
