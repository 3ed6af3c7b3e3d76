# Debian packages, created by `cpack` in a build folder: split by Debian's conventions, with dependencies from
# dpkg-shlibdeps. For distributions, configure with the preset package: shared libraries, prefix /usr.
set(version ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME jfpx)
set(CPACK_PACKAGE_VENDOR jfpx)
set(CPACK_PACKAGE_CONTACT "The jfpx authors <maintainers@jfpx.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # set for each package
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE amd64) # CPack would name that of the build machine
if(JFPX_PROCESSOR STREQUAL "aarch64")
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)
endif()
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
# The libraries of jfpx are not installed while packages are created.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src ${PROJECT_BINARY_DIR}/src/bullet)

set(CPACK_COMPONENTS_ALL dev doc)
set(libraries "")
if(BUILD_SHARED_LIBS)
  list(APPEND CPACK_COMPONENTS_ALL runtime runtime_thesis)
  list(APPEND libraries "libjfpx${version} (= ${PROJECT_VERSION})" "libjfpx-thesis${version} (= ${PROJECT_VERSION})")
  if(JFPX_HAS_BULLET)
    list(APPEND CPACK_COMPONENTS_ALL runtime_bullet)
    list(APPEND libraries "libjfpx-bullet${version} (= ${PROJECT_VERSION})")
  endif()
  if(JFPX_HAS_MPI)
    list(APPEND CPACK_COMPONENTS_ALL runtime_mpi)
    list(APPEND libraries "libjfpx-mpi${version} (= ${PROJECT_VERSION})")
  endif()
endif()
if(JFPX_TOOL)
  list(APPEND CPACK_COMPONENTS_ALL tools)
endif()

# _jfpx_describe_package(COMPONENT PACKAGE SECTION DEPENDS TITLE TEXT)
macro(_jfpx_describe_package component package section depends title text)
  string(TOUPPER ${component} id)
  set(CPACK_DEBIAN_${id}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${id}_PACKAGE_SECTION ${section})
  string(REPLACE ";" ", " CPACK_DEBIAN_${id}_PACKAGE_DEPENDS "${depends}")
  set(CPACK_DEBIAN_${id}_DESCRIPTION "${title}\n${text}")
  if(CMAKE_INSTALL_PREFIX STREQUAL "/usr" AND "${component}" IN_LIST CPACK_COMPONENTS_ALL)
    install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}
      RENAME copyright COMPONENT ${component})
  endif()
endmacro()
set(text "Contacts among spheres and rigid-body steps that have the same bits on CPU and CUDA, with any number of threads and inside Bullet.")
_jfpx_describe_package(runtime libjfpx${version} libs "" "rigid-body collision with the same bits everywhere" "${text}")
_jfpx_describe_package(runtime_thesis libjfpx-thesis${version} libs "libjfpx${version} (= ${PROJECT_VERSION})"
  "solver and particles of the thesis that jfpx re-implements" "${text}")
_jfpx_describe_package(runtime_bullet libjfpx-bullet${version} libs "libjfpx${version} (= ${PROJECT_VERSION})"
  "jfpx inside Bullet: dispatcher, solver and world" "${text}")
_jfpx_describe_package(runtime_mpi libjfpx-mpi${version} libs "libjfpx${version} (= ${PROJECT_VERSION})"
  "worlds of jfpx on several ranks by MPI" "${text}")
set(for_dev ${libraries})
if(JFPX_HAS_BULLET)
  list(APPEND for_dev libbullet-dev pkg-config) # jfpx-config.cmake finds Bullet with pkg-config
endif()
if(JFPX_HAS_MPI)
  # Programs with jfpx::mpi need the first, jfpx run on several ranks the second.
  set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS libopenmpi-dev)
  set(suggested_with_mpi ", openmpi-bin")
endif()
_jfpx_describe_package(dev libjfpx-dev libdevel "${for_dev}" "rigid-body collision with the same bits everywhere: headers" "${text}")
if(JFPX_HAS_VIEWER)
  # SDL loads them at run time, with or without a window.
  set(CPACK_DEBIAN_TOOLS_PACKAGE_RECOMMENDS "libegl1, libgl1, libgl1-mesa-dri")
endif()
_jfpx_describe_package(tools jfpx-tools science "${libraries}" "commands of jfpx: run, compare, replay, view scenes"
  "${text} Also runs unmodified Bullet programs with it: jfpx preload.")
_jfpx_describe_package(doc jfpx-doc doc "" "rigid-body collision with the same bits everywhere: documents"
  "Guides, examples, measurements, and the HTML site of the documentation where it was built.")
set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DEV_PACKAGE_SUGGESTS jfpx-doc)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SUGGESTS "jfpx-doc${suggested_with_mpi}")
include(CPack)
