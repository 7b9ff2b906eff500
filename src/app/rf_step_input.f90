!> Reads the steps (`*STEP`, `*STATIC`, `*DYNAMIC`) and the job's name, and names the keywords that no reader opens.
module rf_step_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_model, in_step
   use rf_deck_rules, only: check_single, may_be_misspelt
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_text, only: to_text
   implicit none
   private
   public :: step_t, read_steps, read_job, declare_others

   !> total/first must be whole to this part of itself (deck.md)
   real(wp), parameter :: whole_to = 1.0e-3_wp
   !> most increments of a step
   real(wp), parameter :: most_increments = 1.0e9_wp

   !> one step
   type :: step_t
      !> empty if it has none
      character(len=:), allocatable :: name
      !> limit of the number of increments (0: none)
      integer :: increment_limit = 0
      !> first increment as written, step time at the end [time]; increments are total_time/n_increments long
      real(wp) :: first_increment = 1, total_time = 1
      integer :: n_increments = 1
      !> explicit dynamics in real time; time increment asked for (0: the largest that is safe) [time]; time steps from one
      !> look at the criterion to the next
      logical :: dynamic = .false.
      real(wp) :: time_increment = 0
      integer :: look = 10
   end type step_t

contains

   !> Read all steps.
   subroutine read_steps(deck, steps, diagnostics)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(step_t), allocatable, intent(out) :: steps(:)
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      logical, allocatable :: static(:)
      integer :: n
      n = max(1, deck%step_count()) ! a described deck has one
      allocate (steps(n), static(n))
      static = .false.
      call deck%open(card, 'STEP', where=in_step, about='begins a step, which *END STEP ends')
      do while (deck%next(card))
         call card%get_integer('INC', steps(card%step)%increment_limit, default=0, at_least=1, shown='none', &
                               about='a step with more increments is an error')
         call card%get_text('NAME', steps(card%step)%name, default='', about='name of the step in the log and the results')
      end do
      call read_static(deck, steps, static)
      call read_dynamic(deck, static, steps)
      if (deck%describing()) return
      call report_missing(deck, static .or. steps%dynamic, diagnostics)
      steps = steps(:deck%step_count())
   end subroutine read_steps

   !> `*STATIC`: the increments of a step.
   subroutine read_static(deck, steps, static)
      type(deck_t), intent(inout) :: deck
      type(step_t), intent(inout) :: steps(:)
      !> the step has the keyword
      logical, intent(inout) :: static(:)
      type(card_t) :: card
      integer :: last_step
      logical :: noted
      last_step = 0
      noted = .false.
      call deck%open(card, 'STATIC', where=in_step, about='equal increments, each to equilibrium by explicit dynamic relaxation')
      do while (deck%next(card))
         call check_single(card, last_step)
         static(card%step) = .true.
         if (.not. card%line()) cycle
         associate (step => steps(card%step))
            call card%field_real('first increment', step%first_increment, default=1.0_wp, above=0.0_wp, unit='time', &
                                 about='length of the increments; total/first must be whole to 1 in 1000')
            call card%field_real('total', step%total_time, default=1.0_wp, above=0.0_wp, unit='time', &
                                 about='step time at the end of the step')
            call skip_rest(card, noted)
            if (card%line_failed) cycle
            call count_increments(card, step)
         end associate
      end do
   end subroutine read_static

   !> `*DYNAMIC, EXPLICIT`: time steps with the real mass.
   subroutine read_dynamic(deck, static, steps)
      type(deck_t), intent(inout) :: deck
      !> the step has *STATIC, (steps)
      logical, intent(in) :: static(:)
      type(step_t), intent(inout) :: steps(:)
      type(card_t) :: card
      integer :: last_step
      logical :: explicit
      last_step = 0
      call deck%open(card, 'DYNAMIC', where=in_step, about='motion in real time with the real mass, by central differences')
      do while (deck%next(card))
         call check_single(card, last_step)
         call card%get_flag('EXPLICIT', explicit, about='must be there: implicit dynamics is none of this program''s')
         if (.not. (explicit .or. card%describing())) call card%keyword_error('*DYNAMIC needs EXPLICIT: there is no implicit one')
         associate (step => steps(card%step))
            call card%get_integer('LOOK', step%look, default=10, at_least=1, about='time steps from one look at the criterion '// &
                                  'to the next')
            step%dynamic = .true.
            if (static(card%step)) call card%keyword_error('the step has *STATIC already')
            if (step%increment_limit > 0) call card%keyword_error('INC limits the increments of *STATIC; this step is dynamic')
            if (.not. card%needs_line('time increment, total')) cycle
            call card%field_real('time increment', step%time_increment, default=0.0_wp, at_least=0.0_wp, unit='time', &
                                 shown='0', about='longest time step; 0: the longest that is safe')
            call card%field_real('total', step%total_time, above=0.0_wp, unit='time', about='step time at the end of the step')
         end associate
      end do
   end subroutine read_dynamic

   !> Fields 3 and 4 bound increments that other programs choose themselves.
   subroutine skip_rest(card, noted)
      type(card_t), intent(inout) :: card
      !> the note has been given
      logical, intent(inout) :: noted
      logical :: given
      given = .not. card%next_is_empty()
      call card%field_skip('least increment')
      given = given .or. .not. card%next_is_empty()
      call card%field_skip('largest increment')
      if (given .and. .not. noted) call card%note('fields 3 and 4 of *STATIC are not used and skipped: the increments are equal')
      noted = noted .or. given
   end subroutine skip_rest

   !> Number of increments, which must be whole and within the step's limit.
   subroutine count_increments(card, step)
      type(card_t), intent(inout) :: card
      type(step_t), intent(inout) :: step
      real(wp) :: ratio
      if (step%total_time/most_increments > step%first_increment) then
         call card%error('the step has too many increments: total/first increment may be '//to_text(nint(most_increments))// &
                         ' at most')
         return
      end if
      ratio = step%total_time/step%first_increment
      step%n_increments = max(1, nint(ratio))
      if (abs(ratio - step%n_increments) > whole_to*step%n_increments) then
         call card%error('total/first increment = '//to_text(real(anint(1.0e6_wp*ratio), wp)/1.0e6_wp)// &
                         ' must be a whole number (to 1 in 1000): the increments are equal')
      else if (step%increment_limit > 0 .and. step%n_increments > step%increment_limit) then
         call card%error('the step has '//to_text(step%n_increments)//' increments, more than its INC='// &
                         to_text(step%increment_limit))
      end if
   end subroutine count_increments

   !> Steps that say nothing of how they are to be run.
   subroutine report_missing(deck, static, diagnostics)
      type(deck_t), intent(inout) :: deck
      !> the step says how it is to be run, (steps)
      logical, intent(in) :: static(:)
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      type(place_t) :: nowhere
      call deck%open(card, 'STEP', where=in_step)
      if (may_be_misspelt(card, 'STATIC') .or. may_be_misspelt(card, 'DYNAMIC') .or. may_be_misspelt(card, 'STEP')) return
      if (deck%step_count() == 0) call diagnostics%error(nowhere, 'the deck has no *STEP: it says what is to be done')
      do while (deck%next(card))
         if (.not. static(card%step)) call card%keyword_error('the step has neither *STATIC nor *DYNAMIC')
      end do
   end subroutine report_missing

   !> Name of the job that *JOB gives; empty if it gives none.
   subroutine read_job(deck, name)
      type(deck_t), intent(inout) :: deck
      !> case kept
      character(len=:), allocatable, intent(out) :: name
      type(card_t) :: card
      integer :: n
      name = ''
      n = 0
      call deck%open(card, 'JOB', where=in_model, about='name of the results, and how they are computed')
      do while (deck%next(card))
         n = n + 1
         if (n > 1) call card%keyword_error('a deck can have one *JOB only')
         call card%get_text('NAME', name, default='', shown='name of the deck''s file, or rfem', &
                            about='what the names of all result files begin with (--job overrides it)')
         if (index(name, '/') > 0) call card%keyword_error('NAME='//name//' must be a name without folder; --output says where '// &
                                                           'results go')
      end do
   end subroutine read_job

   !> Name the keywords that are passed over.
   subroutine declare_others(deck)
      type(deck_t), intent(inout) :: deck
      call deck%skipped('NODE FILE')
      call deck%skipped('EL FILE')
      call deck%skipped('NODE OUTPUT')
      call deck%skipped('ELEMENT OUTPUT')
   end subroutine declare_others
end module rf_step_input
