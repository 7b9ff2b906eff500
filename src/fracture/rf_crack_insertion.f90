!> Puts the cracks that exist from the start (`*CRACK`) into the mesh, after everything has been read and before the run:
!> what is attached to nodes and elements follows as it follows a split.
module rf_crack_insertion
   use rf_kinds, only: wp
   use rf_crack_input, only: crack_list_t, crack_t, crack_edge
   use rf_crack_line, only: flag_edges, open_cracks
   use rf_diagnostics, only: diagnostics_t
   use rf_mesh, only: mesh_t
   use rf_model, only: model_t
   use rf_text, only: to_text
   implicit none
   private
   public :: insert_cracks

contains

   !> Insert all cracks. A crack that cannot be put in is an error at its place in the deck.
   subroutine insert_cracks(cracks, model, diagnostics)
      type(crack_list_t), intent(in) :: cracks
      !> read, not yet prepared; its changes tell what the cracks changed
      type(model_t), intent(inout) :: model
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: c
      call model%changes%clear()
      do c = 1, cracks%n
         if (cracks%crack(c)%splitting /= crack_edge) then
            call diagnostics%error(cracks%crack(c)%place, 'SPLITTING=FIT and SPLITTING=ELEMENT are not available in this '// &
                                   'version; SPLITTING=EDGE is')
         else
            call flag_crack(model%mesh, cracks%crack(c), c, diagnostics)
         end if
      end do
      call open_cracks(model%mesh, model%changes)
      call model%material%adopt(model%changes)
      call model%failure%adopt(model%mesh, model%material, model%changes)
   end subroutine insert_cracks

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
