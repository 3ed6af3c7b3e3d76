jfpx_add_test(controls_test THESIS SINGLE SOURCES
  viewer/controls_test.cpp
  viewer/mesh_geometry_test.cpp
  viewer/player_test.cpp
  viewer/scene_painter_test.cpp
  LINK jfpx_viewer)
jfpx_add_test(demo_viewer_test THESIS SINGLE SOURCES viewer/demo_viewer_test.cpp LINK jfpx_viewer)
jfpx_add_test(device_viewer_test THESIS INTERNAL SINGLE SOURCES viewer/device_viewer_test.cpp LINK jfpx_viewer)
jfpx_add_test(interactive_test THESIS SINGLE SOURCES viewer/interactive_test.cpp LINK jfpx_viewer)
jfpx_add_test(panel_test THESIS SINGLE SOURCES
  viewer/panel_test.cpp
  viewer/dense_screen_test.cpp
  viewer/user.cpp
  LINK jfpx_viewer)
jfpx_add_test(renderer_test THESIS SINGLE SOURCES
  viewer/renderer_test.cpp
  viewer/mesh_picture_test.cpp
  LINK jfpx_viewer)
foreach(suffix IN ITEMS "" "_f64")
  target_compile_definitions(demo_viewer_test${suffix} PRIVATE
    JFPX_INPUT_FOLDER="${PROJECT_SOURCE_DIR}/src/demos/inputs")
  target_compile_definitions(renderer_test${suffix} PRIVATE
    JFPX_REFERENCE_FOLDER="${CMAKE_CURRENT_SOURCE_DIR}/viewer/reference")
endforeach()

# Compares the output of the viewer with that of the tool.
if(JFPX_TOOL)
  jfpx_add_test(view_test SOURCES viewer/view_test.cpp LINK jfpx_viewer)
  # Loaded into the program in either precision: simulates the reset of a device.
  add_library(lost_context MODULE viewer/lost_context.cpp)
  target_link_libraries(lost_context PRIVATE jfpx_build_flags jfpx_viewer3rd)
  foreach(suffix IN ITEMS "" "_f64")
    jfpx_test_runs(view_test${suffix} jfpx_view jfpx_view_f64 jfpx_tool${suffix} lost_context)
    target_compile_definitions(view_test${suffix} PRIVATE
      JFPX_VIEW_PATH="$<TARGET_FILE:jfpx_view${suffix}>"
      JFPX_TOOL_PATH="$<TARGET_FILE:jfpx_tool${suffix}>"
      JFPX_LOST_CONTEXT_PATH="$<TARGET_FILE:lost_context>"
      JFPX_HAS_BULLET=$<BOOL:${JFPX_HAS_BULLET}>)
  endforeach()
endif()
