!> Curves of step time by which loads and supports follow (*AMPLITUDE).
module rf_amplitude
   use rf_kinds, only: wp
   implicit none
   private
   public :: amplitude_t

   !> piecewise linear, constant outside
   type :: amplitude_t
      character(len=80) :: name = ''
      !> step times, ascending, and factors, (points)
      real(wp), allocatable :: time(:), factor(:)
   contains
      procedure :: at
   end type amplitude_t

contains

   !> Factor at a step time.
   pure real(wp) function at(self, time)
      class(amplitude_t), intent(in) :: self
      !> step time [time]
      real(wp), intent(in) :: time
      integer :: i, n
      n = size(self%time)
      at = self%factor(n)
      if (time >= self%time(n)) return
      at = self%factor(1)
      do i = 1, n - 1
         if (time < self%time(i + 1)) exit
      end do
      if (time <= self%time(1)) return
      at = self%factor(i) + (self%factor(i + 1) - self%factor(i))*(time - self%time(i))/(self%time(i + 1) - self%time(i))
   end function at

end module rf_amplitude
