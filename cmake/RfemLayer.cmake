# rfem_layer(name DEPENDS lower...): one layer of the house = one static library with a module folder of its own.
# Every rf_*.f90 of the calling folder belongs to it; DEPENDS lists the layers it may use.
function(rfem_layer name)
  cmake_parse_arguments(ARG "" "" "DEPENDS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/rf_*.f90)
  add_library(rfem_${name} STATIC ${sources})
  set(modules ${CMAKE_BINARY_DIR}/modules/${name})
  set_target_properties(rfem_${name} PROPERTIES Fortran_MODULE_DIRECTORY ${modules} LINKER_LANGUAGE Fortran)
  target_include_directories(rfem_${name} PUBLIC ${modules})
  target_link_libraries(rfem_${name} PUBLIC rfem_flags)
  foreach(lower ${ARG_DEPENDS})
    target_link_libraries(rfem_${name} PUBLIC rfem_${lower})
  endforeach()
endfunction()
