!> A mesh while its deck is being read: nodes and elements in the deck's order, with the lines they come from.
module rf_mesh_draft
   use rf_kinds, only: wp
   use rf_grow, only: grow
   use rf_mesh_assembly, only: raw_mesh_t
   implicit none
   private
   public :: draft_t, shown, largest_length, smallest_length

   !> errors of one kind that are reported one by one; the rest is counted in one more
   integer, parameter :: shown = 4

   !> lengths beyond these are refused: products of three of them would leave the range of real numbers
   real(wp), parameter :: largest_length = 1.0e100_wp, smallest_length = 1.0e-100_wp

   type :: draft_t
      type(raw_mesh_t) :: raw
      !> data line of each entry; not allocated if the mesh is generated
      integer, allocatable :: node_line(:), element_line(:)
      !> errors so far: node defined twice, element defined twice, element on an unknown node
      integer :: twice_nodes = 0, twice_elements = 0, unknown_nodes = 0
      !> elements, or blocks of them, that an error kept out
      integer :: failed_elements = 0
      !> line elements
      integer :: lines = 0
      !> the deck has *NODE or *ELEMENT
      logical :: listed = .false.
   contains
      procedure :: start, add_node, add_element
   end type draft_t

contains

   !> No nodes and elements yet.
   subroutine start(self)
      class(draft_t), intent(inout) :: self
      call grow(self%raw%x, 0, 2)
      call grow(self%raw%connectivity, 0, 3)
      call grow(self%raw%plane_strain, 0)
   end subroutine start

   !> Append a node to the draft.
   subroutine add_node(self, x, line)
      class(draft_t), intent(inout) :: self
      !> coordinates [length]
      real(wp), intent(in) :: x(2)
      !> data line
      integer, intent(in) :: line
      integer :: n
      n = self%raw%n_nodes + 1
      self%raw%n_nodes = n
      call grow(self%raw%x, n, 2)
      call grow(self%node_line, n)
      self%raw%x(:, n) = x
      self%node_line(n) = line
   end subroutine add_node

   !> Append an element to the draft.
   subroutine add_element(self, node, plane_strain, line)
      class(draft_t), intent(inout) :: self
      !> entries of its nodes (0: it stays out of the mesh)
      integer, intent(in) :: node(3)
      !> the elements are in plane strain
      logical, intent(in) :: plane_strain
      !> data line
      integer, intent(in) :: line
      integer :: n
      n = self%raw%n_elements + 1
      self%raw%n_elements = n
      call grow(self%raw%connectivity, n, 3)
      call grow(self%raw%plane_strain, n)
      call grow(self%element_line, n)
      self%raw%connectivity(:, n) = node
      self%raw%plane_strain(n) = plane_strain
      self%element_line(n) = line
   end subroutine add_element
end module rf_mesh_draft
