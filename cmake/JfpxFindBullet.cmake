# jfpx_find_bullet(FOUND REASON RELATION VERSION): Bullet in both precisions, as the targets
# PkgConfig::JFPX_BULLET_F32 and PkgConfig::JFPX_BULLET_F64; of a version that is `>= VERSION` or
# `= VERSION`. If not found, REASON says why. A macro, as it leaves the variables of pkg_check_modules.
#
# Through pkg-config: BulletConfig.cmake of Debian's package has a relative include directory and no
# targets, and cannot name the double-precision libraries.
macro(jfpx_find_bullet found reason relation version)
  find_package(PkgConfig QUIET)
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(JFPX_BULLET_F32 QUIET IMPORTED_TARGET GLOBAL "bullet${relation}${version}")
    pkg_check_modules(JFPX_BULLET_F64 QUIET IMPORTED_TARGET GLOBAL "bullet-float64${relation}${version}")
  endif()
  if(JFPX_BULLET_F32_FOUND AND JFPX_BULLET_F64_FOUND)
    set(${found} ON)
  else()
    set(${found} OFF)
    set(${reason} "pkg-config does not find bullet and bullet-float64 ${relation} ${version}: install pkg-config and libbullet-dev.")
  endif()
endmacro()
