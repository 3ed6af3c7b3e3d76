# jfpx_find_bullet(FOUND REASON RELATION VERSION PRECISIONS): finds Bullet as the targets PkgConfig::JFPX_BULLET_F32
# and PkgConfig::JFPX_BULLET_F64, with a version that is `>= VERSION` or `= VERSION`; PRECISIONS (float, double or
# both) are required. Sets JFPX_BULLET_VERSION. If Bullet is not found, REASON is set to the reason. A macro,
# because the variables of pkg_check_modules must be set in the caller's scope.
#
# Uses pkg-config, because BulletConfig.cmake of Debian's package has a relative include directory, no targets,
# and no double-precision libraries.
macro(jfpx_find_bullet found reason relation version precisions)
  find_package(PkgConfig QUIET)
  if(PKG_CONFIG_FOUND)
    pkg_check_modules(JFPX_BULLET_F32 QUIET IMPORTED_TARGET GLOBAL "bullet${relation}${version}")
    # The name of a Bullet that is installed in double precision alone is bullet, too.
    pkg_search_module(JFPX_BULLET_F64 QUIET IMPORTED_TARGET GLOBAL
      "bullet-float64${relation}${version}" "bullet${relation}${version}")
  endif()
  if("${JFPX_BULLET_F32_CFLAGS}" MATCHES "BT_USE_DOUBLE_PRECISION")
    set(JFPX_BULLET_F32_FOUND OFF)
  endif()
  if(NOT "${JFPX_BULLET_F64_CFLAGS}" MATCHES "BT_USE_DOUBLE_PRECISION")
    set(JFPX_BULLET_F64_FOUND OFF)
  endif()
  set(${found} ON)
  foreach(precision IN ITEMS F64 F32)
    if("${precisions}" STREQUAL "both" OR ("${precisions}" STREQUAL "float" AND "${precision}" STREQUAL "F32")
        OR ("${precisions}" STREQUAL "double" AND "${precision}" STREQUAL "F64"))
      if(JFPX_BULLET_${precision}_FOUND)
        set(JFPX_BULLET_VERSION ${JFPX_BULLET_${precision}_VERSION})
      else()
        set(${found} OFF)
        set(${reason} "pkg-config does not find Bullet ${relation} ${version} (precision: ${precisions}): install pkg-config and libbullet-dev")
        if(PKG_CONFIG_FOUND)
          pkg_check_modules(JFPX_BULLET_ANY QUIET bullet)
        endif()
        if(JFPX_BULLET_ANY_FOUND)
          string(APPEND ${reason} ". It finds ${JFPX_BULLET_ANY_VERSION}")
        endif()
      endif()
    endif()
  endforeach()
endmacro()
