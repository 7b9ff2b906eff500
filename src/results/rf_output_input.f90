!> Reads what is to be written: `*OUTPUT`, `*MONITOR`, `*SECTION CHECK`, `*NODE PRINT`, `*EL PRINT`.
module rf_output_input
   use rf_kinds, only: wp
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_step
   use rf_deck_rules, only: name_table_t
   use rf_failure, only: fracture_settings_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_print_input, only: node_print_t, element_print_t, read_node_prints, read_element_prints
   use rf_text, only: to_text
   implicit none
   private
   public :: output_settings_t, monitor_t, section_check_t, node_print_t, element_print_t, output_requests_t
   public :: read_output, check_stop_drop

   !> *OUTPUT of a step
   type :: output_settings_t
      !> increments from one frame, or history row, to the next; events likewise (0: none between increments)
      integer :: field_frequency = 1, history_frequency = 1, field_events = 0, history_events = 0
      !> the deck gives them (dynamic steps have another default)
      logical :: field_given = .false., history_given = .false.
      !> files of the fields
      logical :: vtkhdf = .true., apdl = .false.
   end type output_settings_t

   !> a *MONITOR: history columns in all steps
   type :: monitor_t
      character(len=:), allocatable :: name
      !> number of the node set
      integer :: set = 0
   end type monitor_t

   !> a *SECTION CHECK: history columns in all steps
   type :: section_check_t
      character(len=:), allocatable :: name
      !> point of the line [length], unit normal [-]
      real(wp) :: point(2) = 0, normal(2) = 0
   end type section_check_t

   !> all that the deck asks for
   type :: output_requests_t
      !> (steps)
      type(output_settings_t), allocatable :: output(:)
      type(monitor_t), allocatable :: monitor(:)
      type(section_check_t), allocatable :: section(:)
      type(node_print_t), allocatable :: node_print(:)
      type(element_print_t), allocatable :: element_print(:)
   end type output_requests_t

contains

   !> Read all requests.
   subroutine read_output(deck, mesh_input, mesh, requests)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(output_requests_t), intent(out) :: requests
      call read_settings(deck, requests%output)
      call read_monitors(deck, mesh_input, requests%monitor)
      call read_sections(deck, mesh, requests%section)
      call read_node_prints(deck, mesh_input, requests%node_print)
      call read_element_prints(deck, mesh_input, requests%element_print)
   end subroutine read_output

   !> `*OUTPUT`: a step without it keeps all of it, a step with it starts from the defaults.
   subroutine read_settings(deck, output)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(output_settings_t), allocatable, intent(out) :: output(:)
      type(card_t) :: card
      type(output_settings_t) :: this, standard
      logical :: field, history, had(2)
      integer :: last_step
      allocate (output(deck%step_count()))
      last_step = 0
      had = .false.
      call deck%open(card, 'OUTPUT', where=in_step, standing=.true., about='when fields and history are written. One that is '// &
                     'not named keeps its default; a step without *OUTPUT keeps all of it, a step with it starts from the defaults')
      do while (deck%next(card))
         if (card%step /= last_step) then
            this = standard
            had = .false.
         end if
         last_step = card%step
         call card%get_flag('FIELD', field, about='for frames of all fields')
         call card%get_flag('HISTORY', history, about='for rows of the history')
         if (.not. (field .or. history)) call card%keyword_error('*OUTPUT needs FIELD or HISTORY')
         if (field .and. had(1)) call card%keyword_error('*OUTPUT, FIELD stands twice in this step')
         if (history .and. had(2)) call card%keyword_error('*OUTPUT, HISTORY stands twice in this step')
         had = had .or. [field, history]
         call read_frequencies(card, field, history, this)
         if (.not. card%describing()) output(card%step:) = this
      end do
   end subroutine read_settings

   !> The parameters of a block of `*OUTPUT`.
   subroutine read_frequencies(card, field, history, settings)
      type(card_t), intent(inout) :: card
      !> what it is for
      logical, intent(in) :: field, history
      type(output_settings_t), intent(inout) :: settings
      character(len=:), allocatable :: format
      integer :: frequency, events
      call card%get_integer('FREQUENCY', frequency, default=1, at_least=1, shown='1; in a dynamic step 20 frames, 200 rows', &
                            about='increments from one to the next; in a dynamic step time steps')
      call card%get_integer('EVENTS', events, default=0, at_least=0, about='events from one to the next (0: none between '// &
                            'increments)')
      if (field) settings%field_frequency = frequency
      if (field) settings%field_given = card%given('FREQUENCY')
      if (history) settings%history_given = card%given('FREQUENCY')
      if (field) settings%field_events = events
      if (history) settings%history_frequency = frequency
      if (history) settings%history_events = events
      if (card%given('FORMAT') .and. history .and. .not. field) call card%keyword_error('FORMAT belongs to *OUTPUT, FIELD')
      if (.not. (field .or. card%describing())) return
      call card%get_word('FORMAT', format, allowed='VTKHDF APDL BOTH', default='VTKHDF', about='files of the fields')
      settings%vtkhdf = format /= 'APDL'
      settings%apdl = format /= 'VTKHDF'
   end subroutine read_frequencies

   !> `*MONITOR`. What one step asks for is written in all; a later step may repeat it.
   subroutine read_monitors(deck, mesh_input, monitors)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(monitor_t), allocatable, intent(out) :: monitors(:)
      type(card_t) :: card
      type(name_table_t) :: names
      character(len=:), allocatable :: name, set_name
      integer, allocatable :: step(:)
      integer :: set, k
      allocate (monitors(deck%count_of('MONITOR')), step(deck%count_of('MONITOR')))
      step = 0
      call deck%open(card, 'MONITOR', where=in_step, about='history columns of a set of nodes: mean displacement, sum of '// &
                     'reactions. They are written in all steps')
      do while (deck%next(card))
         call card%get_name('NAME', name, about='what the columns are called by')
         call card%get_name('NSET', set_name, about='set of nodes')
         if (card%describing()) cycle
         set = set_of(card, mesh_input%nodes, set_name)
         k = names%find(name)
         if (k > 0) then
            if (step(k) < card%step .and. monitors(k)%set == set) cycle
         end if
         call names%define(card, 'monitor', name)
         monitors(names%n)%name = name
         monitors(names%n)%set = set
         step(names%n) = card%step
      end do
      monitors = monitors(:names%n)
   end subroutine read_monitors

   !> Number of a set that a parameter names; 0 after an error.
   integer function set_of(card, catalogue, name) result(set)
      type(card_t), intent(inout) :: card
      type(catalogue_t), intent(in) :: catalogue
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: problem
      set = 0
      if (len(name) == 0) return ! it is missing, which has been said
      call catalogue%find_set(name, set, problem)
      if (len(problem) > 0) call card%keyword_error(problem)
   end function set_of

   !> `*SECTION CHECK`. What one step asks for is written in all; a later step may repeat it.
   subroutine read_sections(deck, mesh, sections)
      type(deck_t), intent(inout) :: deck
      type(mesh_t), intent(in) :: mesh
      type(section_check_t), allocatable, intent(out) :: sections(:)
      type(card_t) :: card
      type(name_table_t) :: names
      type(section_check_t) :: this
      character(len=:), allocatable :: name
      integer, allocatable :: step(:)
      integer :: k
      allocate (sections(deck%count_of('SECTION CHECK')), step(deck%count_of('SECTION CHECK')))
      step = 0
      call deck%open(card, 'SECTION CHECK', where=in_step, about='history columns of the forces on each side of a line, which '// &
                     'must be in balance. They are written in all steps')
      do while (deck%next(card))
         call card%get_name('NAME', name, about='what the columns are called by')
         this%name = name
         this%point = 0
         call read_section_line(card, mesh, this)
         if (card%describing()) cycle
         k = names%find(name)
         if (k > 0) then
            if (step(k) < card%step .and. same_line(sections(k), this)) cycle
         end if
         call names%define(card, 'section check', name)
         sections(names%n) = this
         step(names%n) = card%step
      end do
      sections = sections(:names%n)
   end subroutine read_sections

   !> Point and normal of a section.
   subroutine read_section_line(card, mesh, section)
      type(card_t), intent(inout) :: card
      type(mesh_t), intent(in) :: mesh
      type(section_check_t), intent(inout) :: section
      real(wp), allocatable :: distance(:)
      section%normal = [1.0_wp, 0.0_wp]
      if (.not. card%needs_line('x, y, nx, ny')) return
      call card%field_real('x', section%point(1), unit='length', about='a point of the line')
      call card%field_real('y', section%point(2), unit='length', about='a point of the line')
      call card%field_real('nx', section%normal(1), about='normal of the line, of any length')
      call card%field_real('ny', section%normal(2), about='normal of the line')
      if (card%line_failed .or. card%describing()) return
      if (maxval(abs(section%normal)) > 0) then
         section%normal = section%normal/maxval(abs(section%normal)) ! so that squares can neither vanish nor overflow
         section%normal = section%normal/norm2(section%normal)
      else
         call card%error('the normal of a section must not be 0, 0')
      end if
      if (card%line_failed .or. mesh%n_nodes == 0) return
      allocate (distance(mesh%n_nodes))
      distance = (0.25_wp*mesh%x(1, :mesh%n_nodes) - 0.25_wp*section%point(1))*section%normal(1) &
                 + (0.25_wp*mesh%x(2, :mesh%n_nodes) - 0.25_wp*section%point(2))*section%normal(2) ! cannot overflow
      if (minval(distance) >= 0 .or. maxval(distance) <= 0) call card%warning('the section does not cut the body')
   end subroutine read_section_line

   pure logical function same_line(a, b)
      type(section_check_t), intent(in) :: a, b
      same_line = .not. (any(abs(a%point - b%point) > 0) .or. any(abs(a%normal - b%normal) > 0))
   end function same_line

   !> STOP DROP needs a monitor, MONITOR= one that exists. Where none is named the first one's name is filled in.
   subroutine check_stop_drop(deck, requests, settings)
      type(deck_t), intent(inout) :: deck
      !> of read_output
      type(output_requests_t), intent(in) :: requests
      !> of read_fracture, (steps)
      type(fracture_settings_t), intent(inout) :: settings(:)
      type(card_t) :: card
      type(name_table_t) :: names
      integer :: k, step
      if (deck%describing()) return
      allocate (names%name(size(requests%monitor)))
      names%n = size(requests%monitor)
      do k = 1, names%n
         names%name(k)%s = requests%monitor(k)%name
      end do
      call deck%open(card, 'FRACTURE', where=in_step)
      do while (deck%next(card))
         associate (this => settings(card%step))
            if (len_trim(this%monitor) > 0) then
               if (names%find(trim(this%monitor)) == 0) call card%keyword_error(names%unknown('monitor', trim(this%monitor)))
            else if (this%stop_drop > 0 .and. names%n == 0) then
               call card%keyword_error('STOP DROP needs a *MONITOR, which the deck has not')
            end if
         end associate
      end do
      if (names%n == 0) return
      do step = 1, size(settings)
         if (settings(step)%stop_drop > 0 .and. len_trim(settings(step)%monitor) == 0) &
            settings(step)%monitor = requests%monitor(1)%name
      end do
   end subroutine check_stop_drop
end module rf_output_input
