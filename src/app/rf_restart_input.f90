!> Reads `*RESTART`: when a run writes checkpoints, and how long it may take.
module rf_restart_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_both
   implicit none
   private
   public :: restart_settings_t, read_restart

   !> when checkpoints are written
   type :: restart_settings_t
      !> some are, without being asked for by a signal
      logical :: write = .false.
      !> increments from one to the next; given in the deck (else dynamic steps have their own default)
      integer :: frequency = 1
      logical :: given = .false.
      !> wall-clock time after which the run is left (huge: none) [s]
      real(wp) :: wall_time = huge(1.0_wp)
   end type restart_settings_t

contains

   !> Read the keyword; it holds for the whole run wherever it stands.
   subroutine read_restart(deck, settings)
      type(deck_t), intent(inout) :: deck
      type(restart_settings_t), intent(out) :: settings
      type(card_t) :: card
      integer :: n
      n = 0
      call deck%open(card, 'RESTART', where=in_both, about='checkpoints, from which a run that was interrupted goes on '// &
                     '(rfem --restart JOB.rst.h5). One a deck; it holds for all steps')
      do while (deck%next(card))
         n = n + 1
         if (n > 1) call card%keyword_error('a deck can have one *RESTART only: it holds for all steps')
         call card%get_flag('WRITE', settings%write, about='it must be given')
         if (.not. (settings%write .or. card%describing())) &
            call card%keyword_error('*RESTART needs WRITE; to go on from a checkpoint: rfem --restart JOB.rst.h5')
         call card%get_integer('FREQUENCY', settings%frequency, default=1, at_least=1, &
                               shown='1; in a dynamic step 20 checkpoints', about='increments from one checkpoint '// &
                               'to the next; in a dynamic step time steps. The last increment of a step has one too')
         settings%given = card%given('FREQUENCY')
         if (.not. (card%given('WALLTIME') .or. card%describing())) cycle
         call card%get_real('WALLTIME', settings%wall_time, default=huge(1.0_wp), above=0.0_wp, unit='s', shown='none', &
                            about='wall-clock time from the start of the program after which it writes a checkpoint and '// &
                            'ends with status 4')
      end do
   end subroutine read_restart

end module rf_restart_input
