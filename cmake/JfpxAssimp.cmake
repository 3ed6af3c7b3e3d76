# Finds assimp, which reads the files of meshes for the programs, and sets JFPX_HAS_ASSIMP. Uses pkg-config,
# because the CMake files of Debian's package require draco's.
set(JFPX_HAS_ASSIMP OFF)
if(JFPX_ASSIMP STREQUAL "OFF")
  jfpx_without(assimp "JFPX_ASSIMP=OFF")
endif()
if(NOT JFPX_TOOL)
  jfpx_without(assimp "JFPX_TOOL=OFF, which turns all programs off"
    "Configure with -DJFPX_TOOL=ON or without assimp.")
endif()

find_package(PkgConfig)
if(PKG_CONFIG_FOUND)
  pkg_check_modules(JFPX_ASSIMP_LIBRARY IMPORTED_TARGET assimp>=5)
endif()
if(NOT JFPX_ASSIMP_LIBRARY_FOUND)
  jfpx_without(assimp "pkg-config does not find assimp: run scripts/setup")
endif()
set(JFPX_HAS_ASSIMP ON)
jfpx_summary(assimp on "assimp ${JFPX_ASSIMP_LIBRARY_VERSION}")
