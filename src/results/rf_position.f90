!> Where in a run a state stands: what every history row, event and frame says of itself.
module rf_position
   use rf_kinds, only: wp
   implicit none
   private
   public :: position_t
   public :: frame_start, frame_before_event, frame_after_event, frame_settled, frame_not_converged

   !> kinds of frames
   integer, parameter :: frame_start = 0, frame_before_event = 1, frame_after_event = 2, frame_settled = 3, &
      frame_not_converged = 4

   type :: position_t
      !> step and increment, from 1; row 0 is step 1, increment 0
      integer :: step = 1, increment = 0
      !> total time [time], part of the step that is done [-]
      real(wp) :: time = 0, load_factor = 0
      !> it is the last increment of its step
      logical :: last = .false.
      !> the load is that of the increment's first event, not its own
      logical :: located = .false.
      !> the step is dynamic: increments are time steps, and rows and frames are due at equal parts of the step unless
      !> *OUTPUT counts time steps; part of the step done at the last state
      logical :: in_time = .false.
      real(wp) :: last_factor = 0
      !> what is due of this state of a dynamic step
      logical :: row_due = .false., frame_due = .false.
   end type position_t

end module rf_position
