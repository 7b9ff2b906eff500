!> Puts the cracks that exist from the start (`*CRACK`) into the mesh, after everything has been read and before the run:
!> what is attached to nodes and elements follows as it follows a split.
module rf_crack_insertion
   use rf_kinds, only: wp, pi, degree
   use rf_crack_fit, only: fit_t
   use rf_crack_input, only: crack_list_t, crack_t, crack_fit, crack_edge, crack_element
   use rf_crack_line, only: flag_edges, line_margin, open_cracks, parts_inside
   use rf_diagnostics, only: diagnostics_t
   use rf_loads, only: load_definition_t, load_support, load_force
   use rf_mesh, only: mesh_t
   use rf_model, only: model_t
   use rf_prescribed_crack, only: cutter_t
   use rf_text, only: to_text
   use rf_topology, only: changes_t, next_corner
   implicit none
   private
   public :: insert_cracks, crack_mesh

contains

   !> Insert all cracks. A crack that cannot be put in is an error at its place in the deck.
   subroutine insert_cracks(cracks, definitions, model, note, diagnostics)
      type(crack_list_t), intent(in) :: cracks
      !> supports and loads of all steps: the nodes that they name stay where they are
      type(load_definition_t), intent(in) :: definitions(:)
      !> read, not yet prepared; its changes tell what the cracks changed
      type(model_t), intent(inout) :: model
      !> what the log says of it, empty if there are no cracks
      character(len=:), allocatable, intent(out) :: note
      type(diagnostics_t), intent(inout) :: diagnostics
      type(fit_t) :: fit
      integer :: c
      note = ''
      if (cracks%n == 0) return
      call crack_mesh(model%mesh, cracks, fit, model%changes, diagnostics, loaded_nodes(model%mesh, definitions))
      call model%material%adopt(model%changes)
      call model%failure%adopt(model%mesh, model%changes)
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting == crack_element) call cut_crack(model, cracks%crack(c), c, diagnostics)
      end do
      call check_friction(cracks, model, diagnostics)
      note = 'cracks from the start: '//to_text(cracks%n)//', '//to_text(model%mesh%n_segments)//' segments'
      if (fit%smallest_angle < pi) note = note//'. The mesh was fitted: '//to_text(fit%moved)//' nodes moved, by '// &
         rounded(fit%largest_move)//' at most, '//to_text(fit%cut)//' edges cut, smallest angle beside them '// &
         rounded(fit%smallest_angle/degree)//' degrees'
   end subroutine insert_cracks

   !> Nodes whose place is part of what supports and loads mean: with a force or a support of their own, or supported
   !> inside the body. (Where sets end on the boundary the mesh knows itself; between their ends a side may be cut anew.)
   pure function loaded_nodes(mesh, definitions) result(loaded)
      type(mesh_t), intent(in) :: mesh
      type(load_definition_t), intent(in) :: definitions(:)
      logical :: loaded(mesh%n_nodes)
      logical :: boundary(mesh%n_nodes), meant(mesh%n_nodes)
      integer :: e, k, n, d
      boundary = .false.
      do e = 1, mesh%n_elements
         do k = 1, 3
            if (mesh%neighbour(k, e) == 0) boundary(mesh%connectivity([k, next_corner(k)], e)) = .true.
         end do
      end do
      loaded = .false.
      do d = 1, size(definitions)
         associate (definition => definitions(d))
            if (all(definition%kind /= [load_support, load_force])) cycle
            if (definition%entity > 0) loaded(definition%entity) = .true.
            meant = [(mesh%node_in_set(n, definition%set), n=1, mesh%n_nodes)]
            if (definition%kind == load_support) meant = meant .and. .not. boundary
            loaded = loaded .or. meant
         end associate
      end do
   end function loaded_nodes

   !> Cut a crack through elements, wherever its line lies in the body. Regions that never break are left as they are.
   subroutine cut_crack(model, crack, number, diagnostics)
      type(model_t), intent(inout) :: model
      type(crack_t), intent(in) :: crack
      integer, intent(in) :: number
      type(diagnostics_t), intent(inout) :: diagnostics
      type(cutter_t) :: cutter
      real(wp), allocatable :: parts(:, :)
      real(wp) :: along(2), length, margin
      integer :: i, p, before
      logical :: goes_on
      margin = line_margin*model%mesh%size
      goes_on = .false.
      do i = 1, size(crack%point, 2) - 1
         associate (from => crack%point(:, i), to => crack%point(:, i + 1))
            length = norm2(to - from)
            along = (to - from)/length
            call parts_inside(model%mesh, from, to, parts)
            do p = 1, size(parts, 2)
               if (.not. (goes_on .and. parts(1, p) <= margin)) call cutter%start(model%mesh, number, from + parts(1, p)*along)
               before = cutter%splits
               call cut_part(model, cutter, from, to, from + parts(2, p)*along, parts(2, p) < length - margin, goes_on)
               if (before > 0 .and. cutter%splits == before .and. parts(2, p) - parts(1, p) > model%mesh%mean_edge) &
                  call diagnostics%warning(crack%place, 'no element can be cut along the part of the crack that begins at '// &
                                           point_text(from + parts(1, p)*along))
               if (.not. cutter%stuck) cycle
               call tell_end(model%mesh, crack, cutter, diagnostics)
               return
            end do
            if (size(parts, 2) == 0) goes_on = .false.
         end associate
      end do
      if (cutter%tip == 0) then
         call diagnostics%error(crack%place, 'no part of the crack lies inside the body')
      else if (cutter%splits == 0) then
         call tell_end(model%mesh, crack, cutter, diagnostics)
      end if
   end subroutine cut_crack

   !> Cut along a part of a line that lies in the body.
   subroutine cut_part(model, cutter, from, to, last, leaves, goes_on)
      type(model_t), intent(inout) :: model
      type(cutter_t), intent(inout) :: cutter
      !> ends of the line, of which the part is some [length]
      real(wp), intent(in) :: from(2), to(2)
      !> where the part ends [length]
      real(wp), intent(in) :: last(2)
      !> it leaves the body there
      logical, intent(in) :: leaves
      !> the crack has reached the end of the line
      logical, intent(out) :: goes_on
      logical :: done
      do
         goes_on = .not. leaves .and. cutter%arrived(model%mesh, from, to)
         if (goes_on) exit
         if (leaves) then
            if (cutter%has_left(model%mesh, from, last)) exit
         end if
         call cutter%advance(model%mesh, to, model%failure%no_split_node, model%failure%no_split_element, model%changes, done)
         if (done) exit
         call model%material%adopt(model%changes)
         call model%failure%adopt(model%mesh, model%changes)
      end do
   end subroutine cut_part

   !> Say that a crack could not be cut, or not to its end.
   subroutine tell_end(mesh, crack, cutter, diagnostics)
      type(mesh_t), intent(in) :: mesh
      type(crack_t), intent(in) :: crack
      type(cutter_t), intent(in) :: cutter
      type(diagnostics_t), intent(inout) :: diagnostics
      if (cutter%splits == 0) then
         call diagnostics%error(crack%place, 'no element can be cut along the crack from its first node, '// &
                                to_text(mesh%node_id(cutter%tip)))
      else
         call diagnostics%warning(crack%place, 'the crack ends at '//point_text(mesh%x(:, cutter%tip))// &
                                  ': no element can be cut along it there')
      end if
   end subroutine tell_end

   !> Friction is never guessed: each crack needs that of its own or that of the material on both its sides.
   subroutine check_friction(cracks, model, diagnostics)
      type(crack_list_t), intent(in) :: cracks
      type(model_t), intent(in) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      logical :: told(cracks%n)
      integer :: s, i, c
      told = .false.
      do s = 1, model%mesh%n_segments
         c = model%mesh%segment_crack(s)
         if (told(c) .or. model%material%surface_given(c)) cycle
         do i = 1, 2
            associate (section => model%material%section(model%mesh%section(model%mesh%segment_element(i, s))))
               if (told(c) .or. section%friction_given .or. model%failure%strength(section%material)%given) cycle
               told(c) = .true.
               call diagnostics%error(cracks%crack(c)%place, 'the friction of the crack is not known: give *FRICTION behind '// &
                                      'the *CRACK, or behind *MATERIAL, NAME='//trim(model%material%name(section%material))// &
                                      ', or its *STRENGTH')
            end associate
         end do
      end do
   end subroutine check_friction

   !> The mesh with all cracks in it that follow their lines.
   subroutine crack_mesh(mesh, cracks, fit, changes, diagnostics, named)
      type(mesh_t), intent(inout) :: mesh
      type(crack_list_t), intent(in) :: cracks
      !> what fitting did
      type(fit_t), intent(out) :: fit
      type(changes_t), intent(inout) :: changes
      type(diagnostics_t), intent(inout) :: diagnostics
      !> nodes that must stay where they are, (nodes)
      logical, intent(in), optional :: named(:)
      integer :: c
      call changes%clear()
      call fit_mesh(mesh, cracks, fit, changes, named)
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting /= crack_element) call flag_crack(mesh, cracks%crack(c), c, diagnostics)
      end do
      call open_cracks(mesh, changes)
   end subroutine crack_mesh

   !> Make edges along the cracks with SPLITTING=FIT; those along edges stay where they are.
   subroutine fit_mesh(mesh, cracks, fit, changes, named)
      type(mesh_t), intent(inout) :: mesh
      type(crack_list_t), intent(in) :: cracks
      type(fit_t), intent(inout) :: fit
      type(changes_t), intent(inout) :: changes
      !> nodes that must stay where they are, (nodes)
      logical, intent(in), optional :: named(:)
      integer :: c, i, first_line
      call fit%begin(mesh, named)
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting /= crack_edge) cycle
         do i = 1, size(cracks%crack(c)%point, 2) - 1
            call fit%freedom%add_line(cracks%crack(c)%point(:, i), cracks%crack(c)%point(:, i + 1))
         end do
      end do
      first_line = fit%freedom%n_lines + 1
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting /= crack_fit) cycle
         do i = 1, size(cracks%crack(c)%point, 2) - 1
            call fit%fit_line(mesh, cracks%crack(c)%point(:, i), cracks%crack(c)%point(:, i + 1), changes)
         end do
      end do
      if (fit%freedom%n_lines >= first_line) call fit%finish(mesh, first_line)
   end subroutine fit_mesh

   !> Flag the edges on all parts of a polyline.
   subroutine flag_crack(mesh, crack, number, diagnostics)
      type(mesh_t), intent(inout) :: mesh
      type(crack_t), intent(in) :: crack
      integer, intent(in) :: number
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: i, n, total
      logical :: left
      real(wp) :: gap(2, 2)
      total = 0
      do i = 1, size(crack%point, 2) - 1
         call flag_edges(mesh, crack%point(:, i), crack%point(:, i + 1), number, n, left, gap)
         total = total + n
         if (.not. left) cycle
         if (crack%splitting == crack_fit) then
            call diagnostics%error(crack%place, 'the mesh cannot be fitted to the crack from '//point_text(gap(:, 1))//' to '// &
                                   point_text(gap(:, 2)))
            return
         end if
         call diagnostics%error(crack%place, 'with SPLITTING=EDGE the crack must run along edges of the mesh: there is none '// &
                                'from '//point_text(gap(:, 1))//' to '//point_text(gap(:, 2)))
         return
      end do
      if (total == 0) call diagnostics%error(crack%place, 'no part of the crack lies inside the body')
   end subroutine flag_crack

   !> '(1.5, 2)'
   function point_text(x) result(text)
      !> [length]
      real(wp), intent(in) :: x(2)
      character(len=:), allocatable :: text
      text = '('//rounded(x(1))//', '//rounded(x(2))//')'
   end function point_text

   !> A number with six digits.
   function rounded(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      character(len=16) :: digits
      real(wp) :: number
      write (digits, '(es13.5)') value
      read (digits, *) number
      text = to_text(number)
   end function rounded

end module rf_crack_insertion
