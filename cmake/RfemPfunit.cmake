# pFUnit where it is installed, else our own small subset of it (tests/support) with the same add_pfunit_ctest().
option(RFEM_PFUNIT_SUBSET "use the pFUnit subset of tests/support even where pFUnit is installed" OFF)
if(NOT RFEM_PFUNIT_SUBSET)
  find_package(PFUNIT 4.2 QUIET)
endif()
if(PFUNIT_FOUND)
  message(STATUS "Unit tests: pFUnit ${PFUNIT_VERSION}")
else()
  message(STATUS "Unit tests: the pFUnit subset of tests/support")
  include(${PROJECT_SOURCE_DIR}/tests/support/pfunit_subset.cmake)
endif()

# rfem_unit_test(NAME): builds and registers NAME.pf of this folder as a test of its own, linked to every layer and to the
# bodies and meshes of tests/support, label `unit`.
# It runs in a folder of its own; RFEM_SOURCE_DIR tells it where the project's files are.
function(rfem_unit_test name)
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/work/${name})
  file(MAKE_DIRECTORY ${folder})
  add_pfunit_ctest(${name}
    TEST_SOURCES ${name}.pf
    LINK_LIBRARIES rfem_test_body rfem_test_meshes rfem_app
    WORKING_DIRECTORY ${folder}
    LABELS unit)
  target_compile_options(${name} PRIVATE -ffree-line-length-none)
  # A .pf file makes temporaries and compares reals as it likes; what counts are the warnings in src.
  target_compile_options(${name} PRIVATE -w)
  set_tests_properties(${name} PROPERTIES
    LABELS unit
    TIMEOUT 300
    ENVIRONMENT "OMP_WAIT_POLICY=passive;RFEM_SOURCE_DIR=${PROJECT_SOURCE_DIR}")
endfunction()
