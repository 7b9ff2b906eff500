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
      procedure :: at, integral
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

   !> Integral of the factor from step time 0 on [time]: what a support moves by whose velocity follows the curve. Exact.
   pure real(wp) function integral(self, time)
      class(amplitude_t), intent(in) :: self
      !> step time, 0 or later [time]
      real(wp), intent(in) :: time
      real(wp) :: from, to, middle
      integer :: i, n
      n = size(self%time)
      integral = self%factor(1)*min(time, max(0.0_wp, self%time(1))) + self%factor(n)*(time - max(0.0_wp, min(time, self%time(n))))
      do i = 1, n - 1
         from = max(0.0_wp, self%time(i))
         to = min(time, self%time(i + 1))
         if (.not. to > from) cycle
         middle = (0.5_wp*(from + to) - self%time(i))/(self%time(i + 1) - self%time(i))
         integral = integral + (to - from)*(self%factor(i) + middle*(self%factor(i + 1) - self%factor(i)))
      end do
   end function integral

end module rf_amplitude
