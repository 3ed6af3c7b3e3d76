# jfpx_find_bullet(FOUND REASON RELATION VERSION): finds Bullet in both precisions, as the targets
# PkgConfig::JFPX_BULLET_F32 and PkgConfig::JFPX_BULLET_F64, with a version that is `>= VERSION` or
# `= VERSION`. If Bullet is not found, REASON is set to the reason. A macro, because the variables of
# pkg_check_modules must be set in the caller's scope.
#
# Uses pkg-config, because BulletConfig.cmake of Debian's package has a relative include directory, no targets,
# and no double-precision libraries.
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
