# The libraries rfem builds on: HDF5 (results), METIS (numbering; optional), OpenMP.
find_package(HDF5 REQUIRED COMPONENTS C Fortran)
find_package(OpenMP REQUIRED COMPONENTS Fortran)
find_path(METIS_INCLUDE_DIR metis.h)
find_library(METIS_LIBRARY metis)
target_link_libraries(rfem_flags INTERFACE OpenMP::OpenMP_Fortran)
