!> Reads `*FRACTURE`: whether and how the body breaks in each step.
module rf_fracture_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_step
   use rf_deck_rules, only: check_single, may_be_misspelt, name_length
   use rf_failure, only: failure_t, fracture_settings_t, splitting_element, splitting_none, splitting_edge, &
      select_worst, select_separated, select_all
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_text, only: to_text
   implicit none
   private
   public :: read_fracture, check_strengths

   !> most generations of children: beyond them no element could be told from a point
   integer, parameter :: most_levels = 20

contains

   !> Settings of each step: off until the keyword appears; a step without it keeps all of the last step's, a step with it
   !> starts from the defaults.
   subroutine read_fracture(deck, settings)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(fracture_settings_t), allocatable, intent(out) :: settings(:)
      type(card_t) :: card
      type(fracture_settings_t) :: this, standard
      integer :: last_step
      allocate (settings(deck%step_count()))
      last_step = 0
      call deck%open(card, 'FRACTURE', where=in_step, about='lets the body break (off until this keyword appears). A step '// &
                     'without it keeps all of it, a step with it starts from the defaults')
      do while (deck%next(card))
         call check_single(card, last_step)
         this = standard
         this%on = .true.
         call read_choice(card, this)
         call read_limits(card, this)
         if (.not. card%describing()) settings(card%step:) = this
      end do
   end subroutine read_fracture

   !> What breaks, and which node first.
   subroutine read_choice(card, settings)
      type(card_t), intent(inout) :: card
      type(fracture_settings_t), intent(inout) :: settings
      character(len=:), allocatable :: splitting, selection
      call card%get_word('SPLITTING', splitting, allowed='ELEMENT EDGE NONE', default='ELEMENT', &
                         about='ELEMENT: cracks cut through elements; EDGE: they follow the edges of the mesh, for comparison; '// &
                         'NONE: utilisation is computed, nothing splits')
      settings%splitting = splitting_element
      if (splitting == 'EDGE') settings%splitting = splitting_edge
      if (splitting == 'NONE') settings%splitting = splitting_none
      call card%get_word('SELECT', selection, allowed='WORST SEPARATED ALL', default='WORST', &
                         about='what splits before the body is relaxed again. WORST: the node with the largest utilisation '// &
                         'alone; SEPARATED (approximate): local maxima within 2 % of it, DISTANCE apart; ALL (for comparison): '// &
                         'every node above 1')
      settings%selection = select_worst
      if (selection == 'SEPARATED') settings%selection = select_separated
      if (selection == 'ALL') settings%selection = select_all
      call card%get_real('DISTANCE', settings%distance, default=0.0_wp, above=0.0_wp, shown='10 mean edges', &
                         about='SEPARATED: smallest distance of nodes that split together')
      if (card%given('DISTANCE') .and. settings%selection /= select_separated) &
         call card%keyword_error('DISTANCE belongs to SELECT=SEPARATED')
   end subroutine read_choice

   !> Limits of splitting and events, LOCATE, STOP DROP.
   subroutine read_limits(card, settings)
      type(card_t), intent(inout) :: card
      type(fracture_settings_t), intent(inout) :: settings
      character(len=:), allocatable :: monitor
      type(fracture_settings_t) :: standard
      call card%get_integer('MAX LEVEL', settings%max_level, default=standard%max_level, at_least=0, at_most=most_levels, &
                            about='how often an element and its children can be cut')
      call card%get_integer('MAX EVENTS', settings%max_events, default=standard%max_events, at_least=1, shown='none', &
                            about='events after which the step ends')
      call card%get_yes_no('LOCATE', settings%locate, default=.true., &
                           about='find the load of an increment''s first event by an extra equilibrium')
      call card%get_real('OVERSHOOT', settings%overshoot, default=standard%overshoot, above=0.0_wp, at_most=1.0_wp, &
                         about='how far the utilisation there may lie above 1')
      call card%get_real('STOP DROP', settings%stop_drop, default=standard%stop_drop, above=0.0_wp, at_most=1.0_wp, shown='none', &
                         about='part of the peak by which a monitor''s reaction must have fallen for the step to end')
      call card%get_name('MONITOR', monitor, default='', shown='the first monitor', about='monitor that STOP DROP looks at')
      if (len(monitor) > name_length) call card%keyword_error('the name of a monitor can have '//to_text(name_length)// &
                                                              ' characters, not '//to_text(len(monitor)))
      settings%monitor = monitor
   end subroutine read_limits

   !> Materials without strength where the deck lets the body break are errors at the first *FRACTURE. Elements that never
   !> break need no strength. After read_no_split.
   subroutine check_strengths(deck, mesh, material, failure)
      type(deck_t), intent(inout) :: deck
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(failure_t), intent(in) :: failure
      type(card_t) :: card
      integer, allocatable :: first(:), n(:)
      integer :: m
      if (deck%describing()) return
      call deck%open(card, 'FRACTURE', where=in_step)
      if (.not. deck%next(card)) return
      if (may_be_misspelt(card, 'STRENGTH')) return
      call count_without_strength(mesh, material, failure, first, n)
      do m = 1, size(n)
         if (n(m) == 0 .or. len_trim(material%name(m)) == 0) cycle
         call card%keyword_error('material '//trim(material%name(m))//' has no *STRENGTH: *FRACTURE needs one for element '// &
                                 to_text(mesh%element_id(first(m)))//others(n(m) - 1)//', or *NO SPLIT')
      end do
   end subroutine check_strengths

   !> ' and 3 others'
   pure function others(n) result(text)
      integer, intent(in) :: n
      character(len=:), allocatable :: text
      text = ''
      if (n == 1) text = ' and 1 other'
      if (n > 1) text = ' and '//to_text(n)//' others'
   end function others

   !> Elements that may break but have no strength, by material.
   subroutine count_without_strength(mesh, material, failure, first, n)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(failure_t), intent(in) :: failure
      !> the first of them in the order of the deck (0: none); how many, (materials)
      integer, allocatable, intent(out) :: first(:), n(:)
      integer :: e, m
      allocate (first(size(material%name)), n(size(material%name)))
      first = 0
      n = 0
      do e = 1, mesh%n_elements
         m = material%section(mesh%section(e))%material
         if (failure%strength(m)%given .or. failure%no_split_element(e)) cycle
         if (all(failure%no_split_node(mesh%connectivity(:, e)))) cycle
         n(m) = n(m) + 1
         if (first(m) == 0) first(m) = e
         if (mesh%element_rank(e) < mesh%element_rank(first(m))) first(m) = e
      end do
   end subroutine count_without_strength
end module rf_fracture_input
