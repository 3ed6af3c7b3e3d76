# Functions that create each target in both precisions: NAME in float, NAME_f64 in double.
find_package(Threads REQUIRED)
include(GNUInstallDirs)
include(JfpxExact)

# Windows looks for DLLs in the folder of the program.
if(WIN32 AND BUILD_SHARED_LIBS AND NOT CMAKE_RUNTIME_OUTPUT_DIRECTORY)
  set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
endif()

configure_file(${PROJECT_SOURCE_DIR}/include/jfpx/config.hpp.in
               ${PROJECT_BINARY_DIR}/include/jfpx/config.hpp @ONLY)

# Flags for the files of jfpx only; they are not usage requirements.
add_library(jfpx_warnings INTERFACE)
target_compile_options(jfpx_warnings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:$<IF:$<BOOL:${MSVC}>,/W3,-Wall;-Wextra;-Wconversion;-Wshadow>>
  # g++ reports members of private types in a source that another source includes.
  $<$<AND:$<COMPILE_LANG_AND_ID:CXX,GNU>,$<BOOL:${CMAKE_UNITY_BUILD}>>:-Wno-subobject-linkage>
  # g++ notes that it passes vectors of doubles as no version before 4.6 did.
  $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-psabi>
  $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<BOOL:${JFPX_WERROR}>>:-Werror>)
add_library(jfpx_build_flags INTERFACE)
target_compile_features(jfpx_build_flags INTERFACE cxx_std_20)
target_include_directories(jfpx_build_flags INTERFACE ${PROJECT_SOURCE_DIR})
target_compile_options(jfpx_build_flags INTERFACE ${JFPX_OWN_EXACT_FLAGS}
  # Errors of CUDA name their source file, without the folder in which it was compiled.
  $<$<AND:$<COMPILE_LANG_AND_ID:CXX,GNU,Clang,AppleClang>,$<NOT:$<BOOL:${MSVC}>>>:-fmacro-prefix-map=${PROJECT_SOURCE_DIR}/=>)
target_link_libraries(jfpx_build_flags INTERFACE jfpx_warnings)

# jfpx_add_library(NAME [STATIC|OBJECT] SOURCES ... [PUBLIC ...] [PRIVATE ...]): adds NAME and NAME_f64. Where
# a linked target has a _f64 counterpart, NAME_f64 links that. Without a type, BUILD_SHARED_LIBS selects it;
# only libraries that are installed omit the type.
function(jfpx_add_library name)
  cmake_parse_arguments(arg "STATIC;OBJECT" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(kind "")
  if(arg_STATIC)
    set(kind STATIC)
  elseif(arg_OBJECT)
    set(kind OBJECT)
  endif()
  foreach(suffix IN ITEMS "" "_f64")
    set(target ${name}${suffix})
    add_library(${target} ${kind} ${arg_SOURCES})
    _jfpx_configure(${target} "${suffix}" "${arg_PUBLIC}" "${arg_PRIVATE}")
    target_compile_features(${target} PUBLIC cxx_std_20)
    target_compile_options(${target} PUBLIC ${JFPX_EXACT_FLAGS})
    target_include_directories(${target} PUBLIC
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
      $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/include>
      $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
    if(suffix)
      target_compile_definitions(${target} PUBLIC JFPX_DOUBLE_PRECISION=1)
    endif()
  endforeach()
endfunction()

# jfpx_add_executable(NAME SOURCES ... [LINK ...]): adds NAME and NAME_f64.
function(jfpx_add_executable name)
  cmake_parse_arguments(arg "" "" "SOURCES;LINK" ${ARGN})
  foreach(suffix IN ITEMS "" "_f64")
    set(target ${name}${suffix})
    add_executable(${target} ${arg_SOURCES})
    _jfpx_configure(${target} "${suffix}" "" "${arg_LINK}")
  endforeach()
endfunction()

function(_jfpx_configure target suffix public private)
  if(NOT JFPX_HAS_PRECISION${suffix}) # built only if another target requires it
    set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL ON)
  endif()
  foreach(scope IN ITEMS PUBLIC PRIVATE)
    string(TOLOWER ${scope} list)
    foreach(dependency IN LISTS ${list})
      if(suffix AND TARGET ${dependency}${suffix})
        set(dependency ${dependency}${suffix})
      endif()
      target_link_libraries(${target} ${scope} ${dependency})
    endforeach()
  endforeach()
  target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:jfpx_build_flags>)
  set_target_properties(${target} PROPERTIES
    CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON
    CUDA_VISIBILITY_PRESET hidden POSITION_INDEPENDENT_CODE ON)
  # Tests are not instrumented, because they are most of the code to compile. At -O1, g++ warns about
  # uninitialised values in the headers of intrinsics.
  set(sources ${PROJECT_SOURCE_DIR}/src)
  cmake_path(IS_PREFIX sources "${CMAKE_CURRENT_SOURCE_DIR}" ours)
  if(JFPX_COVERAGE AND NOT suffix AND ours)
    target_compile_options(${target} PRIVATE -O1 --coverage -fprofile-update=atomic -Wno-uninitialized)
    target_link_options(${target} PUBLIC --coverage)
  endif()
  # Each source appears once in compile_commands.json, for clangd and clang-tidy.
  if(suffix)
    set_target_properties(${target} PROPERTIES EXPORT_COMPILE_COMMANDS OFF)
  endif()
endfunction()
