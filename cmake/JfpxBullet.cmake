# Finds Bullet in both precisions: sets JFPX_HAS_BULLET and the targets jfpx_bullet3rd and
# jfpx_bullet3rd_f64. Through pkg-config: BulletConfig.cmake of Debian's package has a relative
# include directory and no targets, and cannot name the double-precision libraries.
set(JFPX_HAS_BULLET OFF)
if(JFPX_BULLET STREQUAL "OFF")
  jfpx_summary(bullet off "JFPX_BULLET=OFF")
  return()
endif()

find_package(PkgConfig)
if(PKG_CONFIG_FOUND)
  pkg_check_modules(JFPX_BULLET_F32 IMPORTED_TARGET bullet>=3.24)
  pkg_check_modules(JFPX_BULLET_F64 IMPORTED_TARGET bullet-float64>=3.24)
endif()
if(NOT JFPX_BULLET_F32_FOUND OR NOT JFPX_BULLET_F64_FOUND)
  set(reason "pkg-config does not find bullet and bullet-float64 3.24 or newer: install libbullet-dev")
  if(JFPX_BULLET STREQUAL "ON")
    message(FATAL_ERROR "JFPX_BULLET=ON, but ${reason}.")
  endif()
  jfpx_summary(bullet off "${reason}")
  return()
endif()

set(JFPX_HAS_BULLET ON)
add_library(jfpx_bullet3rd INTERFACE)
target_link_libraries(jfpx_bullet3rd INTERFACE PkgConfig::JFPX_BULLET_F32)
add_library(jfpx_bullet3rd_f64 INTERFACE)
target_link_libraries(jfpx_bullet3rd_f64 INTERFACE PkgConfig::JFPX_BULLET_F64)
jfpx_summary(bullet on "Bullet ${JFPX_BULLET_F32_VERSION}, float and double")
