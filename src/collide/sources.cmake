list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/block_tree.cpp
  ${CMAKE_CURRENT_LIST_DIR}/collide.cpp
  ${CMAKE_CURRENT_LIST_DIR}/heightfield.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/grid.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/hull.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/hull_data.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/polyhedron.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/quickhull.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hull/reduction.cpp
  ${CMAKE_CURRENT_LIST_DIR}/shape_cast.cpp
  ${CMAKE_CURRENT_LIST_DIR}/triangle_mesh.cpp)
