list(APPEND JFPX_SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/compound.cpp
  ${CMAKE_CURRENT_LIST_DIR}/inertia_tensor.cpp
  ${CMAKE_CURRENT_LIST_DIR}/principal_inertia.cpp
  ${CMAKE_CURRENT_LIST_DIR}/scene_json.cpp
  ${CMAKE_CURRENT_LIST_DIR}/scene_json_writer.cpp
  ${CMAKE_CURRENT_LIST_DIR}/scene_validate.cpp)
