# Finds the libraries of the viewer, and sets JFPX_HAS_VIEWER and the target jfpx_viewer3rd. Uses pkg-config,
# because Debian's imgui and epoxy have no CMake files.
set(JFPX_HAS_VIEWER OFF)
if(JFPX_VIEWER STREQUAL "OFF")
  jfpx_without(viewer "JFPX_VIEWER=OFF")
endif()
if(NOT JFPX_TOOL)
  jfpx_without(viewer "JFPX_TOOL=OFF, which turns all programs off"
    "Configure with -DJFPX_TOOL=ON or without the viewer.")
endif()

find_package(PkgConfig)
if(PKG_CONFIG_FOUND)
  pkg_check_modules(JFPX_VIEWER3RD IMPORTED_TARGET sdl2>=2.0.22 epoxy imgui>=1.84 stb libpng)
endif()
if(NOT JFPX_VIEWER3RD_FOUND)
  jfpx_without(viewer "pkg-config does not find sdl2, epoxy, imgui, stb and libpng: run scripts/setup")
endif()

set(JFPX_HAS_VIEWER ON)
add_library(jfpx_viewer3rd INTERFACE)
target_link_libraries(jfpx_viewer3rd INTERFACE PkgConfig::JFPX_VIEWER3RD)
jfpx_summary(viewer on "SDL ${JFPX_VIEWER3RD_sdl2_VERSION}, Dear ImGui ${JFPX_VIEWER3RD_imgui_VERSION}")
