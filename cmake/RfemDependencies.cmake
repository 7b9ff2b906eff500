# What rfem builds on. Each is looked for in the order written here; what is missing is named with its Debian package.
#   OpenMP  required   from the compiler
#   HDF5    required   1. a target hdf5::hdf5_fortran of an enclosing project  2. CMake's FindHDF5 (HDF5_ROOT, h5fc)
#   METIS   optional   1. METIS_ROOT, CMAKE_PREFIX_PATH  2. pkg-config  3. the system's folders

find_package(OpenMP COMPONENTS Fortran)
if(NOT OpenMP_Fortran_FOUND)
  message(FATAL_ERROR "The Fortran compiler has no OpenMP. On Debian and Ubuntu: apt-get install gfortran")
endif()
target_link_libraries(rfem_flags INTERFACE OpenMP::OpenMP_Fortran)

if(NOT TARGET hdf5::hdf5_fortran)
  find_package(HDF5 COMPONENTS C Fortran)
  if(NOT HDF5_FOUND OR NOT TARGET hdf5::hdf5_fortran)
    message(FATAL_ERROR "HDF5 with its Fortran interface was not found. On Debian and Ubuntu: apt-get install "
      "libhdf5-dev. Elsewhere: set HDF5_ROOT to where it is installed (built with the same compiler).")
  endif()
  if(HDF5_IS_PARALLEL)
    message(FATAL_ERROR "This HDF5 is built for MPI; rfem needs a serial one. On Debian and Ubuntu: apt-get install "
      "libhdf5-dev. Elsewhere: set HDF5_ROOT.")
  endif()
endif()

# rfem_metis: link to it where METIS is used; RFEM_METIS says whether it is there.
find_package(PkgConfig QUIET)
if(PkgConfig_FOUND)
  pkg_check_modules(PC_METIS QUIET metis)
endif()
find_path(METIS_INCLUDE_DIR metis.h HINTS ${METIS_ROOT} $ENV{METIS_ROOT} ${PC_METIS_INCLUDE_DIRS} PATH_SUFFIXES include)
find_library(METIS_LIBRARY metis HINTS ${METIS_ROOT} $ENV{METIS_ROOT} ${PC_METIS_LIBRARY_DIRS} PATH_SUFFIXES lib)
add_library(rfem_metis INTERFACE)
set(RFEM_METIS OFF)
if(METIS_INCLUDE_DIR AND METIS_LIBRARY)
  file(STRINGS ${METIS_INCLUDE_DIR}/metis.h metis_width REGEX "^#define[ \t]+IDXTYPEWIDTH[ \t]+32")
  if(metis_width)
    set(RFEM_METIS ON)
    target_link_libraries(rfem_metis INTERFACE ${METIS_LIBRARY})
    message(STATUS "METIS: ${METIS_LIBRARY}")
  else()
    message(STATUS "METIS: ${METIS_LIBRARY} is not used, its indices are not 32 bits wide")
  endif()
else()
  message(STATUS "METIS: not found, built without it (on Debian and Ubuntu: apt-get install libmetis-dev)")
endif()
