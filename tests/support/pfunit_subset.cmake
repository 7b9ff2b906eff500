# add_pfunit_ctest(NAME TEST_SOURCES a.pf .. [OTHER_SOURCES ..] [LINK_LIBRARIES ..] [WORKING_DIRECTORY ..] [LABELS ..])
# with the meaning that pFUnit gives it; the module `funit` is compiled once, without optimisation, for all tests.
find_package(Python3 REQUIRED COMPONENTS Interpreter)
set(PFUNIT_SUBSET ${CMAKE_CURRENT_LIST_DIR}/pfunit_subset.py)

set(folder ${CMAKE_BINARY_DIR}/funit)
file(MAKE_DIRECTORY ${folder})
add_custom_command(OUTPUT ${folder}/funit_assertions.f90
  COMMAND ${Python3_EXECUTABLE} ${PFUNIT_SUBSET} assertions ${folder}/funit_assertions.f90
  DEPENDS ${PFUNIT_SUBSET})
set(sources ${folder}/funit_assertions.f90)
foreach(name funit funit_cases funit_compare funit_conditions funit_exceptions funit_runner)
  list(APPEND sources ${CMAKE_CURRENT_LIST_DIR}/${name}.f90)
endforeach()
add_library(funit_subset STATIC ${sources})
target_compile_options(funit_subset PRIVATE -O0 -std=f2008 -fimplicit-none)
set_target_properties(funit_subset PROPERTIES Fortran_MODULE_DIRECTORY ${folder})
target_include_directories(funit_subset PUBLIC ${folder})

function(add_pfunit_ctest name)
  cmake_parse_arguments(ARG "" "WORKING_DIRECTORY" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES;LABELS" ${ARGN})
  set(folder ${CMAKE_CURRENT_BINARY_DIR}/${name}.pf)
  file(MAKE_DIRECTORY ${folder})
  set(sources)
  set(suites)
  foreach(source ${ARG_TEST_SOURCES})
    get_filename_component(suite ${source} NAME_WE)
    get_filename_component(path ${source} ABSOLUTE)
    add_custom_command(OUTPUT ${folder}/${suite}.F90
      COMMAND ${Python3_EXECUTABLE} ${PFUNIT_SUBSET} test ${path} ${folder}/${suite}.F90
      DEPENDS ${path} ${PFUNIT_SUBSET})
    list(APPEND sources ${folder}/${suite}.F90)
    list(APPEND suites ${suite})
  endforeach()
  add_custom_command(OUTPUT ${folder}/driver.f90
    COMMAND ${Python3_EXECUTABLE} ${PFUNIT_SUBSET} driver ${folder}/driver.f90 ${suites}
    DEPENDS ${PFUNIT_SUBSET})
  add_executable(${name} ${sources} ${ARG_OTHER_SOURCES} ${folder}/driver.f90)
  set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY ${folder})
  target_include_directories(${name} PRIVATE ${folder} ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_LINK_LIBRARIES} funit_subset)
  if(NOT ARG_WORKING_DIRECTORY)
    set(ARG_WORKING_DIRECTORY ${CMAKE_CURRENT_BINARY_DIR})
  endif()
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${ARG_WORKING_DIRECTORY})
  set_tests_properties(${name} PROPERTIES
    FAIL_REGULAR_EXPRESSION "Encountered 1 or more failures/errors during testing")
  if(ARG_LABELS)
    set_tests_properties(${name} PROPERTIES LABELS "${ARG_LABELS}")
  endif()
endfunction()
