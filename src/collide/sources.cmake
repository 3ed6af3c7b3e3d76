list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/block_tree.cpp
  ${CMAKE_CURRENT_LIST_DIR}/collide.cpp
  ${CMAKE_CURRENT_LIST_DIR}/triangle_mesh.cpp)
