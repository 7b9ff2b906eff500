!> How far the nodes of a mesh may be moved when it is fitted to cracks, and what that makes of the triangles.
module rf_fit_freedom
   use rf_kinds, only: wp, i1, pi
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around, corner_of, next_corner, previous_corner
   implicit none
   private
   public :: freedom_t, fixed, along_line, free, fan_angle, smallest_angle_of, edge_length, side_of

   !> how a node may move
   integer, parameter :: fixed = 0, along_line = 1, free = 2
   !> directions whose sine is less are parallel
   real(wp), parameter :: parallel = 1.0e-6_wp

   !> no face of the node has been seen
   integer, parameter :: unknown = -1

   !> What nodes must not leave: their places, lines of cracks; borders of the body, of sections and of sets of elements.
   type :: freedom_t
      !> places closer than this are the same [length]
      real(wp) :: margin = 0
      !> nodes that are points of cracks, or that supports and loads depend on, (capacity)
      logical, allocatable :: pinned(:)
      !> lines that have been fitted: both ends [length], (2, 2 lines)
      integer :: n_lines = 0
      real(wp), allocatable :: line(:, :)
   contains
      procedure :: pin, hold, is_pinned, add_line, of_node, is_border
   end type freedom_t

contains

   !> A node stays where it is.
   subroutine pin(self, node)
      class(freedom_t), intent(inout) :: self
      integer, intent(in) :: node
      call grow(self%pinned, node)
      self%pinned(node) = .true.
   end subroutine pin

   !> Nodes that supports and loads depend on stay where they are: those the caller names; where a set of nodes or a face
   !> with a load ends on the boundary; members of a set with none of its other members beside them.
   subroutine hold(self, mesh, named)
      class(freedom_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> (nodes)
      logical, intent(in), optional :: named(:)
      integer(i1) :: beside(size(mesh%node_membership, 1), mesh%n_nodes)
      integer :: tag(mesh%n_nodes)
      integer :: e, k, n, i, pair(2)
      beside = 0
      tag = unknown
      do e = 1, mesh%n_elements
         do k = 1, 3
            pair = mesh%connectivity([k, next_corner(k)], e)
            do i = 1, 2
               associate (of_other => mesh%node_membership(:, pair(3 - i)))
                  beside(:, pair(i)) = ior(beside(:, pair(i)), of_other)
                  if (mesh%neighbour(k, e) /= 0) cycle
                  if (any(iand(mesh%node_membership(:, pair(i)), not(of_other)) /= 0)) call self%pin(pair(i))
               end associate
               if (tag(pair(i)) == unknown) tag(pair(i)) = mesh%tag_at(k, e)
               if (tag(pair(i)) /= mesh%tag_at(k, e)) call self%pin(pair(i))
            end do
         end do
      end do
      do n = 1, mesh%n_nodes
         if (any(iand(mesh%node_membership(:, n), not(beside(:, n))) /= 0)) call self%pin(n)
         if (.not. present(named)) cycle
         if (named(n)) call self%pin(n)
      end do
   end subroutine hold

   pure logical function is_pinned(self, node)
      class(freedom_t), intent(in) :: self
      integer, intent(in) :: node
      is_pinned = .false.
      if (.not. allocated(self%pinned)) return
      if (node <= size(self%pinned)) is_pinned = self%pinned(node)
   end function is_pinned

   !> The nodes on a line stay on it from here on.
   subroutine add_line(self, from, to)
      class(freedom_t), intent(inout) :: self
      !> [length]
      real(wp), intent(in) :: from(2), to(2)
      self%n_lines = self%n_lines + 1
      call grow(self%line, 2*self%n_lines, 2)
      self%line(:, 2*self%n_lines - 1) = from
      self%line(:, 2*self%n_lines) = to
   end subroutine add_line

   !> Distance of a point from a line [length], positive to the left of its direction.
   pure real(wp) function side_of(point, from, to) result(distance)
      real(wp), intent(in) :: point(2), from(2), to(2)
      real(wp) :: along(2)
      along = (to - from)/norm2(to - from)
      distance = along(1)*(point(2) - from(2)) - along(2)*(point(1) - from(1))
   end function side_of

   !> Whether a point lies on a straight line between its ends.
   pure logical function lies_on(point, from, to, margin)
      real(wp), intent(in) :: point(2), from(2), to(2), margin
      real(wp) :: s
      s = dot_product(point - from, to - from)/norm2(to - from)
      lies_on = abs(side_of(point, from, to)) <= margin .and. s >= -margin .and. s <= norm2(to - from) + margin
   end function lies_on

   !> Whether an edge must stay where it is: on the boundary, between sections or sets of elements, on a line.
   pure logical function is_border(self, mesh, element, edge)
      class(freedom_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, edge
      integer :: i
      is_border = mesh%neighbour(edge, element) == 0
      if (is_border) return
      is_border = mesh%section(mesh%neighbour(edge, element)) /= mesh%section(element)
      if (is_border) return
      is_border = any(mesh%element_membership(:, mesh%neighbour(edge, element)) /= mesh%element_membership(:, element))
      if (is_border) return
      associate (a => mesh%x(:, mesh%connectivity(edge, element)), b => mesh%x(:, mesh%connectivity(next_corner(edge), element)))
         do i = 1, self%n_lines
            is_border = lies_on(a, self%line(:, 2*i - 1), self%line(:, 2*i), self%margin)
            if (is_border) is_border = lies_on(b, self%line(:, 2*i - 1), self%line(:, 2*i), self%margin)
            if (is_border) return
         end do
      end associate
   end function is_border

   !> How a node may move: a corner of the body, of a border or of cracks not at all.
   subroutine of_node(self, mesh, node, how, direction)
      class(freedom_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> fixed, along_line or free
      integer, intent(out) :: how
      !> the line's direction [-]
      real(wp), intent(out) :: direction(2)
      integer, allocatable :: around(:)
      real(wp) :: edge(2)
      integer :: n, i, k, side
      logical :: forwards, backwards
      how = free
      direction = 0
      forwards = .false.
      backwards = .false.
      if (mesh%hinge(node) .or. self%is_pinned(node)) how = fixed
      if (how == fixed) return
      do i = 1, self%n_lines
         associate (from => self%line(:, 2*i - 1), to => self%line(:, 2*i))
            if (.not. lies_on(mesh%x(:, node), from, to, self%margin)) cycle
            call note_direction((to - from)/norm2(to - from))
            call note_direction((from - to)/norm2(to - from))
            if (norm2(mesh%x(:, node) - from) <= self%margin .or. norm2(mesh%x(:, node) - to) <= self%margin) how = fixed
         end associate
      end do
      call elements_around(mesh, node, around, n)
      do i = 1, n
         k = corner_of(mesh, around(i), node)
         do side = 1, 2
            if (side == 2) k = previous_corner(k)
            if (.not. self%is_border(mesh, around(i), k)) cycle
            edge = mesh%x(:, mesh%connectivity(merge(next_corner(k), k, side == 1), around(i))) - mesh%x(:, node)
            call note_direction(edge/norm2(edge))
         end do
      end do
      if (how == along_line .and. .not. (forwards .and. backwards)) how = fixed

   contains

      !> The node is bound to a line of this direction.
      subroutine note_direction(towards)
         real(wp), intent(in) :: towards(2)
         if (how == fixed) return
         if (how == free) direction = towards
         how = along_line
         if (abs(direction(1)*towards(2) - direction(2)*towards(1)) > parallel) how = fixed
         if (dot_product(direction, towards) > 0) forwards = .true.
         if (dot_product(direction, towards) < 0) backwards = .true.
      end subroutine note_direction

   end subroutine of_node

   !> Smallest angle of a triangle [rad]; negative if it is turned inside out.
   pure real(wp) function smallest_angle_of(corner) result(angle)
      !> [length], (2, 3)
      real(wp), intent(in) :: corner(2, 3)
      real(wp) :: a(2), b(2), turned
      integer :: k
      angle = pi
      do k = 1, 3
         a = corner(:, next_corner(k)) - corner(:, k)
         b = corner(:, previous_corner(k)) - corner(:, k)
         turned = a(1)*b(2) - a(2)*b(1)
         angle = min(angle, atan2(turned, dot_product(a, b)))
      end do
   end function smallest_angle_of

   !> Smallest angle of the triangles round a node [rad] if it were at some place.
   real(wp) function fan_angle(mesh, node, place) result(angle)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> [length]
      real(wp), intent(in) :: place(2)
      integer, allocatable :: around(:)
      real(wp) :: corner(2, 3)
      integer :: n, i
      angle = pi
      call elements_around(mesh, node, around, n)
      do i = 1, n
         corner = mesh%x(:, mesh%connectivity(:, around(i)))
         corner(:, corner_of(mesh, around(i), node)) = place
         angle = min(angle, smallest_angle_of(corner))
      end do
   end function fan_angle

   !> Mean length of the edges at a node [length].
   real(wp) function edge_length(mesh, node) result(length)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      integer, allocatable :: around(:)
      integer :: n, i, k
      length = 0
      call elements_around(mesh, node, around, n)
      do i = 1, n
         k = corner_of(mesh, around(i), node)
         length = length + norm2(mesh%x(:, mesh%connectivity(next_corner(k), around(i))) - mesh%x(:, node)) &
                  + norm2(mesh%x(:, mesh%connectivity(previous_corner(k), around(i))) - mesh%x(:, node))
      end do
      length = length/(2*n)
   end function edge_length

end module rf_fit_freedom
