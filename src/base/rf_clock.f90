!> Time: since the clock was set (monotonic, not moved by changes of the system's date), of the processor, of the calendar.
module rf_clock
   use rf_kinds, only: wp, i8
   implicit none
   private
   public :: stopwatch_t, monotonic_time, processor_time, date_text

   !> sums the wall-clock time between start and stop over any number of turns
   type :: stopwatch_t
      !> seconds of all turns that have ended
      real(wp) :: total = 0
      !> turns that have ended
      integer(i8) :: turns = 0
      real(wp), private :: begun = 0
      logical, private :: runs = .false.
   contains
      procedure :: start, stop => halt, elapsed
   end type stopwatch_t

contains

   !> Seconds since some fixed moment; differences of it are wall-clock times.
   real(wp) function monotonic_time()
      integer(i8) :: ticks, rate
      call system_clock(ticks, rate)
      monotonic_time = 0
      if (rate > 0_i8) monotonic_time = real(ticks, wp)/real(rate, wp)
   end function monotonic_time

   !> Seconds of processor time that the program has used, all threads together.
   real(wp) function processor_time()
      call cpu_time(processor_time)
   end function processor_time

   !> Date and time of day with the zone, as ISO 8601: 2026-11-21T21:24:45+01:00.
   function date_text() result(text)
      character(len=25) :: text
      character(len=8) :: date
      character(len=10) :: time
      character(len=5) :: zone
      call date_and_time(date, time, zone)
      text = date(1:4)//'-'//date(5:6)//'-'//date(7:8)//'T'//time(1:2)//':'//time(3:4)//':'//time(5:6)
      text(20:25) = zone(1:3)//':'//zone(4:5)
   end function date_text

   !> Begin a turn.
   subroutine start(self)
      class(stopwatch_t), intent(inout) :: self
      self%begun = monotonic_time()
      self%runs = .true.
   end subroutine start

   !> End a turn; without a start before it nothing happens.
   subroutine halt(self)
      class(stopwatch_t), intent(inout) :: self
      if (.not. self%runs) return
      self%total = self%total + (monotonic_time() - self%begun)
      self%turns = self%turns + 1_i8
      self%runs = .false.
   end subroutine halt

   !> Seconds of all turns, the running one included.
   real(wp) function elapsed(self)
      class(stopwatch_t), intent(in) :: self
      elapsed = self%total
      if (self%runs) elapsed = elapsed + (monotonic_time() - self%begun)
   end function elapsed

end module rf_clock
