# libjfpx-bullet-preload.so for LD_PRELOAD, and the engines that it loads, one per precision.

# The engines depend on the layout of Bullet's classes, so they support only the Bullet that they are
# compiled against, which is identified by the name of its library for the run-time linker.
set(names "")
foreach(precision IN ITEMS F32 F64)
  foreach(part IN ITEMS Collision Dynamics)
    set(libraries ${JFPX_BULLET_${precision}_LINK_LIBRARIES})
    list(FILTER libraries INCLUDE REGEX "Bullet${part}")
    get_filename_component(library "${libraries}" NAME)
    if(IS_SYMLINK "${libraries}")
      file(READ_SYMLINK "${libraries}" library)
      get_filename_component(library "${library}" NAME)
    endif()
    string(TOUPPER "${part}" part)
    if(NOT JFPX_BULLET_${precision}_FOUND)
      set(library "of the other precision")
    endif()
    list(APPEND names JFPX_BULLET_${part}_${precision}="${library}")
  endforeach()
endforeach()

foreach(suffix IN ITEMS "" "_f64")
  set(engine jfpx_bullet_engine${suffix})
  add_library(${engine} MODULE
    preload/preload_engine.cpp preload/preload_options.cpp preload/preload_solver.cpp)
  _jfpx_configure(${engine} "${suffix}" "" "jfpx_bullet")
  set_target_properties(${engine} PROPERTIES UNITY_BUILD OFF) # its sources have the same private names
  target_link_options(${engine} PRIVATE LINKER:--exclude-libs,ALL)
  # Reports a symbol that no shared library exports here instead of in the user's program.
  if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
    target_link_options(${engine} PRIVATE LINKER:--no-undefined)
  endif()
endforeach()
set_target_properties(jfpx_bullet_engine PROPERTIES OUTPUT_NAME jfpx-bullet-engine)
set_target_properties(jfpx_bullet_engine_f64 PROPERTIES OUTPUT_NAME jfpx-bullet-engine-f64)

add_library(jfpx_bullet_preload MODULE preload/preload.cpp)
target_link_libraries(jfpx_bullet_preload PRIVATE jfpx_build_flags ${CMAKE_DL_LIBS} Threads::Threads)
target_compile_definitions(jfpx_bullet_preload PRIVATE
  JFPX_ENGINE="$<TARGET_FILE_NAME:jfpx_bullet_engine>"
  JFPX_ENGINE_F64="$<TARGET_FILE_NAME:jfpx_bullet_engine_f64>"
  ${names})
# It must not load a C++ library into programs that have none.
target_link_options(jfpx_bullet_preload PRIVATE LINKER:--as-needed)
set_target_properties(jfpx_bullet_preload PROPERTIES
  OUTPUT_NAME jfpx-bullet-preload CXX_EXTENSIONS OFF CXX_VISIBILITY_PRESET hidden)
set(modules jfpx_bullet_preload)
foreach(suffix IN ITEMS "" "_f64")
  if(JFPX_HAS_PRECISION${suffix})
    add_dependencies(jfpx_bullet_preload jfpx_bullet_engine${suffix})
    list(APPEND modules jfpx_bullet_engine${suffix})
  endif()
endforeach()

# Same layout as the installation: the libraries are in ../lib (or its local name) of the command.
set_target_properties(${modules} PROPERTIES
  LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/${CMAKE_INSTALL_LIBDIR} INSTALL_RPATH "$ORIGIN")
if(JFPX_INSTALL)
  install(TARGETS ${modules} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT tools)
endif()
