!> The one rule by which arrays grow: a capacity that no longer suffices becomes half as large again (at least).
!> Arrays are stored (component, entity) and grow in their last dimension; what they held is kept.
module rf_grow
   use rf_kinds, only: wp, i1
   implicit none
   private
   public :: grow, grown_capacity

   real(wp), parameter :: margin_factor = 1.5_wp

   !> make room for at least `needed` entities in the last dimension; a new array starts with that size exactly
   interface grow
      module procedure grow_real_1, grow_real_2, grow_integer_1, grow_integer_2, grow_small_1, grow_small_2, &
         grow_logical_1, grow_logical_2
   end interface grow

contains

   !> Capacity to have when `needed` entities must fit.
   pure integer function grown_capacity(capacity, needed) result(new_capacity)
      !> present capacity [entities]
      integer, intent(in) :: capacity
      !> entities that must fit
      integer, intent(in) :: needed
      new_capacity = capacity
      if (needed > capacity) new_capacity = max(needed, int(margin_factor*real(capacity, wp)))
   end function grown_capacity

   subroutine grow_real_1(array, needed)
      real(wp), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: needed
      real(wp), allocatable :: larger(:)
      integer :: old
      old = 0
      if (allocated(array)) old = size(array)
      if (allocated(array) .and. old >= needed) return
      allocate (larger(grown_capacity(old, needed)))
      if (old > 0) larger(:old) = array
      larger(old + 1:) = 0
      call move_alloc(larger, array)
   end subroutine grow_real_1

   subroutine grow_real_2(array, needed, components)
      real(wp), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: needed
      integer, intent(in), optional :: components
      real(wp), allocatable :: larger(:, :)
      integer :: old, rows
      old = 0; rows = 1
      if (present(components)) rows = components
      if (allocated(array)) then
         old = size(array, 2); rows = size(array, 1)
         if (old >= needed) return
      end if
      allocate (larger(rows, grown_capacity(old, needed)))
      if (old > 0) larger(:, :old) = array
      larger(:, old + 1:) = 0
      call move_alloc(larger, array)
   end subroutine grow_real_2

   subroutine grow_integer_1(array, needed)
      integer, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: needed
      integer, allocatable :: larger(:)
      integer :: old
      old = 0
      if (allocated(array)) old = size(array)
      if (allocated(array) .and. old >= needed) return
      allocate (larger(grown_capacity(old, needed)))
      if (old > 0) larger(:old) = array
      larger(old + 1:) = 0
      call move_alloc(larger, array)
   end subroutine grow_integer_1

   subroutine grow_integer_2(array, needed, components)
      integer, allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: needed
      integer, intent(in), optional :: components
      integer, allocatable :: larger(:, :)
      integer :: old, rows
      old = 0; rows = 1
      if (present(components)) rows = components
      if (allocated(array)) then
         old = size(array, 2); rows = size(array, 1)
         if (old >= needed) return
      end if
      allocate (larger(rows, grown_capacity(old, needed)))
      if (old > 0) larger(:, :old) = array
      larger(:, old + 1:) = 0
      call move_alloc(larger, array)
   end subroutine grow_integer_2

   subroutine grow_small_1(array, needed)
      integer(i1), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: needed
      integer(i1), allocatable :: larger(:)
      integer :: old
      old = 0
      if (allocated(array)) old = size(array)
      if (allocated(array) .and. old >= needed) return
      allocate (larger(grown_capacity(old, needed)))
      if (old > 0) larger(:old) = array
      larger(old + 1:) = 0_i1
      call move_alloc(larger, array)
   end subroutine grow_small_1

   subroutine grow_small_2(array, needed, components)
      integer(i1), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: needed
      integer, intent(in), optional :: components
      integer(i1), allocatable :: larger(:, :)
      integer :: old, rows
      old = 0; rows = 1
      if (present(components)) rows = components
      if (allocated(array)) then
         old = size(array, 2); rows = size(array, 1)
         if (old >= needed) return
      end if
      allocate (larger(rows, grown_capacity(old, needed)))
      if (old > 0) larger(:, :old) = array
      larger(:, old + 1:) = 0_i1
      call move_alloc(larger, array)
   end subroutine grow_small_2

   subroutine grow_logical_1(array, needed)
      logical, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: needed
      logical, allocatable :: larger(:)
      integer :: old
      old = 0
      if (allocated(array)) old = size(array)
      if (allocated(array) .and. old >= needed) return
      allocate (larger(grown_capacity(old, needed)))
      if (old > 0) larger(:old) = array
      larger(old + 1:) = .false.
      call move_alloc(larger, array)
   end subroutine grow_logical_1

   subroutine grow_logical_2(array, needed, components)
      logical, allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: needed
      integer, intent(in), optional :: components
      logical, allocatable :: larger(:, :)
      integer :: old, rows
      old = 0; rows = 1
      if (present(components)) rows = components
      if (allocated(array)) then
         old = size(array, 2); rows = size(array, 1)
         if (old >= needed) return
      end if
      allocate (larger(rows, grown_capacity(old, needed)))
      if (old > 0) larger(:, :old) = array
      larger(:, old + 1:) = .false.
      call move_alloc(larger, array)
   end subroutine grow_logical_2
end module rf_grow
