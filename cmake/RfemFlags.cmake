# The compiler flags of every rfem target, as an interface library.
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Release, Debug, Sanitize or Coverage" FORCE)
endif()
set(CMAKE_Fortran_FLAGS_RELEASE "" CACHE STRING "set by rfem_flags" FORCE)
set(CMAKE_Fortran_FLAGS_DEBUG "" CACHE STRING "set by rfem_flags" FORCE)

add_library(rfem_flags INTERFACE)
target_compile_options(rfem_flags INTERFACE
  -std=f2008 -fimplicit-none -Wall -Wextra -Wimplicit-interface
  # -fno-trapping-math: without it loops with branches are not vectorised; NaN checks keep working (no -ffast-math)
  $<$<CONFIG:Release>:-O3 -march=native -fno-trapping-math>
  $<$<CONFIG:Debug>:-g -Og -fcheck=all -fbacktrace -ffpe-trap=invalid,zero,overflow -finit-real=snan>
  $<$<CONFIG:Sanitize>:-g -O1 -fcheck=all -fbacktrace -fsanitize=address,undefined -fno-sanitize-recover=undefined>
  $<$<CONFIG:Coverage>:-g -O0 --coverage>)
target_link_options(rfem_flags INTERFACE
  $<$<CONFIG:Sanitize>:-fsanitize=address,undefined>
  $<$<CONFIG:Coverage>:--coverage>)
