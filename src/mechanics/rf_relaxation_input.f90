!> Reads `*RELAXATION`.
module rf_relaxation_input
   use rf_deck, only: deck_t
   use rf_relaxation, only: relaxation_settings_t
   implicit none
   private
   public :: read_relaxation

contains

   !> Settings of each step.
   subroutine read_relaxation(deck, settings)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(relaxation_settings_t), allocatable, intent(out) :: settings(:)
      allocate (settings(deck%step_count()))
   end subroutine read_relaxation
end module rf_relaxation_input
