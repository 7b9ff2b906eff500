# The compiler flags of every rfem target, as the interface library rfem_flags. They depend on CMAKE_BUILD_TYPE alone;
# CMAKE_Fortran_FLAGS (or FFLAGS) comes on top.
set(RFEM_BUILD_TYPES Release Debug Sanitize Coverage)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "one of: ${RFEM_BUILD_TYPES}" FORCE)
endif()
if(NOT CMAKE_BUILD_TYPE IN_LIST RFEM_BUILD_TYPES)
  message(FATAL_ERROR "CMAKE_BUILD_TYPE is ${CMAKE_BUILD_TYPE}, must be one of: ${RFEM_BUILD_TYPES}")
endif()
set(CMAKE_Fortran_FLAGS_RELEASE "" CACHE STRING "set by rfem_flags" FORCE)
set(CMAKE_Fortran_FLAGS_DEBUG "" CACHE STRING "set by rfem_flags" FORCE)

if(NOT CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  message(FATAL_ERROR "rfem is built and tested with gfortran only; found ${CMAKE_Fortran_COMPILER_ID} "
    "(${CMAKE_Fortran_COMPILER}). On Debian and Ubuntu: apt-get install gfortran")
endif()

set(RFEM_MARCH native CACHE STRING "processor to optimise for (-march=..); empty: the compiler's default")
set(march)
if(RFEM_MARCH)
  set(march -march=${RFEM_MARCH})
endif()

# -fno-trapping-math: without it loops with branches are not vectorised. No -ffast-math: NaN checks must keep working.
set(RFEM_FLAGS_RELEASE -O3 ${march} -fno-trapping-math)
# no-array-temps: a copy made for a call is no fault worth a line on stderr at run time; -Warray-temporaries names them.
set(RFEM_FLAGS_DEBUG -g -Og -fcheck=all,no-array-temps -fbacktrace -ffpe-trap=invalid,zero,overflow -finit-real=snan
  -Warray-temporaries)
set(RFEM_FLAGS_SANITIZE -g -O1 -fcheck=all,no-array-temps -fbacktrace -fsanitize=address,undefined
  -fno-sanitize-recover=undefined)
set(RFEM_FLAGS_COVERAGE -g -O0 --coverage)

string(TOUPPER ${CMAKE_BUILD_TYPE} build_type)
# -ffpe-summary=none: no list of floating-point flags at a quiet stop
set(RFEM_FLAGS -std=f2008 -fimplicit-none -ffpe-summary=none ${RFEM_FLAGS_${build_type}})

add_library(rfem_flags INTERFACE)
target_compile_options(rfem_flags INTERFACE "$<$<COMPILE_LANGUAGE:Fortran>:${RFEM_FLAGS};-Wall;-Wextra;-Wimplicit-interface>")
if(build_type STREQUAL "SANITIZE")
  target_link_options(rfem_flags INTERFACE -fsanitize=address,undefined)
elseif(build_type STREQUAL "COVERAGE")
  target_link_options(rfem_flags INTERFACE --coverage)
endif()
