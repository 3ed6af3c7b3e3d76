# jfpx as strangers get it. Everything that is installed must have been built.
set(kind static)
if(BUILD_SHARED_LIBS)
  set(kind shared)
endif()
# jfpx_add_install_test(STEP NAME): check.sh STEP as the ctest NAME.
function(jfpx_add_install_test step name)
  add_test(NAME ${name} COMMAND
    ${CMAKE_CURRENT_SOURCE_DIR}/install/check.sh ${step} ${PROJECT_BINARY_DIR} ${PROJECT_BINARY_DIR}/install-test)
  set_tests_properties(${name} PROPERTIES
    TIMEOUT 900 SKIP_REGULAR_EXPRESSION "skipped:" FIXTURES_REQUIRED installed
    ENVIRONMENT "KIND=${kind};HAS_CUDA=${JFPX_HAS_CUDA};HAS_BULLET=${JFPX_HAS_BULLET};HAS_MPI=${JFPX_HAS_MPI};HAS_VIEWER=${JFPX_HAS_VIEWER};CXX=${CMAKE_CXX_COMPILER};LAUNCHER=${CMAKE_CXX_COMPILER_LAUNCHER}")
endfunction()
jfpx_add_install_test(prefix Install.LeavesNoTraceOfWhereItWas)
set_tests_properties(Install.LeavesNoTraceOfWhereItWas PROPERTIES FIXTURES_REQUIRED "" FIXTURES_SETUP installed)
jfpx_add_install_test(documents Install.DocumentsLinkToInstalledFiles)
set_tests_properties(Install.DocumentsLinkToInstalledFiles PROPERTIES FIXTURES_REQUIRED "")
jfpx_add_install_test(cmake Install.ServesCMakeProjects)
jfpx_add_install_test(cuda Install.ServesCudaPrograms)
jfpx_add_install_test(pkg_config Install.ServesMakefilesThroughPkgConfig)
jfpx_add_install_test(conan Install.ServesTheTestPackageOfConan)
jfpx_add_install_test(messages Install.SaysWhatIsMissing)
jfpx_add_install_test(mismatch Install.RefusesProgramsOfOtherHeaders)
jfpx_add_install_test(symbols Install.ExportsOwnSymbolsOnly)
jfpx_add_install_test(subproject Install.LeavesOtherProjectsAlone)
jfpx_add_install_test(debian Install.DebianPackagesServeToo)

# What package managers build from.
add_test(NAME Install.RecipesFitTheProject COMMAND ${CMAKE_COMMAND}
  -DSOURCE_DIR=${PROJECT_SOURCE_DIR} -DWORK_DIR=${PROJECT_BINARY_DIR}/recipes-test
  "-DHAS_BULLET=$<AND:$<BOOL:${JFPX_HAS_BULLET}>,$<BOOL:${JFPX_HAS_PRECISION}>>" -P ${CMAKE_CURRENT_SOURCE_DIR}/install/recipes.cmake)
