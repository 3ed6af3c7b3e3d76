# Builds and runs the pinned hashes with each compiler at both ends of optimisation:
#   cmake -DBINARY_DIR=... -DCONFIG_DIR=<where jfpx/config.hpp is> [-DLAUNCHER=ccache] -P run.cmake
foreach(compiler IN ITEMS g++ clang++)
  find_program(path_of_${compiler} ${compiler})
  if(NOT path_of_${compiler})
    message("skipped: ${compiler} is not installed")
    continue()
  endif()
  foreach(level IN ITEMS O0 O3)
    set(build ${BINARY_DIR}/${compiler}-${level})
    execute_process(
      COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${build} -G Ninja
        -DCMAKE_CXX_COMPILER=${path_of_${compiler}} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
        -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-${level} -DCONFIG_DIR=${CONFIG_DIR}
      OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${build} --parallel 2
      OUTPUT_VARIABLE output RESULT_VARIABLE result)
    if(NOT result EQUAL 0)
      message(FATAL_ERROR "${compiler} -${level} does not build:\n${output}")
    endif()
    foreach(suffix IN ITEMS "" "_f64")
      execute_process(COMMAND ${build}/pinned_hashes${suffix}
        OUTPUT_VARIABLE output RESULT_VARIABLE result)
      if(NOT result EQUAL 0)
        message(FATAL_ERROR "${compiler} -${level}${suffix}: other hashes\n${output}")
      endif()
      message("${compiler} -${level}${suffix}: same hashes")
    endforeach()
  endforeach()
endforeach()
