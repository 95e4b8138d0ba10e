# Given to CMake as CMAKE_PROJECT_INCLUDE where ROS comes from wheels; an apt installation does not need it.
#
# The wheels' exported `*__rosidl_generator_py` targets name include folders of the machine that built the wheels, and
# CMake refuses targets whose include folders do not exist. They are emptied when the project has been read, so that the
# package's own CMakeLists.txt stays as on a robot; the compiler finds Python's headers through FindPython.

function(_forget_foreign_includes)
  get_property(targets DIRECTORY "${CMAKE_SOURCE_DIR}" PROPERTY IMPORTED_TARGETS)
  foreach(target IN LISTS targets)
    if(target MATCHES "__rosidl_generator_py$")
      set_property(TARGET "${target}" PROPERTY INTERFACE_INCLUDE_DIRECTORIES "")
    endif()
  endforeach()
endfunction()

cmake_language(DEFER DIRECTORY "${CMAKE_SOURCE_DIR}" CALL _forget_foreign_includes)
