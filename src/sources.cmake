# The sources of the libraries. Folders are listed from the lowest layer to the highest: a file may include files of its
# own folder and of folders that precede it in this list (tests/docs/layers.sh).
foreach(folder IN ITEMS base ranks collide scene sphere_collider contact_solver world thesis mpi)
  include(${CMAKE_CURRENT_LIST_DIR}/${folder}/sources.cmake)
endforeach()
