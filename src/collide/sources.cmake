list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/block_tree.cpp
  ${CMAKE_CURRENT_LIST_DIR}/closest_points.cpp
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
# Chosen at run time, like the kernels of sphere_collider.
if(JFPX_PROCESSOR STREQUAL "x86_64")
  list(APPEND JFPX_SOURCES ${CMAKE_CURRENT_LIST_DIR}/cpu/hull_kernels_avx2.cpp)
  set_source_files_properties(${CMAKE_CURRENT_LIST_DIR}/cpu/hull_kernels_avx2.cpp
    PROPERTIES COMPILE_OPTIONS "${JFPX_AVX2_FLAGS}")
endif()
