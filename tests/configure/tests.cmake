# jfpx_add_configure_test(STEP NAME): check.sh STEP as the ctest NAME.
function(jfpx_add_configure_test step name)
  add_test(NAME ${name} COMMAND
    ${CMAKE_CURRENT_SOURCE_DIR}/configure/check.sh ${step} ${PROJECT_BINARY_DIR}/configure-test)
  set_tests_properties(${name} PROPERTIES TIMEOUT 300 ENVIRONMENT "CXX=${CMAKE_CXX_COMPILER}")
endfunction()
jfpx_add_configure_test(signs Configure.TakesFoldersOfAnyName)
jfpx_add_configure_test(no_tool Configure.HasTestsWithoutTheTool)
jfpx_add_configure_test(absolute Configure.RefusesAbsoluteFolders)
jfpx_add_configure_test(cuda Configure.LeavesOutCudaThatDoesNotFit)
jfpx_add_configure_test(presets Configure.PresetsSetEverySwitch)
jfpx_add_configure_test(precisions Configure.BuildsOnePrecision)
