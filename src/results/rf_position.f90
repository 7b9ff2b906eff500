!> Where in a run a state stands: what every history row, event and frame says of itself.
module rf_position
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
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
   contains
      procedure :: exchange
   end type position_t

contains

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(position_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('step', self%step)
      call archive%exchange('increment', self%increment)
      call archive%exchange('time', self%time)
      call archive%exchange('load_factor', self%load_factor)
      call archive%exchange('last', self%last)
      call archive%exchange('located', self%located)
      call archive%exchange('in_time', self%in_time)
      call archive%exchange('last_factor', self%last_factor)
      call archive%exchange('row_due', self%row_due)
      call archive%exchange('frame_due', self%frame_due)
   end subroutine exchange

end module rf_position
