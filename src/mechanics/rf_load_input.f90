!> Reads supports and loads: `*BOUNDARY`, `*CLOAD`, `*DLOAD`, `*PRESSURE` (and, through rf_amplitude_input, the curves
!> that they follow).
module rf_load_input
   use rf_kinds, only: wp
   use rf_amplitude, only: amplitude_t
   use rf_amplitude_input, only: read_amplitudes
   use rf_catalogue, only: catalogue_t, selection_t
   use rf_crack_input, only: crack_list_t
   use rf_deck, only: deck_t, card_t, in_step, in_both
   use rf_deck_rules, only: name_table_t
   use rf_diagnostics, only: diagnostics_t
   use rf_loads, only: load_definition_t, load_support, load_force, load_element_face, load_edges, load_gravity, &
      load_crack, load_kinds
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_removal_input, only: removal_t, mark_removed
   use rf_text, only: to_text
   use rf_topology, only: next_corner
   implicit none
   private
   public :: read_loads

   !> the direction out of the plane, which other programs' decks also support
   integer, parameter :: out_of_plane = 3

   !> what the readers of this module share
   type :: reading_t
      integer :: n = 0
      type(load_definition_t), allocatable :: list(:)
      !> names of the amplitudes
      type(name_table_t) :: curves
      !> OP=NEW, (kinds, steps)
      logical, allocatable :: replaced(:, :)
      !> the note about the direction out of the plane, or about gravity in it, has been given
      logical :: noted_dof = .false., noted_component = .false.
      !> of the present block: its amplitude; it says OP=NEW
      integer :: amplitude = 0
      logical :: is_new = .false.
      !> of the present *BOUNDARY: its values are velocities
      logical :: is_velocity = .false.
      !> what steps take out of the body; what is gone in the step that was looked at last, (elements)
      type(removal_t), allocatable :: removals(:)
      integer :: gone_in = -1
      logical, allocatable :: gone(:)
   contains
      procedure :: begin_block, has_line, add, sorted, look_at_body, on_boundary
   end type reading_t

contains

   !> Read what holds and loads the body in all steps.
   subroutine read_loads(deck, mesh_input, cracks, mesh, material, removals, amplitudes, definitions, replaced, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(crack_list_t), intent(in) :: cracks
      !> with topology and sections
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> what steps take out of the body (read_removals)
      type(removal_t), intent(in) :: removals(:)
      type(amplitude_t), allocatable, intent(out) :: amplitudes(:)
      !> in the order of steps (step 0: before the first), within a step in the deck's for each keyword
      type(load_definition_t), allocatable, intent(out) :: definitions(:)
      !> the step says OP=NEW for a kind, (kinds, steps)
      logical, allocatable, intent(out) :: replaced(:, :)
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
      type(reading_t) :: reading
      associate (unused => diagnostics)
      end associate
      allocate (reading%list(16), reading%replaced(load_kinds, max(1, deck%step_count())))
      reading%replaced = .false.
      reading%removals = removals
      call read_amplitudes(deck, reading%curves, amplitudes)
      call read_supports(deck, mesh_input, reading)
      call read_forces(deck, mesh_input, reading)
      call read_distributed(deck, mesh_input, mesh, material, reading)
      call read_pressures(deck, mesh_input, cracks, mesh, reading)
      call reading%sorted(definitions)
      replaced = reading%replaced(:, :deck%step_count())
   end subroutine read_loads

   !> OP and AMPLITUDE of a block in a step.
   subroutine begin_block(self, card, kinds)
      class(reading_t), intent(inout) :: self
      type(card_t), intent(inout) :: card
      !> what OP=NEW of this keyword drops
      integer, intent(in) :: kinds(:)
      character(len=:), allocatable :: operation, curve
      call card%get_word('OP', operation, allowed='MOD NEW', default='MOD', about='MOD: replaces the same set and dof, the '// &
                         'rest keeps its last value; NEW: the rest is dropped and falls linearly to zero over the step')
      self%is_new = operation == 'NEW'
      if (self%is_new) self%replaced(kinds, card%step) = .true.
      call card%get_name('AMPLITUDE', curve, default='', about='curve that the value is multiplied by; without it the value '// &
                         'goes linearly from where the last step left it')
      self%amplitude = self%curves%find(curve)
      if (self%amplitude == 0 .and. len(curve) > 0) call card%keyword_error(self%curves%unknown('amplitude', curve))
   end subroutine begin_block

   !> Go to the first data line. A block with OP=NEW may have none: then it only drops what there was.
   logical function has_line(self, card, fields)
      class(reading_t), intent(in) :: self
      type(card_t), intent(inout) :: card
      !> the fields of a line
      character(len=*), intent(in) :: fields
      if (self%is_new) then
         has_line = card%line()
      else
         has_line = card%needs_line(fields)
      end if
   end function has_line

   !> Keep a definition of the present line.
   subroutine add(self, card, definition)
      class(reading_t), intent(inout) :: self
      type(card_t), intent(in) :: card
      !> all but step and amplitude
      type(load_definition_t), intent(in) :: definition
      type(load_definition_t), allocatable :: larger(:)
      if (card%line_failed .or. card%describing()) return
      if (self%n == size(self%list)) then
         allocate (larger(2*self%n))
         larger(:self%n) = self%list
         call move_alloc(larger, self%list)
      end if
      self%n = self%n + 1
      self%list(self%n) = definition
      self%list(self%n)%step = card%step
      self%list(self%n)%amplitude = self%amplitude
   end subroutine add

   !> What is gone of the body in a step.
   subroutine look_at_body(self, mesh, step)
      class(reading_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: step
      integer :: i
      if (self%gone_in == step) return
      self%gone_in = step
      self%gone = spread(.false., 1, mesh%n_elements)
      do i = 1, size(self%removals)
         if (self%removals(i)%step <= step) call mark_removed(mesh, self%removals, i, self%gone)
      end do
   end subroutine look_at_body

   !> Whether an edge of an element lies on the boundary of what is left.
   pure logical function on_boundary(self, mesh, k, e)
      class(reading_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> edge, element
      integer, intent(in) :: k, e
      on_boundary = mesh%neighbour(k, e) == 0
      if (.not. on_boundary) on_boundary = self%gone(mesh%neighbour(k, e))
      on_boundary = on_boundary .and. .not. self%gone(e)
   end function on_boundary

   !> All definitions in the order of steps.
   subroutine sorted(self, definitions)
      class(reading_t), intent(in) :: self
      type(load_definition_t), allocatable, intent(out) :: definitions(:)
      integer :: step, i, n
      allocate (definitions(self%n))
      n = 0
      do step = 0, size(self%replaced, 2)
         do i = 1, self%n
            if (self%list(i)%step /= step) cycle
            n = n + 1
            definitions(n) = self%list(i)
         end do
      end do
   end subroutine sorted

   !> The field 'id or set'.
   subroutine read_target(card, catalogue, definition, about)
      type(card_t), intent(inout) :: card
      !> of nodes or elements
      type(catalogue_t), intent(in) :: catalogue
      !> gets set or entity
      type(load_definition_t), intent(inout) :: definition
      character(len=*), intent(in) :: about
      type(selection_t) :: selection
      character(len=:), allocatable :: name, problem
      call card%field_name(catalogue%noun()//' or set', name, about=about)
      if (len(name) == 0 .or. card%describing()) return
      call catalogue%resolve(name, selection, problem)
      if (len(problem) > 0) call card%error(problem)
      definition%set = selection%set
      definition%entity = selection%single
   end subroutine read_target

   !> `*BOUNDARY`: held directions and prescribed displacements.
   subroutine read_supports(deck, mesh_input, reading)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(reading_t), intent(inout) :: reading
      type(card_t) :: card
      character(len=:), allocatable :: kind
      call deck%open(card, 'BOUNDARY', where=in_both, about='supports and prescribed displacements. Before the first step the '// &
                     'value is 0 and there is no parameter')
      do while (deck%next(card))
         reading%amplitude = 0
         reading%is_new = .false.
         if (card%step == 0) then
            if (card%given('OP')) call card%keyword_error('OP belongs to a *BOUNDARY in a step')
            if (card%given('AMPLITUDE')) call card%keyword_error('AMPLITUDE belongs to a *BOUNDARY in a step')
         else
            call reading%begin_block(card, [load_support])
         end if
         call card%get_word('TYPE', kind, allowed='DISPLACEMENT VELOCITY', default='DISPLACEMENT', &
                            about='what the value is. VELOCITY: the support moves by velocity x step time, or by the '// &
                            'integral of velocity x amplitude; in the next step it keeps its last velocity')
         reading%is_velocity = kind == 'VELOCITY'
         if (card%step == 0 .and. card%given('TYPE')) call card%keyword_error('TYPE belongs to a *BOUNDARY in a step')
         if (.not. reading%has_line(card, 'node or set, first dof, last dof, value')) cycle
         do
            call read_support_line(card, mesh_input, reading)
            if (.not. card%line()) exit
         end do
      end do
   end subroutine read_supports

   subroutine read_support_line(card, mesh_input, reading)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(reading_t), intent(inout) :: reading
      type(load_definition_t) :: definition
      definition%kind = load_support
      call read_target(card, mesh_input%nodes, definition, 'id of a node, or a set of nodes')
      call card%field_integer('first dof', definition%first_dof, at_least=1, at_most=out_of_plane, &
                              about='1: along x, 2: along y (3 is skipped)')
      call card%field_integer('last dof', definition%last_dof, default=definition%first_dof, at_least=1, at_most=out_of_plane, &
                              shown='first dof', about='the last of the directions')
      call card%field_real('value', definition%value, default=0.0_wp, unit='length', about='displacement; with '// &
                           'TYPE=VELOCITY velocity [length/time]')
      definition%is_velocity = reading%is_velocity
      if (definition%last_dof < definition%first_dof) call card%error('the last dof, '//to_text(definition%last_dof)// &
         ', is less than the first, '//to_text(definition%first_dof))
      if (card%step == 0 .and. abs(definition%value) > 0) call card%error('before the first step a support has the value 0; a '// &
         'prescribed displacement belongs in a step')
      if (definition%last_dof == out_of_plane) call note_dof(card, reading)
      definition%last_dof = min(definition%last_dof, out_of_plane - 1)
      if (definition%first_dof < out_of_plane) call reading%add(card, definition)
   end subroutine read_support_line

   !> The note about the direction that a body in the plane has not.
   subroutine note_dof(card, reading)
      type(card_t), intent(inout) :: card
      type(reading_t), intent(inout) :: reading
      if (.not. reading%noted_dof) call card%note('dof 3 (out of the plane) is not used and skipped')
      reading%noted_dof = .true.
   end subroutine note_dof

   !> `*CLOAD`: forces on nodes.
   subroutine read_forces(deck, mesh_input, reading)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(reading_t), intent(inout) :: reading
      type(card_t) :: card
      type(load_definition_t) :: definition
      call deck%open(card, 'CLOAD', where=in_step, about='forces on nodes')
      do while (deck%next(card))
         call reading%begin_block(card, [load_force])
         if (.not. reading%has_line(card, 'node or set, dof, value')) cycle
         do
            definition = load_definition_t(kind=load_force)
            call read_target(card, mesh_input%nodes, definition, 'id of a node, or a set of nodes')
            call card%field_integer('dof', definition%first_dof, at_least=1, at_most=out_of_plane, &
                                    about='1: along x, 2: along y (3 is skipped)')
            call card%field_real('value', definition%value, unit='force', about='force at each node')
            definition%last_dof = definition%first_dof
            if (definition%first_dof == out_of_plane) then
               call note_dof(card, reading)
            else
               call reading%add(card, definition)
            end if
            if (.not. card%line()) exit
         end do
      end do
   end subroutine read_forces

   !> `*DLOAD`: pressure on element faces, gravity.
   subroutine read_distributed(deck, mesh_input, mesh, material, reading)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(reading_t), intent(inout) :: reading
      type(card_t) :: card
      type(load_definition_t) :: definition
      character(len=:), allocatable :: label
      call deck%open(card, 'DLOAD', where=in_step, about='pressure on faces of elements, and gravity')
      do while (deck%next(card))
         call reading%begin_block(card, [load_element_face, load_gravity])
         if (.not. reading%has_line(card, 'element or set, P1 or P2 or P3 or GRAV, value')) cycle
         do
            definition = load_definition_t()
            call card%form('for pressure')
            call read_target(card, mesh_input%elements, definition, 'id of an element, or a set of elements')
            if (card%describing()) then
               call card%field_word('load', label, allowed='P1 P2 P3', about='face from node 1 to 2, 2 to 3 or 3 to 1; it must '// &
                                    'lie on the boundary')
               call read_pressure(card, mesh_input, mesh, 'P1', definition, reading)
               call card%form('for gravity')
               call read_target(card, mesh_input%elements, definition, 'id of an element, or a set of elements')
               call card%field_word('load', label, allowed='GRAV', about='gravity')
               call read_gravity(card, mesh, material, definition, reading)
            else
               call card%field_word('load', label, allowed='P1 P2 P3 GRAV')
               if (label == 'GRAV') call read_gravity(card, mesh, material, definition, reading)
               if (label /= 'GRAV') call read_pressure(card, mesh_input, mesh, label, definition, reading)
            end if
            if (.not. card%line()) exit
         end do
      end do
   end subroutine read_distributed

   !> The rest of a line with P1, P2 or P3.
   subroutine read_pressure(card, mesh_input, mesh, label, definition, reading)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: label
      type(load_definition_t), intent(inout) :: definition
      type(reading_t), intent(inout) :: reading
      integer :: e, face, n_inside, n_there, first
      definition%kind = load_element_face
      call card%field_real('pressure', definition%value, unit='stress', about='positive pushes in')
      if (card%line_failed .or. card%describing()) return
      face = index('123', label(2:2))
      definition%first_dof = face
      definition%last_dof = face
      n_inside = 0
      n_there = 0
      first = 0
      call reading%look_at_body(mesh, card%step)
      do e = 1, mesh%n_elements
         if (.not. acts_on_element(definition, mesh, e)) cycle
         if (reading%gone(e)) cycle
         n_there = n_there + 1
         if (reading%on_boundary(mesh, mesh_input%edge_of_face(e, face), e)) cycle
         n_inside = n_inside + 1
         if (first == 0) first = e
         if (mesh%element_rank(e) < mesh%element_rank(first)) first = e
      end do
      if (n_inside > 0) call card%error('pressure acts on the boundary only: face '//label//' of element '// &
         to_text(mesh%element_id(first))//' lies against element '// &
         to_text(mesh%element_id(mesh%neighbour(mesh_input%edge_of_face(first, face), first)))//more(n_inside - 1))
      if (n_there == 0 .and. any(reading%gone)) call card%error('pressure on elements that have all been removed by then')
      call reading%add(card, definition)
   end subroutine read_pressure

   !> ' (and 3 more like it)' or nothing.
   pure function more(n) result(text)
      integer, intent(in) :: n
      character(len=:), allocatable :: text
      text = ''
      if (n > 0) text = ' (and '//to_text(n)//' more like it)'
   end function more

   pure logical function acts_on_element(definition, mesh, element)
      type(load_definition_t), intent(in) :: definition
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      acts_on_element = definition%entity == element .or. mesh%element_in_set(element, definition%set)
   end function acts_on_element

   !> The rest of a line with GRAV. Its two components are kept apart, so that a new direction is reached straight from the
   !> old one. The direction is made a unit vector, as in CalculiX.
   subroutine read_gravity(card, mesh, material, definition, reading)
      type(card_t), intent(inout) :: card
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(load_definition_t), intent(inout) :: definition
      type(reading_t), intent(inout) :: reading
      real(wp) :: g, direction(2)
      integer :: i, m
      definition%kind = load_gravity
      call card%field_real('g', g, unit='length/time^2', about='acceleration; the material needs *DENSITY')
      call card%field_real('nx', direction(1), about='direction that it pulls in, of any length')
      call card%field_real('ny', direction(2), about='direction that it pulls in')
      if (.not. (reading%noted_component .or. card%next_is_empty())) then
         call card%note('the third component of gravity is not used and skipped')
         reading%noted_component = .true.
      end if
      call card%field_skip('nz')
      if (card%line_failed .or. card%describing()) return
      if (.not. maxval(abs(direction)) > 0) then
         call card%error('gravity needs a direction in the plane: nx and ny are both 0')
         return
      end if
      direction = direction/maxval(abs(direction)) ! so that squares can neither vanish nor overflow
      m = material_without_density(definition, mesh, material)
      if (m > 0) call card%error('gravity needs the density of material '//trim(material%name(m))//': *DENSITY is missing')
      do i = 1, 2
         definition%first_dof = i
         definition%last_dof = i
         definition%value = g*direction(i)/norm2(direction)
         definition%direction = merge([1.0_wp, 0.0_wp], [0.0_wp, 1.0_wp], i == 1)
         call reading%add(card, definition)
      end do
   end subroutine read_gravity

   !> The first material without density among those that gravity acts on; 0 if there is none.
   integer function material_without_density(definition, mesh, material) result(found)
      type(load_definition_t), intent(in) :: definition
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer :: e, m
      found = 0
      do e = 1, mesh%n_elements
         if (.not. acts_on_element(definition, mesh, e)) cycle
         if (material%section(mesh%section(e))%density > 0) cycle
         m = material%section(mesh%section(e))%material
         if (len_trim(material%name(m)) == 0) cycle ! there is no such material, which has been said
         if (found == 0 .or. m < found) found = m
      end do
   end function material_without_density

   !> `*PRESSURE`: pressure on all boundary edges between nodes of a set, or in a crack.
   subroutine read_pressures(deck, mesh_input, cracks, mesh, reading)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(crack_list_t), intent(in) :: cracks
      type(mesh_t), intent(in) :: mesh
      type(reading_t), intent(inout) :: reading
      type(card_t) :: card
      type(load_definition_t) :: definition
      character(len=:), allocatable :: name, follow
      call deck%open(card, 'PRESSURE', where=in_step, about='pressure on every boundary edge that has both ends in a set of '// &
                     'nodes, or on both faces of a *CRACK, which it pushes apart')
      do while (deck%next(card))
         call reading%begin_block(card, [load_edges, load_crack])
         call card%get_word('FOLLOW', follow, allowed='YES NO', default='NO', about='YES: pressure in a crack also acts on the '// &
                            'faces that break from it, as soon as they are connected with it; NO: new faces carry none')
         if (.not. reading%has_line(card, 'node set or crack, pressure')) cycle
         do
            definition = load_definition_t(kind=load_edges, follow=follow == 'YES')
            call card%field_name('node set or crack', name, about='set of nodes, or name of a *CRACK')
            call card%field_real('pressure', definition%value, unit='stress', about='positive pushes in; in a crack: apart')
            if (.not. (card%line_failed .or. card%describing())) &
               call find_pressed(card, mesh_input, cracks, mesh, name, reading, definition)
            call reading%add(card, definition)
            if (.not. card%line()) exit
         end do
      end do
   end subroutine read_pressures

   !> What a *PRESSURE acts on: a crack of that name, or else a set of nodes.
   subroutine find_pressed(card, mesh_input, cracks, mesh, name, reading, definition)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(crack_list_t), intent(in) :: cracks
      type(mesh_t), intent(in) :: mesh
      character(len=*), intent(in) :: name
      type(reading_t), intent(inout) :: reading
      !> gets the crack or the set
      type(load_definition_t), intent(inout) :: definition
      character(len=:), allocatable :: problem
      call mesh_input%nodes%find_set(name, definition%set, problem)
      definition%entity = cracks%names%find(name)
      if (definition%entity > 0) then
         definition%kind = load_crack
         if (definition%set > 0) call card%error(name//' is both a node set and a crack: *PRESSURE does not know which is meant')
         definition%set = 0
      else if (len(problem) > 0) then
         if (cracks%names%n > 0) problem = problem//', and '//cracks%names%unknown('crack', name)
         call card%error(problem)
      else if (definition%follow) then
         call card%error('FOLLOW=YES belongs to pressure in a *CRACK: '//name//' is a node set')
      else if (.not. has_edge(mesh, definition%set, card%step, reading)) then
         call card%error('no edge of the boundary has both ends in node set '//name)
      end if
   end subroutine find_pressed

   !> Whether an edge of the boundary, as it is in a step, has both ends in a node set.
   logical function has_edge(mesh, set, step, reading)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: set, step
      type(reading_t), intent(inout) :: reading
      integer :: e, k
      call reading%look_at_body(mesh, step)
      has_edge = .true.
      do e = 1, mesh%n_elements
         do k = 1, 3
            if (.not. reading%on_boundary(mesh, k, e)) cycle
            if (mesh%node_in_set(mesh%connectivity(k, e), set) .and. &
                mesh%node_in_set(mesh%connectivity(next_corner(k), e), set)) return
         end do
      end do
      has_edge = .false.
   end function has_edge
end module rf_load_input
