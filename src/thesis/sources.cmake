list(APPEND JFPX_THESIS_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/broad_phases.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_resolver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/contact_search.cpp
  ${CMAKE_CURRENT_LIST_DIR}/free_motion.cpp
  ${CMAKE_CURRENT_LIST_DIR}/indexed_priority_queue.cpp
  ${CMAKE_CURRENT_LIST_DIR}/particle_resolver.cpp
  ${CMAKE_CURRENT_LIST_DIR}/particle_store.cpp
  ${CMAKE_CURRENT_LIST_DIR}/particle_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/sphere_hierarchy.cpp
  ${CMAKE_CURRENT_LIST_DIR}/wake_propagation.cpp
  ${CMAKE_CURRENT_LIST_DIR}/worst_first.cpp)
