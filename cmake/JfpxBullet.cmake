# Finds Bullet in both precisions: sets JFPX_HAS_BULLET.
set(JFPX_HAS_BULLET OFF)
if(JFPX_BULLET STREQUAL "OFF")
  jfpx_summary(bullet off "JFPX_BULLET=OFF")
  return()
endif()

include(JfpxFindBullet)
jfpx_find_bullet(JFPX_HAS_BULLET reason >= 3.24)
if(NOT JFPX_HAS_BULLET)
  if(JFPX_BULLET STREQUAL "ON")
    message(FATAL_ERROR "JFPX_BULLET=ON, but ${reason}")
  endif()
  jfpx_summary(bullet off "${reason}")
  return()
endif()

# What a target links as jfpx_bullet3rd, its _f64 sibling links as jfpx_bullet3rd_f64.
add_library(jfpx_bullet3rd INTERFACE)
target_link_libraries(jfpx_bullet3rd INTERFACE PkgConfig::JFPX_BULLET_F32)
add_library(jfpx_bullet3rd_f64 INTERFACE)
target_link_libraries(jfpx_bullet3rd_f64 INTERFACE PkgConfig::JFPX_BULLET_F64)
jfpx_summary(bullet on "Bullet ${JFPX_BULLET_F32_VERSION}, float and double")
