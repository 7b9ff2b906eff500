!> The pieces the body has fallen into: nodes connected through elements, not through contact.
module rf_pieces
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_disjoint, only: singletons, find_root, unite
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_loads, only: loads_t
   implicit none
   private
   public :: pieces_t

   type :: pieces_t
      !> pieces; nodes that are labelled
      integer :: n = 0
      integer, private :: n_nodes = 0
      !> piece of each node, numbered by the first element in the deck's order, (nodes)
      integer, allocatable :: of_node(:)
      !> the piece has supports; applied forces act on it; its supports leave it free to slide along x or y, (pieces)
      logical, allocatable :: supported(:), loaded(:), slides(:)
      !> the last search that came to each element, +s from one side and -s from the other, (elements)
      integer, allocatable, private :: seen(:)
      integer, private :: search = 0
   contains
      procedure :: find, follow, look_at_loads
      procedure, private :: still_joined
      procedure :: exchange
   end type pieces_t

contains

   !> Label all nodes.
   subroutine find(self, mesh)
      class(pieces_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: root(:), label(:), by_rank(:)
      integer :: e, k, a, n
      allocate (root, source=singletons(mesh%n_nodes))
      allocate (label(mesh%n_nodes), by_rank(mesh%n_elements))
      do e = 1, mesh%n_elements
         by_rank(mesh%element_rank(e)) = e
         do k = 1, 2
            call unite(root, mesh%connectivity(k, e), mesh%connectivity(k + 1, e))
         end do
      end do
      label = 0
      self%n = 0
      do k = 1, mesh%n_elements
         a = find_root(root, mesh%connectivity(1, by_rank(k)))
         if (label(a) > 0) cycle
         self%n = self%n + 1
         label(a) = self%n
      end do
      call grow(self%of_node, mesh%n_nodes)
      self%n_nodes = mesh%n_nodes
      do n = 1, mesh%n_nodes
         self%of_node(n) = label(find_root(root, n))
      end do

   end subroutine find

   !> Label the new nodes of a split. A piece comes apart only where a node and its copy do: that is looked for from both sides
   !> at once, so that it takes no more than a walk round the nearest end of the crack. Only if one is found, or where parts
   !> may hang together at a point, all nodes are labelled anew.
   subroutine follow(self, mesh, changes)
      class(pieces_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(changes_t), intent(in) :: changes
      integer :: i
      call grow(self%of_node, mesh%n_nodes)
      call grow(self%seen, mesh%n_elements)
      do i = 1, changes%n_nodes
         self%of_node(changes%node(i)) = self%of_node(changes%parent(1, i))
         if (changes%parent(2, i) > 0) cycle
         if (self%still_joined(mesh, mesh%element_of(changes%parent(1, i)), mesh%element_of(changes%node(i)))) cycle
         call self%find(mesh)
         return
      end do
      self%n_nodes = mesh%n_nodes
   end subroutine follow

   !> Whether two elements hang together through edges that are whole. Both sides are searched in turn, one element each; the
   !> search ends where they meet or one has nothing left.
   logical function still_joined(self, mesh, one, other) result(joined)
      class(pieces_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: one, other
      integer, allocatable :: list(:, :)
      integer :: done(2), known(2), side, k, e, next
      joined = one == other
      if (joined) return
      self%search = self%search + 1
      allocate (list(64, 2))
      list(1, :) = [one, other]
      self%seen(one) = self%search
      self%seen(other) = -self%search
      known = 1
      done = 0
      do
         do side = 1, 2
            if (done(side) == known(side)) return
            done(side) = done(side) + 1
            e = list(done(side), side)
            if (maxval(known) + 3 > size(list, 1)) call lengthen(list)
            do k = 1, 3
               next = mesh%neighbour(k, e)
               if (next == 0 .or. mesh%segment_at(k, e) > 0) cycle
               if (self%seen(next) == self%seen(e)) cycle
               joined = self%seen(next) == -self%seen(e)
               if (joined) return
               self%seen(next) = self%seen(e)
               known(side) = known(side) + 1
               list(known(side), side) = next
            end do
         end do
      end do
   end function still_joined

   !> Twice as long lists.
   subroutine lengthen(list)
      integer, allocatable, intent(inout) :: list(:, :)
      integer, allocatable :: longer(:, :)
      allocate (longer(2*size(list, 1), 2))
      longer(:size(list, 1), :) = list
      call move_alloc(longer, list)
   end subroutine lengthen

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
      do n = 1, self%n_nodes
         p = self%of_node(n)
         held(1, p) = held(1, p) .or. loads%is_held(1, n)
         held(2, p) = held(2, p) .or. loads%is_held(2, n)
         if (maxval(abs(loads%force_at(n))) > 0) self%loaded(p) = .true.      ! an initial stress drives no piece as a whole
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

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(pieces_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n', self%n)
      call archive%exchange('n_nodes', self%n_nodes)
      call archive%exchange('of_node', self%of_node)
      call archive%exchange('supported', self%supported)
      call archive%exchange('loaded', self%loaded)
      call archive%exchange('slides', self%slides)
      call archive%exchange('seen', self%seen)
      call archive%exchange('search', self%search)
   end subroutine exchange

end module rf_pieces
