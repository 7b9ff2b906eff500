!> Reads `*RELAXATION`: how each step goes to equilibrium.
module rf_relaxation_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_step
   use rf_deck_rules, only: check_single
   use rf_relaxation, only: relaxation_settings_t, damping_adaptive, damping_kinetic, damping_local, damping_viscous
   implicit none
   private
   public :: read_relaxation

   !> FACTOR where it is not given: LOCAL as in FLAC, VISCOUS critical
   real(wp), parameter :: standard_local = 0.8_wp, standard_viscous = 1.0_wp

contains

   !> Settings of each step: a step without the keyword keeps all of the last step's, a step with it starts from the
   !> defaults.
   subroutine read_relaxation(deck, settings)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(relaxation_settings_t), allocatable, intent(out) :: settings(:)
      type(card_t) :: card
      type(relaxation_settings_t) :: this, standard
      integer :: last_step
      allocate (settings(deck%step_count()))
      last_step = 0
      call deck%open(card, 'RELAXATION', where=in_step, standing=.true., about='how a step goes to equilibrium: explicit '// &
                     'dynamic relaxation. A step without it keeps all of it, a step with it starts from the defaults')
      do while (deck%next(card))
         call check_single(card, last_step)
         this = standard
         call read_limits(card, this)
         call read_damping(card, this)
         if (.not. card%describing()) settings(card%step:) = this
      end do
   end subroutine read_relaxation

   !> When a state is taken.
   subroutine read_limits(card, settings)
      type(card_t), intent(inout) :: card
      type(relaxation_settings_t), intent(inout) :: settings
      type(relaxation_settings_t) :: standard
      call card%get_real('TOLERANCE', settings%tolerance, default=standard%tolerance, above=0.0_wp, below=1.0_wp, &
                         about='residual, relative to the forces, at which a state is in equilibrium')
      call card%get_real('EVENT TOLERANCE', settings%event_tolerance, default=standard%event_tolerance, above=0.0_wp, &
                         below=1.0_wp, about='the same for states that only choose the next event')
      call card%get_integer('MAX ITERATIONS', settings%max_iterations, default=standard%max_iterations, at_least=1, &
                            about='of a relaxation')
      call card%get_yes_no('CONTINUE', settings%continue_anyway, default=.false., &
                           about='go on when a state is still above 100 x tolerance there')
   end subroutine read_limits

   !> Damping and its factor.
   subroutine read_damping(card, settings)
      type(card_t), intent(inout) :: card
      type(relaxation_settings_t), intent(inout) :: settings
      character(len=:), allocatable :: damping
      logical :: given
      real(wp) :: factor
      call card%get_word('DAMPING', damping, allowed='ADAPTIVE KINETIC LOCAL VISCOUS', default='ADAPTIVE', &
                         about='of the motion towards equilibrium')
      given = card%given('FACTOR')
      select case (damping)
      case ('LOCAL')
         settings%damping = damping_local
         call get_factor(standard_local, below=1.0_wp)
      case ('VISCOUS')
         settings%damping = damping_viscous
         call get_factor(standard_viscous)
      case default
         settings%damping = merge(damping_kinetic, damping_adaptive, damping == 'KINETIC')
         if (given) call card%keyword_error('FACTOR belongs to DAMPING=LOCAL or VISCOUS, not to '//damping)
         if (card%describing()) call get_factor(standard_local)
      end select

   contains

      subroutine get_factor(standard, below)
         real(wp), intent(in) :: standard
         real(wp), intent(in), optional :: below
         character(len=:), allocatable :: shown
         if (card%describing()) then
            shown = '0.8 for LOCAL, 1 for VISCOUS'
            call card%get_real('FACTOR', factor, default=standard, above=0.0_wp, shown=shown, &
                               about='LOCAL: part of the force out of balance, below 1; VISCOUS: fraction of critical damping')
         else
            call card%get_real('FACTOR', factor, default=standard, above=0.0_wp, below=below)
         end if
         settings%factor = factor
      end subroutine get_factor
   end subroutine read_damping
end module rf_relaxation_input
