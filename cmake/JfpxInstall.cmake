# Installation of libraries with their CMake and pkg-config files, headers and programs. The installation is
# relocatable: no file contains the prefix. Components follow Debian's conventions: runtime, runtime_thesis,
# runtime_bullet, runtime_mpi, dev, tools, doc.
if(JFPX_INSTALL)
  foreach(folder IN ITEMS BINDIR LIBDIR INCLUDEDIR)
    if(IS_ABSOLUTE "${CMAKE_INSTALL_${folder}}")
      message(FATAL_ERROR "CMAKE_INSTALL_${folder} is \"${CMAKE_INSTALL_${folder}}\"; it must be relative to "
        "CMAKE_INSTALL_PREFIX, as programs and libraries find each other wherever they are moved together.")
    endif()
  endforeach()
endif()
set(JFPX_CMAKE_FOLDER ${CMAKE_INSTALL_LIBDIR}/cmake/jfpx)
# The folder of a loaded file, for the run-time linker. Windows searches the folder of the program, where DLLs are
# installed.
set(JFPX_ORIGIN "$ORIGIN")
if(APPLE)
  set(JFPX_ORIGIN "@loader_path")
endif()
file(RELATIVE_PATH JFPX_LIBRARIES_FROM_PROGRAMS /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})

# jfpx_export(NAME [AS NAME] COMPONENT ...): installs NAME and NAME_f64 as the imported targets jfpx::NAME and
# jfpx::NAME_f64, as files libNAME and libNAME-f64, and with the pkg-config files NAME and NAME-f64.
function(jfpx_export name)
  cmake_parse_arguments(arg "" "AS;COMPONENT" "" ${ARGN})
  if(NOT arg_AS)
    set(arg_AS ${name})
  endif()
  foreach(suffix IN ITEMS "" "_f64")
    set(target ${name}${suffix})
    string(REPLACE "_" "-" file ${target})
    # The suffix of the library's macro in jfpx/config.hpp.
    if(name STREQUAL "jfpx")
      set(builds CORE)
    else()
      string(REGEX REPLACE "^jfpx_" "" builds ${name})
      string(TOUPPER ${builds} builds)
    endif()
    target_compile_definitions(${target} PRIVATE JFPX_BUILDS_${builds})
    # Until version 1.0, each minor version may change the ABI.
    set_target_properties(${target} PROPERTIES
      EXPORT_NAME ${arg_AS}${suffix} OUTPUT_NAME ${file}
      VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
      INSTALL_RPATH "${JFPX_ORIGIN}")
    get_target_property(kind ${target} TYPE)
    if(kind STREQUAL "SHARED_LIBRARY" AND WIN32)
      target_compile_definitions(${target} PUBLIC JFPX_SHARED)
    elseif(kind STREQUAL "SHARED_LIBRARY" AND NOT APPLE)
      set(exports ${PROJECT_SOURCE_DIR}/cmake/exports.map)
      target_link_options(${target} PRIVATE LINKER:--version-script=${exports} LINKER:--no-undefined)
      set_property(TARGET ${target} APPEND PROPERTY LINK_DEPENDS ${exports})
    endif()
    if(JFPX_INSTALL AND JFPX_HAS_PRECISION${suffix})
      install(TARGETS ${target} EXPORT ${name}-targets
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT ${arg_COMPONENT} NAMELINK_COMPONENT dev
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${arg_COMPONENT}
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT dev)
      _jfpx_install_pkg_config(${file} "${suffix}")
    endif()
  endforeach()
  if(JFPX_INSTALL)
    install(EXPORT ${name}-targets NAMESPACE jfpx:: DESTINATION ${JFPX_CMAKE_FOLDER} COMPONENT dev)
  endif()
endfunction()

# jfpx_install_programs(TARGET...): installs programs, which find the libraries by a relative path.
function(jfpx_install_programs)
  if(NOT JFPX_INSTALL)
    return()
  endif()
  set_target_properties(${ARGN} PROPERTIES INSTALL_RPATH "${JFPX_ORIGIN}/${JFPX_LIBRARIES_FROM_PROGRAMS}")
  foreach(target IN LISTS ARGN)
    get_target_property(left_out ${target} EXCLUDE_FROM_ALL)
    if(NOT left_out)
      install(TARGETS ${target} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tools)
    endif()
  endforeach()
endfunction()

function(_jfpx_install_pkg_config file suffix)
  set(folder ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
  file(RELATIVE_PATH up /${folder} /)
  string(REGEX REPLACE "/$" "" up "${up}")
  set(cflags "-I\${includedir} -ffp-contract=off")
  if(WIN32 AND BUILD_SHARED_LIBS)
    string(APPEND cflags " -DJFPX_SHARED")
  endif()
  set(description "${PROJECT_DESCRIPTION}")
  set(precision "single precision")
  if(suffix)
    string(APPEND cflags " -DJFPX_DOUBLE_PRECISION=1")
    set(precision "double precision")
  endif()
  set(requires "")
  set(libraries "-L\${libdir} -l${file}")
  string(REGEX REPLACE "-(bullet|thesis|mpi)" "" core ${file})
  if(file MATCHES "bullet")
    set(description "${description}: the adapter for Bullet")
    set(bullet bullet)
    if(suffix)
      set(bullet ${JFPX_BULLET_F64_MODULE_NAME})
    endif()
    set(requires "${core} = ${PROJECT_VERSION}, ${bullet} = ${JFPX_BULLET_VERSION}")
  elseif(file MATCHES "thesis")
    set(description "${description}: the solver and the particles of the thesis")
    set(requires "${core} = ${PROJECT_VERSION}")
  elseif(file MATCHES "mpi") # the flags of MPI are those of its compilers, for example mpicxx
    set(description "${description}: communication by MPI")
    set(requires "${core} = ${PROJECT_VERSION}")
  elseif(NOT BUILD_SHARED_LIBS)
    string(APPEND libraries " -pthread")
    if(WIN32)
      string(APPEND libraries " -lsynchronization")
    endif()
    if(JFPX_HAS_CUDA)
      string(APPEND libraries " -L\${libdir}/jfpx -lcudart_static -ldl -lrt")
    endif()
  endif()
  configure_file(${PROJECT_SOURCE_DIR}/cmake/jfpx.pc.in ${PROJECT_BINARY_DIR}/${file}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${file}.pc DESTINATION ${folder} COMPONENT dev)
endfunction()

if(NOT JFPX_INSTALL)
  return()
endif()

set(left_out "")
if(NOT JFPX_HAS_BULLET)
  list(APPEND left_out PATTERN bullet EXCLUDE)
endif()
if(NOT JFPX_HAS_CUDA)
  list(APPEND left_out PATTERN cuda EXCLUDE)
endif()
if(NOT JFPX_HAS_MPI)
  list(APPEND left_out PATTERN mpi.hpp EXCLUDE)
endif()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/include/jfpx DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT dev
  FILES_MATCHING PATTERN *.hpp ${left_out})
install(FILES ${PROJECT_BINARY_DIR}/include/jfpx/config.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/jfpx COMPONENT dev)

# Programs that link a static jfpx need the CUDA runtime, but no toolkit.
if(JFPX_HAS_CUDA AND NOT BUILD_SHARED_LIBS)
  get_target_property(cudart CUDA::cudart_static IMPORTED_LOCATION)
  install(FILES ${cudart} DESTINATION ${CMAKE_INSTALL_LIBDIR}/jfpx COMPONENT dev)
endif()

include(CMakePackageConfigHelpers)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/jfpx-config.cmake.in
  ${PROJECT_BINARY_DIR}/jfpx-config.cmake INSTALL_DESTINATION ${JFPX_CMAKE_FOLDER})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/jfpx-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/jfpx-config.cmake ${PROJECT_BINARY_DIR}/jfpx-config-version.cmake
  cmake/JfpxFindBullet.cmake
  DESTINATION ${JFPX_CMAKE_FOLDER} COMPONENT dev)

# Documents, with all files to which they have links, in the folders of the repository. Sources of packages may lack them.
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/docs)
  install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md
    DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc
    FILES_MATCHING PATTERN *.md PATTERN images/* PATTERN reference EXCLUDE PATTERN site EXCLUDE)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/bench/results DESTINATION ${CMAKE_INSTALL_DOCDIR}/bench COMPONENT doc)
  install(FILES ${PROJECT_SOURCE_DIR}/bench/python/neighbours.py
    DESTINATION ${CMAKE_INSTALL_DOCDIR}/bench/python COMPONENT doc)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc
    PATTERN __pycache__ EXCLUDE PATTERN .clang-tidy EXCLUDE)
  install(FILES ${PROJECT_SOURCE_DIR}/packaging/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR}/packaging COMPONENT doc)
  # The site, if scripts/docs has built it.
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/build/docs/html DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT doc OPTIONAL)
endif()
