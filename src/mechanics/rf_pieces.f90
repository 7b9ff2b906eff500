!> The pieces the body has fallen into: nodes connected through elements, not through contact.
module rf_pieces
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_loads, only: loads_t
   implicit none
   private
   public :: pieces_t

   type :: pieces_t
      integer :: n = 0
      !> piece of each node, numbered by the first element in the deck's order, (nodes)
      integer, allocatable :: of_node(:)
      !> the piece has supports; applied forces act on it; its supports leave it free to slide along x or y, (pieces)
      logical, allocatable :: supported(:), loaded(:), slides(:)
   contains
      procedure :: find, look_at_loads
   end type pieces_t

contains

   !> Label all nodes.
   subroutine find(self, mesh)
      class(pieces_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: root(:), label(:), by_rank(:)
      integer :: e, k, a, b, n
      allocate (root(mesh%n_nodes), label(mesh%n_nodes), by_rank(mesh%n_elements))
      do n = 1, mesh%n_nodes
         root(n) = n
      end do
      do e = 1, mesh%n_elements
         by_rank(mesh%element_rank(e)) = e
         do k = 1, 2
            a = find_root(mesh%connectivity(k, e))
            b = find_root(mesh%connectivity(k + 1, e))
            root(max(a, b)) = min(a, b)
         end do
      end do
      label = 0
      self%n = 0
      do k = 1, mesh%n_elements
         a = find_root(mesh%connectivity(1, by_rank(k)))
         if (label(a) > 0) cycle
         self%n = self%n + 1
         label(a) = self%n
      end do
      if (allocated(self%of_node)) deallocate (self%of_node)
      allocate (self%of_node(mesh%n_nodes))
      do n = 1, mesh%n_nodes
         self%of_node(n) = label(find_root(n))
      end do

   contains

      integer function find_root(member) result(r)
         integer, intent(in) :: member
         r = member
         do while (root(r) /= r)
            root(r) = root(root(r))
            r = root(r)
         end do
      end function find_root

   end subroutine find

   !> Which pieces have supports and which bear applied forces. What cohesion holds together shares both.
   subroutine look_at_loads(self, loads, bonds)
      class(pieces_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      !> pairs of nodes that cohesion holds together, (2, bonds)
      integer, intent(in), optional :: bonds(:, :)
      logical, allocatable :: held(:, :)
      integer :: n, p
      if (allocated(self%supported)) deallocate (self%supported, self%loaded, self%slides)
      allocate (self%supported(self%n), self%loaded(self%n), self%slides(self%n), held(2, self%n), source=.false.)
      do n = 1, size(self%of_node)
         p = self%of_node(n)
         held(1, p) = held(1, p) .or. loads%free_x(n) < 0.5_wp
         held(2, p) = held(2, p) .or. loads%free_y(n) < 0.5_wp
         if (abs(loads%px(n)) > 0 .or. abs(loads%py(n)) > 0) self%loaded(p) = .true.
      end do
      if (present(bonds)) call share(self, bonds, held)
      self%supported = held(1, :) .or. held(2, :)
      self%slides = self%supported .and. .not. (held(1, :) .and. held(2, :))
   end subroutine look_at_loads

   !> What one of two bonded pieces has, the other has too.
   subroutine share(self, bonds, held)
      type(pieces_t), intent(inout) :: self
      integer, intent(in) :: bonds(:, :)
      logical, intent(inout) :: held(:, :)
      logical :: changed, both(3)
      integer :: i, a, b
      changed = .true.
      do while (changed)
         changed = .false.
         do i = 1, size(bonds, 2)
            a = self%of_node(bonds(1, i))
            b = self%of_node(bonds(2, i))
            if (a == b) cycle
            both = [held(:, a) .or. held(:, b), self%loaded(a) .or. self%loaded(b)]
            changed = changed .or. any(both .neqv. [held(:, a), self%loaded(a)]) .or. any(both .neqv. [held(:, b), self%loaded(b)])
            held(:, a) = both(:2)
            held(:, b) = both(:2)
            self%loaded(a) = both(3)
            self%loaded(b) = both(3)
         end do
      end do
   end subroutine share

end module rf_pieces
