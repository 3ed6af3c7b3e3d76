set(JFPX_X86_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/sphere_collider_x86.cpp)
