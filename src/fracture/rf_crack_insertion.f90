!> Puts the cracks that exist from the start (`*CRACK`) into the mesh, after everything has been read and before the run:
!> what is attached to nodes and elements follows as it follows a split.
module rf_crack_insertion
   use rf_kinds, only: wp, pi, degree
   use rf_crack_fit, only: fit_t
   use rf_crack_input, only: crack_list_t, crack_t, crack_fit, crack_edge, crack_element
   use rf_crack_line, only: flag_edges, open_cracks
   use rf_diagnostics, only: diagnostics_t
   use rf_mesh, only: mesh_t
   use rf_model, only: model_t
   use rf_prescribed_crack, only: cutter_t
   use rf_text, only: to_text
   use rf_topology, only: changes_t
   implicit none
   private
   public :: insert_cracks, crack_mesh

contains

   !> Insert all cracks. A crack that cannot be put in is an error at its place in the deck.
   subroutine insert_cracks(cracks, model, note, diagnostics)
      type(crack_list_t), intent(in) :: cracks
      !> read, not yet prepared; its changes tell what the cracks changed
      type(model_t), intent(inout) :: model
      !> what the log says of it, empty if there are no cracks
      character(len=:), allocatable, intent(out) :: note
      type(diagnostics_t), intent(inout) :: diagnostics
      type(fit_t) :: fit
      integer :: c
      note = ''
      if (cracks%n == 0) return
      call crack_mesh(model%mesh, cracks, fit, model%changes, diagnostics)
      call model%material%adopt(model%changes)
      call model%failure%adopt(model%mesh, model%material, model%changes)
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting == crack_element) call cut_crack(model, cracks%crack(c), c, diagnostics)
      end do
      note = 'cracks from the start: '//to_text(cracks%n)//', '//to_text(model%mesh%n_segments)//' segments'
      if (fit%smallest_angle < pi) note = note//'. The mesh was fitted: '//to_text(fit%moved)//' nodes moved, by '// &
         rounded(fit%largest_move)//' at most, '//to_text(fit%cut)//' edges cut, smallest angle beside them '// &
         rounded(fit%smallest_angle/degree)//' degrees'
   end subroutine insert_cracks

   !> Cut a crack through elements. Regions that never break are left as they are.
   subroutine cut_crack(model, crack, number, diagnostics)
      type(model_t), intent(inout) :: model
      type(crack_t), intent(in) :: crack
      integer, intent(in) :: number
      type(diagnostics_t), intent(inout) :: diagnostics
      type(cutter_t) :: cutter
      integer :: i
      logical :: done
      done = .false.
      call cutter%start(model%mesh, number, crack%point(:, 1))
      do i = 1, size(crack%point, 2) - 1
         do while (.not. (done .or. cutter%arrived(model%mesh, crack%point(:, i), crack%point(:, i + 1))))
            call cutter%advance(model%mesh, crack%point(:, i + 1), model%failure%no_split_node, model%failure%no_split_element, &
                                model%changes, done)
            call model%material%adopt(model%changes)
            call model%failure%adopt(model%mesh, model%material, model%changes)
         end do
      end do
      if (cutter%splits == 0) then
         call diagnostics%error(crack%place, 'no element can be cut along the crack from its first node, '// &
                                to_text(model%mesh%node_id(cutter%tip)))
      else if (cutter%stuck) then
         call diagnostics%warning(crack%place, 'the crack ends at '//point_text(model%mesh%x(:, cutter%tip))// &
                                  ': no element can be cut along it there')
      end if
   end subroutine cut_crack

   !> The mesh with all cracks in it that follow their lines.
   subroutine crack_mesh(mesh, cracks, fit, changes, diagnostics)
      type(mesh_t), intent(inout) :: mesh
      type(crack_list_t), intent(in) :: cracks
      !> what fitting did
      type(fit_t), intent(out) :: fit
      type(changes_t), intent(inout) :: changes
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: c
      call changes%clear()
      call fit_mesh(mesh, cracks, fit, changes)
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting /= crack_element) call flag_crack(mesh, cracks%crack(c), c, diagnostics)
      end do
      call open_cracks(mesh, changes)
   end subroutine crack_mesh

   !> Make edges along the cracks with SPLITTING=FIT; those along edges stay where they are.
   subroutine fit_mesh(mesh, cracks, fit, changes)
      type(mesh_t), intent(inout) :: mesh
      type(crack_list_t), intent(in) :: cracks
      type(fit_t), intent(inout) :: fit
      type(changes_t), intent(inout) :: changes
      integer :: c, i, first_line
      call fit%begin(mesh)
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
