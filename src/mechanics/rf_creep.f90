!> A relaxation that creeps: pieces that only friction holds slide on one another against the damping alone. Almost nothing
!> pushes back, the residual falls by a few parts in a thousand over hundreds of steps, and what is left of the way is far
!> longer than what steps will make of it. It is made at once (theory: eq. 14a).
module rf_creep
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_motion, only: motion_t
   implicit none
   private
   public :: creep_t

   !> A window, in square roots of the number of nodes: with that many steps a stress wave has crossed the body some times.
   !> Windows after which a relaxation counts as slow; a sound body is in equilibrium after 3 to 7 (theory: section 3).
   real(wp), parameter :: steps_of_window = 10.0_wp
   integer, parameter :: patience = 15
   !> a window that leaves less than this of the residual is no creep
   real(wp), parameter :: still_fast = 0.3_wp
   !> part of the way left that is made at once, and the longest such way, in ways of the window. Measured on 20 relaxations
   !> of a block with 126 pieces: 5,000 to 13,000 steps; with the whole way 13,000 to 20,000; with at most ten ways of the
   !> window 22,000 and more; without all this most of them stood at 5 x tolerance after 30,000
   real(wp), parameter :: part_of_way = 0.6_wp, longest_way = 100.0_wp

   type :: creep_t
      private
      !> displacements [length], (2, nodes), and residual [force] at the start of the window
      real(wp), allocatable :: from(:, :)
      real(wp) :: residual = huge(1.0_wp)
      !> step at which the next window begins, windows of rest before the one after it
      integer :: next = 0, rest = 1
   contains
      procedure :: forget, carry_on, exchange
   end type creep_t

contains

   !> A relaxation begins.
   subroutine forget(self)
      class(creep_t), intent(inout) :: self
      if (allocated(self%from)) deallocate (self%from)
      self%residual = huge(1.0_wp)
      self%next = 0
      self%rest = 1
   end subroutine forget

   !> After a step: a window begins, or ends with the body carried on along its way, after which it rests. Where the window
   !> before has not helped the rest is twice as long, so that a body that needs time only has ever more of it.
   subroutine carry_on(self, iterations, most, residual, n, motion)
      class(creep_t), intent(inout) :: self
      !> steps so far, and at most; |r| of the last one [force]; nodes
      integer, intent(in) :: iterations, most
      real(wp), intent(in) :: residual
      integer, intent(in) :: n
      type(motion_t), intent(inout) :: motion
      real(wp) :: left, ways
      integer :: window
      window = nint(steps_of_window*sqrt(real(n, wp)))
      if (iterations < patience*window .or. most - iterations < 2*window) return      ! the last way needs time to settle
      if (iterations >= self%next) then
         self%rest = merge(1, 2*self%rest, residual < self%residual)
         self%next = iterations + (1 + self%rest)*window
         call grow(self%from, n, 2)
         self%from(1, :n) = motion%ux(:n)
         self%from(2, :n) = motion%uy(:n)
         self%residual = residual
      else if (iterations == self%next - self%rest*window) then
         left = residual/self%residual
         if (left < still_fast .or. left >= 1) return
         ways = min(longest_way, -part_of_way/log(left))
         motion%ux(:n) = motion%ux(:n) + ways*(motion%ux(:n) - self%from(1, :n))
         motion%uy(:n) = motion%uy(:n) + ways*(motion%uy(:n) - self%from(2, :n))
      end if
   end subroutine carry_on

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(creep_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('from', self%from)
      call archive%exchange('residual', self%residual)
      call archive%exchange('next', self%next)
      call archive%exchange('rest', self%rest)
   end subroutine exchange

end module rf_creep
