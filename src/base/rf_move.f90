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

   !> how far the moving has come
   type :: progress_t
      !> 1 to twice the number of runs; entries of that run that are still to be moved
      integer :: turn = 0, left = 0
      !> the portion: its first place before and now, how many entries
      integer :: from = 0, to = 0, n = 0
   end type progress_t

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
      type(progress_t) :: now
      do while (next_portion(runs, now))
         buffer(:now%n) = array(now%from:now%from + now%n - 1)
         array(now%to:now%to + now%n - 1) = buffer(:now%n)
      end do
   end subroutine move_real_1

   subroutine move_integer_1(array, runs)
      integer, intent(inout) :: array(:)
      type(runs_t), intent(in) :: runs
      integer :: buffer(portion)
      type(progress_t) :: now
      do while (next_portion(runs, now))
         buffer(:now%n) = array(now%from:now%from + now%n - 1)
         array(now%to:now%to + now%n - 1) = buffer(:now%n)
      end do
   end subroutine move_integer_1

   subroutine move_logical_1(array, runs)
      logical, intent(inout) :: array(:)
      type(runs_t), intent(in) :: runs
      logical :: buffer(portion)
      type(progress_t) :: now
      do while (next_portion(runs, now))
         buffer(:now%n) = array(now%from:now%from + now%n - 1)
         array(now%to:now%to + now%n - 1) = buffer(:now%n)
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

   !> The next portion to be moved, so that nothing is overwritten before it has moved: runs that move to lower places in
   !> ascending order, each from its beginning, then those that move to higher ones in descending order, each from its end.
   !> False: all is done.
   logical function next_portion(runs, now) result(is_one)
      type(runs_t), intent(in) :: runs
      type(progress_t), intent(inout) :: now
      integer :: i, offset
      is_one = .true.
      do while (now%left == 0)
         now%turn = now%turn + 1
         is_one = now%turn <= 2*runs%n
         if (.not. is_one) return
         i = run_of(runs, now%turn)
         if (now%turn <= runs%n .eqv. runs%run(2, i) < runs%run(1, i)) now%left = runs%run(3, i)
         if (runs%run(2, i) == runs%run(1, i)) now%left = 0
      end do
      i = run_of(runs, now%turn)
      now%n = min(portion, now%left)
      offset = now%left - now%n
      if (now%turn <= runs%n) offset = runs%run(3, i) - now%left
      now%from = runs%run(1, i) + offset
      now%to = runs%run(2, i) + offset
      now%left = now%left - now%n
   end function next_portion

   !> The run whose turn it is: all in ascending order, then all in descending order.
   pure integer function run_of(runs, turn) result(i)
      type(runs_t), intent(in) :: runs
      integer, intent(in) :: turn
      i = turn
      if (turn > runs%n) i = 2*runs%n + 1 - turn
   end function run_of

end module rf_move
