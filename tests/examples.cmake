# The examples run, and say what they should.
foreach(suffix IN ITEMS "" "_f64")
  if(NOT JFPX_HAS_PRECISION${suffix})
    continue()
  endif()
  add_test(NAME collider${suffix} COMMAND collider${suffix})
  set_tests_properties(collider${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "spheres 0 and 1 overlap by 0.5\n$")
  # Four quarters of a circle end where they began.
  add_test(NAME own_force${suffix} COMMAND own_force${suffix})
  set_tests_properties(own_force${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "3.14 s  \\([-+]0.0., \\+1.00\\).*12.56 s  \\(\\+1.00, [-+]0.0.\\)")
  # Without a GPU it says why it can't be used.
  add_test(NAME gpu_world${suffix} COMMAND gpu_world${suffix})
  set_tests_properties(gpu_world${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "120 steps with the same bits, [1-9][0-9]* contacts|^cuda: ")
  if(JFPX_HAS_CUDA)
    add_test(NAME cuda_world${suffix} COMMAND cuda_world${suffix})
    set_tests_properties(cuda_world${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "step 120, bodies by height: [1-9][0-9]* [1-9]|cuda_world: cuda: ")
    add_test(NAME cuda_graph${suffix} COMMAND cuda_graph${suffix})
    set_tests_properties(cuda_graph${suffix} PROPERTIES
      PASS_REGULAR_EXPRESSION "step 481: +[1-9][0-9]* contacts|cuda_graph: cuda: ")
  endif()
  add_test(NAME terrain${suffix} COMMAND terrain${suffix})
  set_tests_properties(terrain${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "have moved down: 20 of 20\nheight of the ground at x = 4: 0.80 m")
  add_test(NAME character${suffix} COMMAND character${suffix})
  set_tests_properties(character${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "x = 1.0 m, y = 0.9 m, stands\nthe crate was pushed by 0.[5-8] m\non the lift: x = 9.0 m, y = 1.9 m, stands\nafter a ride of a second: x = 9.0 m, y = 2.9 m, stands\nthe second ride has the same bits\nafter the jump: x = 13.[56] m, y = 0.9 m, stands")
  add_test(NAME porting${suffix} COMMAND porting${suffix})
  set_tests_properties(porting${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "took object 42\nthe belt has carried the parcel by 1.9 m\nthe ball lies on the ledge at y = 2.2[45] m\nthe loudest impact had 6.2 m/s\nthe player is drawn at z = 0.0[45] m\nthe player stands\nthe door is open by 1.5 rad\nshot at 15.0 m: the crate moves at 5.0 m/s\nfrozen: the crate moves at -?0.0 m/s\n[1-9][0-9]* vertices of lines")
  add_test(NAME native_world${suffix} COMMAND native_world${suffix})
  set_tests_properties(native_world${suffix} PROPERTIES
    PASS_REGULAR_EXPRESSION "[1-9][0-9]* touches, 5 balls were blown off the floor\nbodies above the floor: 1\nthe rope of 0.80 m pulls with 98 N\nthe crate's top is at (1.99|2.00) m\na ball falls by 7.7. m\n(.|\n)*the lamp has swung twice, with the same bits")
endforeach()
