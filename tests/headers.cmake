# Every public header, and so every installed one, compiles alone: without our other folders, without
# CUDA, and all but bullet/ without Bullet.
file(GLOB_RECURSE headers RELATIVE ${PROJECT_SOURCE_DIR}/include CONFIGURE_DEPENDS
     ${PROJECT_SOURCE_DIR}/include/jfpx/*.hpp)
set(plain "")
if(WIN32) # its macros: near, far, small, interface, min(), max(). MinGW's headers suppress the last two.
  set(all "#include <windows.h>\n#define min(a, b) ((a) < (b) ? (a) : (b))\n#define max(a, b) ((a) > (b) ? (a) : (b))\n")
else() # glibc's macros: major(), minor(), howmany()
  set(all "#include <sys/sysmacros.h>\n#include <sys/param.h>\n")
endif()
set(standard "")
set(with_bullet "")
foreach(header IN LISTS headers)
  string(MAKE_C_IDENTIFIER "${header}" identifier)
  set(source ${CMAKE_CURRENT_BINARY_DIR}/headers/${identifier}.cpp)
  file(GENERATE OUTPUT ${source} CONTENT "#include <${header}>\n")
  if(header MATCHES "^jfpx/bullet/")
    list(APPEND with_bullet ${source})
  else()
    list(APPEND plain ${source})
    string(APPEND all "#include <${header}>\n")
    file(STRINGS ${PROJECT_SOURCE_DIR}/include/${header} included REGEX "^#include <[a-z_0-9]+>")
    list(APPEND standard ${included})
  endif()
endforeach()
list(REMOVE_DUPLICATES standard)
list(JOIN standard "\n" standard)
file(GENERATE OUTPUT ${CMAKE_CURRENT_BINARY_DIR}/headers/after_system_macros.cpp CONTENT "${standard}\n${all}")
list(APPEND plain ${CMAKE_CURRENT_BINARY_DIR}/headers/after_system_macros.cpp)
add_library(headers_alone OBJECT ${plain})
target_link_libraries(headers_alone PRIVATE jfpx jfpx_warnings)
set_target_properties(headers_alone PROPERTIES UNITY_BUILD OFF)
if(JFPX_HAS_BULLET AND with_bullet)
  add_library(bullet_headers_alone OBJECT ${with_bullet})
  target_link_libraries(bullet_headers_alone PRIVATE jfpx_bullet jfpx_warnings)
  set_target_properties(bullet_headers_alone PROPERTIES UNITY_BUILD OFF)
endif()

# An older standard is refused by name, before the errors that follow from it.
file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/headers/cxx17.cpp "#include <jfpx/jfpx.hpp>\n")
add_test(NAME Headers.RequireCxx20ByName COMMAND ${CMAKE_CXX_COMPILER} -std=c++17 -fsyntax-only
  -I ${PROJECT_SOURCE_DIR}/include -I ${PROJECT_BINARY_DIR}/include
  ${CMAKE_CURRENT_BINARY_DIR}/headers/cxx17.cpp)
set_tests_properties(Headers.RequireCxx20ByName PROPERTIES
  PASS_REGULAR_EXPRESSION "jfpx requires C\\+\\+20")
