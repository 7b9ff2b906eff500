!> Kinds of numbers used everywhere.
module rf_kinds
   use, intrinsic :: iso_fortran_env, only: real64, int8, int64
   implicit none
   private

   !> working precision of all physical quantities
   integer, parameter, public :: wp = real64
   !> small integers that are stored per node or element (levels, modes, flags)
   integer, parameter, public :: i1 = int8
   !> counters of work and positions in large files
   integer, parameter, public :: i8 = int64
   !> the circle's number
   real(wp), parameter, public :: pi = 3.14159265358979323846_wp
   !> degrees to radians
   real(wp), parameter, public :: degree = pi/180.0_wp
end module rf_kinds
