!> Runs of entities that move to new places in their arrays, their order kept: how an array follows where few entries come
!> in between or go out. It costs the moving of memory from the first place that changes on, no more.
module rf_move
   use rf_kinds, only: wp
   use rf_grow, only: grow
   implicit none
   private
   public :: runs_t, move

   !> entries that are moved at once: what lies between old and new place must not be overwritten before it was read
   integer, parameter :: portion = 512

   type :: runs_t
      integer :: n = 0
      !> first place before, first place now, how many, (3, capacity); both ascend
      integer, allocatable :: run(:, :)
   contains
      procedure :: add, scale, clear
   end type runs_t

   !> move the runs of an array
   interface move
      module procedure move_real_1, move_real_2, move_integer_1, move_integer_2, move_logical_1
   end interface move

contains

   subroutine clear(self)
      class(runs_t), intent(inout) :: self
      self%n = 0
      call grow(self%run, 1, 3)
   end subroutine clear

   !> One more run; one that goes on where the last one ends joins it.
   subroutine add(self, from, to, length)
      class(runs_t), intent(inout) :: self
      integer, intent(in) :: from, to, length
      if (length < 1) return
      if (self%n > 0) then
         associate (last => self%run(:, self%n))
            if (from == last(1) + last(3) .and. to == last(2) + last(3)) then
               last(3) = last(3) + length
               return
            end if
         end associate
      end if
      self%n = self%n + 1
      call grow(self%run, self%n, 3)
      self%run(:, self%n) = [from, to, length]
   end subroutine add

   !> The runs of an array that has several entries, stored together, for each of these.
   pure subroutine scale(self, width, runs)
      class(runs_t), intent(in) :: self
      integer, intent(in) :: width
      type(runs_t), intent(out) :: runs
      runs%n = self%n
      allocate (runs%run(3, max(1, self%n)))
      runs%run(1:2, :self%n) = width*(self%run(1:2, :self%n) - 1) + 1
      runs%run(3, :self%n) = width*self%run(3, :self%n)
   end subroutine scale

   subroutine move_real_1(array, runs)
      !> has room for all runs
      real(wp), intent(inout) :: array(:)
      type(runs_t), intent(in) :: runs
      real(wp) :: buffer(portion)
      integer :: k, i, first, n
      do k = 1, 2*runs%n
         call next(runs, k, i)
         if (i == 0) cycle
         associate (from => runs%run(1, i), to => runs%run(2, i), length => runs%run(3, i))
            do first = 0, length - 1, portion
               n = min(portion, length - first)
               associate (offset => merge(first, length - first - n, to < from))
                  buffer(:n) = array(from + offset:from + offset + n - 1)
                  array(to + offset:to + offset + n - 1) = buffer(:n)
               end associate
            end do
         end associate
      end do
   end subroutine move_real_1

   subroutine move_integer_1(array, runs)
      integer, intent(inout) :: array(:)
      type(runs_t), intent(in) :: runs
      integer :: buffer(portion)
      integer :: k, i, first, n
      do k = 1, 2*runs%n
         call next(runs, k, i)
         if (i == 0) cycle
         associate (from => runs%run(1, i), to => runs%run(2, i), length => runs%run(3, i))
            do first = 0, length - 1, portion
               n = min(portion, length - first)
               associate (offset => merge(first, length - first - n, to < from))
                  buffer(:n) = array(from + offset:from + offset + n - 1)
                  array(to + offset:to + offset + n - 1) = buffer(:n)
               end associate
            end do
         end associate
      end do
   end subroutine move_integer_1

   subroutine move_logical_1(array, runs)
      logical, intent(inout) :: array(:)
      type(runs_t), intent(in) :: runs
      logical :: buffer(portion)
      integer :: k, i, first, n
      do k = 1, 2*runs%n
         call next(runs, k, i)
         if (i == 0) cycle
         associate (from => runs%run(1, i), to => runs%run(2, i), length => runs%run(3, i))
            do first = 0, length - 1, portion
               n = min(portion, length - first)
               associate (offset => merge(first, length - first - n, to < from))
                  buffer(:n) = array(from + offset:from + offset + n - 1)
                  array(to + offset:to + offset + n - 1) = buffer(:n)
               end associate
            end do
         end associate
      end do
   end subroutine move_logical_1

   !> Entities with several components.
   subroutine move_real_2(array, runs)
      real(wp), intent(inout), contiguous :: array(:, :)
      type(runs_t), intent(in) :: runs
      type(runs_t) :: flat
      call runs%scale(size(array, 1), flat)
      call move_real_flat(size(array), array, flat)
   end subroutine move_real_2

   subroutine move_real_flat(n, array, runs)
      integer, intent(in) :: n
      real(wp), intent(inout) :: array(n)
      type(runs_t), intent(in) :: runs
      call move_real_1(array, runs)
   end subroutine move_real_flat

   subroutine move_integer_2(array, runs)
      integer, intent(inout), contiguous :: array(:, :)
      type(runs_t), intent(in) :: runs
      type(runs_t) :: flat
      call runs%scale(size(array, 1), flat)
      call move_integer_flat(size(array), array, flat)
   end subroutine move_integer_2

   subroutine move_integer_flat(n, array, runs)
      integer, intent(in) :: n
      integer, intent(inout) :: array(n)
      type(runs_t), intent(in) :: runs
      call move_integer_1(array, runs)
   end subroutine move_integer_flat

   !> The run whose turn it is, so that none is overwritten before it has moved: those that move to lower places in
   !> ascending order, then those that move to higher ones in descending order. 0: none.
   pure subroutine next(runs, turn, i)
      type(runs_t), intent(in) :: runs
      !> 1 to twice the number of runs
      integer, intent(in) :: turn
      integer, intent(out) :: i
      i = turn
      if (turn > runs%n) i = 2*runs%n + 1 - turn
      if (runs%run(2, i) == runs%run(1, i) .or. (runs%run(2, i) < runs%run(1, i) .neqv. turn <= runs%n)) i = 0
   end subroutine next

end module rf_move
