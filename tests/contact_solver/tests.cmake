jfpx_add_test(soft_step_test INTERNAL SOURCES
  contact_solver/greedy_coloring_test.cpp
  contact_solver/row_table_test.cpp
  contact_solver/sequence_numbers_test.cpp
  contact_solver/sphere_row_test.cpp)
