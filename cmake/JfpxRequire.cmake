# Required compilers and packages, whose absence is an error with the package of Debian and Ubuntu.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 12
   OR CMAKE_CXX_COMPILER_ID STREQUAL "Clang" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 14)
  message(FATAL_ERROR "${CMAKE_CXX_COMPILER} is ${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}; jfpx needs g++ 12, "
    "clang 14 or newer. On Debian and Ubuntu: sudo apt install g++-12, and configure a new build folder with CXX=g++-12.")
endif()

# jfpx_require(NAME VERSION PACKAGES [REMEDY]): find_package(NAME VERSION). REMEDY leaves out what needs it.
macro(jfpx_require name version packages)
  find_package(${name} ${version} QUIET)
  if(NOT ${name}_FOUND)
    set(jfpx_found "")
    if(${name}_CONSIDERED_VERSIONS)
      set(jfpx_found ", only ${${name}_CONSIDERED_VERSIONS}")
    endif()
    set(jfpx_setup ", or scripts/setup") # which the source package of Python does not have
    if(NOT EXISTS ${PROJECT_SOURCE_DIR}/scripts/setup)
      set(jfpx_setup "")
    endif()
    set(jfpx_remedy "")
    if(NOT "${ARGN}" STREQUAL "")
      set(jfpx_remedy " ${ARGN}")
    endif()
    message(FATAL_ERROR "${name} ${version} or newer was not found${jfpx_found}. On Debian and Ubuntu: "
      "sudo apt install ${packages}${jfpx_setup}. Elsewhere, CMAKE_PREFIX_PATH may name its folder.${jfpx_remedy}")
  endif()
endmacro()
