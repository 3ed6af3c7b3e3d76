# Builds and runs the pinned hashes with each compiler, optimisation level and kind of processor:
#   cmake -DBINARY_DIR=... -DCONFIG_DIR=<where jfpx/config.hpp is> [-DLAUNCHER=ccache] [-DALL=ON] -P run.cmake
# Without ALL, the two ends of optimisation. With it, all of them and as many threads as 1 to 8; what
# this processor or machine can't do is said and left out.
set(flavours "-O0" "-O3")
set(threads 1)
if(ALL)
  set(flavours "-O0" "-O2" "-O3")
  set(threads 1 2 3 4 5 6 7 8)
  file(STRINGS /proc/cpuinfo flags REGEX "^flags" LIMIT_COUNT 1)
  # What each level has that the one below has not, and the compilers use.
  set(needs_v2 sse4_2 ssse3 popcnt)
  set(needs_v3 avx2 fma bmi2)
  set(needs_v4 avx512f avx512dq avx512vl)
  foreach(level IN ITEMS v2 v3 v4)
    set(missing "")
    foreach(need IN LISTS needs_${level})
      if(NOT flags MATCHES " ${need}( |$)")
        list(APPEND missing ${need})
      endif()
    endforeach()
    if(missing)
      message("skipped: x86-64-${level}, for this processor lacks ${missing}")
    else()
      list(APPEND flavours "-O2 -march=x86-64-${level}" "-O3 -march=x86-64-${level}")
    endif()
  endforeach()
endif()

cmake_host_system_information(RESULT processors QUERY NUMBER_OF_LOGICAL_CORES)
foreach(compiler IN ITEMS g++ clang++)
  find_program(path_of_${compiler} ${compiler})
  if(NOT path_of_${compiler})
    message("skipped: ${compiler} is not installed")
    continue()
  endif()
  foreach(flavour IN LISTS flavours)
    string(REPLACE " -march=" "-" folder "${flavour}")
    set(build ${BINARY_DIR}/${compiler}${folder})
    execute_process(
      COMMAND ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${build} -G Ninja
        -DCMAKE_CXX_COMPILER=${path_of_${compiler}} -DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}
        -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=${flavour} -DCONFIG_DIR=${CONFIG_DIR}
      OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
    execute_process(COMMAND ${CMAKE_COMMAND} --build ${build} --parallel ${processors}
      OUTPUT_VARIABLE output RESULT_VARIABLE result)
    if(NOT result EQUAL 0)
      message(FATAL_ERROR "${compiler} ${flavour} does not build:\n${output}")
    endif()
    foreach(suffix IN ITEMS "" "_f64")
      execute_process(COMMAND ${build}/pinned_hashes${suffix} ${threads}
        OUTPUT_VARIABLE output RESULT_VARIABLE result)
      if(NOT result EQUAL 0)
        message(FATAL_ERROR "${compiler} ${flavour}${suffix}: other hashes\n${output}")
      endif()
      message("${compiler} ${flavour}${suffix}: same hashes")
    endforeach()
  endforeach()
endforeach()
