!> Whether a run is to be left, or to write a checkpoint, now: signals, and the limit of wall-clock time. Asked after every
!> iteration, so it must cost nothing.
module rf_interruption
   use rf_kinds, only: wp, i8
   use rf_clock, only: monotonic_time
   use rf_system, only: told_to_leave, told_to_save, leave_signal
   implicit none
   private
   public :: interruption_t

   !> how often it is asked between two looks at the clock, which takes longer than to read a flag
   integer(i8), parameter :: asked_a_look = 4

   type :: interruption_t
      !> moments at which the run is left, and at which a checkpoint is written, of itself: on the scale of `monotonic_time` [s]
      real(wp) :: deadline = huge(1.0_wp), save_at = huge(1.0_wp)
      !> how often it is asked until the run is left, wherever it is then (negative: this is no reason to leave it)
      integer(i8) :: leave_at = -1
      !> how often it has been asked
      integer(i8) :: times = 0
      !> the run is to be left; a checkpoint is to be written (whoever writes it takes the mark away)
      logical :: leave = .false., save = .false.
   contains
      procedure :: asked, reason
   end type interruption_t

contains

   !> Whether to stop here, at a place from which the run can go on with the same bits.
   logical function asked(self)
      class(interruption_t), intent(inout) :: self
      real(wp) :: now
      self%times = self%times + 1
      if (told_to_leave() .or. self%times == self%leave_at) self%leave = .true.
      if (min(self%deadline, self%save_at) < huge(1.0_wp) .and. mod(self%times, asked_a_look) == 0) then
         now = monotonic_time()
         self%leave = self%leave .or. now >= self%deadline
         self%save = self%save .or. now >= self%save_at
      end if
      if (told_to_save()) self%save = .true.
      asked = self%leave .or. self%save
   end function asked

   !> Why the run is left, for the log.
   function reason(self) result(text)
      class(interruption_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = leave_signal()
      if (len(text) > 0) return
      text = 'the wall-clock limit'
      if (self%times >= self%leave_at .and. self%leave_at >= 0) text = 'a test'
   end function reason

end module rf_interruption
