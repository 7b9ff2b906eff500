!> The topology of the mesh and the three operations by which cracks change it (Qiu & Ding 2007, section 2.3):
!> bisect an edge, flag an edge as cracked, re-fan a node. Everything else (types I to III, run-through of interfaces,
!> opening at the boundary) is a sequence of these.
module rf_topology
   use rf_kinds, only: wp, i1, i8
   use rf_archive, only: archive_t
   use rf_sort, only: sorted_order
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t, no_origin
   implicit none
   private
   public :: changes_t, build_topology, elements_around, bisect_edge, crack_edge, refan_node, part_fans, is_one_fan, list_corners
   public :: next_corner, previous_corner, corner_of, is_corner, node_on_boundary, side_nodes, sort_ascending
   public :: manifold_ok, manifold_three_elements

   !> the next and the previous of the three corners of a triangle
   integer, parameter :: next_corner(3) = [2, 3, 1], previous_corner(3) = [3, 1, 2]
   !> results of build_topology
   integer, parameter :: manifold_ok = 0, manifold_three_elements = 1

   !> What a split changed: everything that is attached to nodes or elements follows from this list.
   type :: changes_t
      integer :: n_nodes = 0, n_elements = 0
      !> new nodes in order of creation, (capacity)
      integer, allocatable :: node(:)
      !> what a new node comes from: (n, 0) a copy of n; (a, b) the midpoint of a and b, (2, capacity)
      integer, allocatable :: parent(:, :)
      !> a midpoint lies on an edge that was part of the body's boundary, not of a crack, (capacity)
      logical, allocatable :: on_boundary(:)
      !> elements that are new or have new nodes, each once, (capacity)
      integer, allocatable :: element(:)
      !> where an element stands in that list, if it stands there at all: else another one does, or none, (elements)
      integer, allocatable, private :: listed_at(:)
      !> elements that came by bisection and the one each was cut from, (2, capacity)
      integer, allocatable :: child(:, :)
      integer :: n_children = 0
   contains
      procedure :: clear, corners
      procedure, private :: add_node, add_element, add_child
      procedure :: exchange
   end type changes_t

contains

   !> Forget all changes (the storage stays).
   subroutine clear(self)
      class(changes_t), intent(inout) :: self
      self%n_nodes = 0
      self%n_elements = 0
      self%n_children = 0
      call grow(self%element, 0)       ! a crack that opens nothing changes no element: an empty list, not none
   end subroutine clear

   !> Nodes of all changed elements, ascending, each once: all whose surroundings a split may have changed.
   subroutine corners(self, mesh, nodes, n)
      class(changes_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> the nodes, and how many they are
      integer, allocatable, intent(inout) :: nodes(:)
      integer, intent(out) :: n
      integer :: i, k, found
      call grow(nodes, 3*self%n_elements)
      do i = 1, self%n_elements
         nodes(3*i - 2:3*i) = mesh%connectivity(:, self%element(i))
      end do
      found = 3*self%n_elements
      call sort_ascending(nodes(:found))
      n = min(1, found)
      do k = 2, found
         if (nodes(k) == nodes(n)) cycle
         n = n + 1
         nodes(n) = nodes(k)
      end do
   end subroutine corners

   subroutine add_node(self, node, parent, on_boundary)
      class(changes_t), intent(inout) :: self
      integer, intent(in) :: node, parent(2)
      logical, intent(in) :: on_boundary
      integer :: n
      n = self%n_nodes + 1
      call grow(self%node, n)
      call grow(self%parent, n, 2)
      call grow(self%on_boundary, n)
      self%node(n) = node
      self%parent(:, n) = parent
      self%on_boundary(n) = on_boundary
      self%n_nodes = n
   end subroutine add_node

   subroutine add_element(self, element)
      class(changes_t), intent(inout) :: self
      integer, intent(in) :: element
      integer :: n
      if (.not. allocated(self%listed_at)) then      ! the first one of a run, or after a checkpoint
         do n = 1, self%n_elements
            call grow(self%listed_at, self%element(n))
            self%listed_at(self%element(n)) = n
         end do
      end if
      call grow(self%listed_at, element)
      n = self%listed_at(element)
      if (n > 0 .and. n <= self%n_elements) then
         if (self%element(n) == element) return
      end if
      n = self%n_elements + 1
      call grow(self%element, n)
      self%element(n) = element
      self%n_elements = n
      self%listed_at(element) = n
   end subroutine add_element

   subroutine add_child(self, child, origin)
      class(changes_t), intent(inout) :: self
      integer, intent(in) :: child, origin
      call grow(self%child, self%n_children + 1, 2)
      self%n_children = self%n_children + 1
      self%child(:, self%n_children) = [child, origin]
      call self%add_element(origin)
      call self%add_element(child)
   end subroutine add_child

   !> Corner (1 to 3) at which an element has a node; 0 if it has it not.
   pure integer function corner_of(mesh, element, node) result(corner)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, node
      do corner = 3, 1, -1
         if (mesh%connectivity(corner, element) == node) return
      end do
   end function corner_of

   !> Whether an element has a node (no element 0 has one).
   pure logical function is_corner(mesh, element, node)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, node
      is_corner = .false.
      if (element > 0) is_corner = any(mesh%connectivity(:, element) == node)
   end function is_corner

   !> Nodes at the two ends of a cracked edge on either side: node(end, side).
   pure function side_nodes(mesh, segment) result(node)
      type(mesh_t), intent(in) :: mesh
      !> crack segment
      integer, intent(in) :: segment
      integer :: node(2, 2)
      integer :: e(2), k(2)
      e = mesh%segment_element(:, segment)
      k(1) = maxloc(merge(1, 0, mesh%segments_of(e(1)) == segment), 1)
      k(2) = maxloc(merge(1, 0, mesh%segments_of(e(2)) == segment), 1)
      node(:, 1) = mesh%connectivity([k(1), next_corner(k(1))], e(1))
      node(:, 2) = mesh%connectivity([next_corner(k(2)), k(2)], e(2))
   end function side_nodes

   !> Fill neighbour, element_of and hinge of a mesh that has nodes and connectivity only: nothing is cracked or pressed.
   !> An edge of more than two elements, or of two that lie on the same side of it, is reported with both elements.
   subroutine build_topology(mesh, status, offenders)
      type(mesh_t), intent(inout) :: mesh
      !> manifold_ok or manifold_three_elements
      integer, intent(out) :: status
      !> the two elements that cannot share an edge
      integer, intent(out) :: offenders(2)
      integer, allocatable :: first(:), corner_list(:)
      integer :: e, k, a

      status = manifold_ok
      offenders = 0
      call list_corners(mesh, first, corner_list)
      mesh%neighbour(:, :mesh%n_elements) = 0
      if (allocated(mesh%segment)) deallocate (mesh%segment)
      if (allocated(mesh%face_tag)) deallocate (mesh%face_tag)
      do e = 1, mesh%n_elements
         do k = 1, 3
            call match_edge(e, k)
            if (status /= manifold_ok) return
         end do
      end do
      do a = 1, mesh%n_nodes
         mesh%hinge(a) = .false.
         if (first(a + 1) == first(a)) cycle
         mesh%element_of(a) = (corner_list(first(a)) - 1)/3 + 1
         mesh%hinge(a) = count_by_walk(mesh, a) < first(a + 1) - first(a)
      end do

   contains

      !> Find the element on the other side of edge k of element e among those that have its second node.
      subroutine match_edge(e, k)
         integer, intent(in) :: e, k
         integer :: from, to, i, other, corner
         from = mesh%connectivity(k, e)
         to = mesh%connectivity(next_corner(k), e)
         do i = first(to), first(to + 1) - 1
            other = (corner_list(i) - 1)/3 + 1
            corner = corner_list(i) - 3*(other - 1)
            if (other == e) cycle
            if (mesh%connectivity(next_corner(corner), other) == from) then
               if (mesh%neighbour(k, e) /= 0) status = manifold_three_elements
               mesh%neighbour(k, e) = other
            else if (mesh%connectivity(previous_corner(corner), other) == from) then
               status = manifold_three_elements
            end if
            if (status /= manifold_ok) then
               offenders = [e, other]
               return
            end if
         end do
      end subroutine match_edge

   end subroutine build_topology

   !> Corners of all elements sorted by node: those of node n are corner_list(first(n):first(n + 1) - 1), each as
   !> 3 (element - 1) + corner.
   subroutine list_corners(mesh, first, corner_list)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: first(:), corner_list(:)
      integer, allocatable :: fill(:)
      integer :: e, k, n
      allocate (first(mesh%n_nodes + 1), corner_list(3*mesh%n_elements), fill(mesh%n_nodes))
      fill = 0
      do e = 1, mesh%n_elements
         do k = 1, 3
            n = mesh%connectivity(k, e)
            fill(n) = fill(n) + 1
         end do
      end do
      first(1) = 1
      do n = 1, mesh%n_nodes
         first(n + 1) = first(n) + fill(n)
         fill(n) = first(n)
      end do
      do e = 1, mesh%n_elements
         do k = 1, 3
            n = mesh%connectivity(k, e)
            corner_list(fill(n)) = 3*(e - 1) + k
            fill(n) = fill(n) + 1
         end do
      end do
   end subroutine list_corners

   !> Whether a walk round a node reaches all its elements.
   logical function is_one_fan(mesh, node, n_elements)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> how many it has
      integer, intent(in) :: n_elements
      is_one_fan = count_by_walk(mesh, node) == n_elements
   end function is_one_fan

   !> Elements that a walk round a node reaches.
   integer function count_by_walk(mesh, node) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      integer :: start, e
      start = first_of_fan(mesh, node)
      e = start
      n = 0
      do
         n = n + 1
         e = turn(mesh, e, node, previous_corner)
         if (e == 0 .or. e == start) exit
      end do
   end function count_by_walk

   !> The next element round a node: counter-clockwise for side = previous_corner, clockwise for side = [1, 2, 3].
   !> 0 where the boundary or an opened crack ends the fan.
   pure integer function turn(mesh, element, node, side) result(next)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, node, side(3)
      next = mesh%neighbour(side(corner_of(mesh, element, node)), element)
      if (.not. is_corner(mesh, next, node)) next = 0
   end function turn

   !> The element from which a counter-clockwise walk meets the whole fan of a node; any where the fan is closed.
   integer function first_of_fan(mesh, node) result(element)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      integer :: next, start
      start = mesh%element_of(node)
      element = start
      do
         next = turn(mesh, element, node, [1, 2, 3])
         if (next == 0 .or. next == start) exit
         element = next
      end do
      if (next == start) element = start
   end function first_of_fan

   !> All elements that have a node, counter-clockwise. Where parts of the body touch at a point only (hinge), the
   !> whole mesh is searched.
   subroutine elements_around(mesh, node, elements, n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> the elements, (capacity)
      integer, allocatable, intent(inout) :: elements(:)
      !> how many there are
      integer, intent(out) :: n
      integer :: e, start
      n = 0
      if (mesh%hinge(node)) then
         do e = 1, mesh%n_elements
            if (is_corner(mesh, e, node)) call append()
         end do
         return
      end if
      start = mesh%element_of(node)
      call walk()
      if (e /= 0) return
      start = first_of_fan(mesh, node)      ! an open fan
      if (start == elements(1)) return
      n = 0
      call walk()

   contains

      !> Counter-clockwise from the start until the fan ends or closes.
      subroutine walk()
         integer :: k
         e = start
         k = corner_of(mesh, e, node)
         do
            call append()
            e = mesh%neighbour(previous_corner(k), e)
            if (e == 0 .or. e == start) exit
            k = corner_of(mesh, e, node)
            if (k > 0) cycle
            e = 0
            exit
         end do
      end subroutine walk

      subroutine append()
         n = n + 1
         if (.not. allocated(elements)) allocate (elements(8))
         if (n > size(elements)) call grow(elements, n)
         elements(n) = e
      end subroutine append

   end subroutine elements_around

   !> Whether a node lies on the boundary of the body or on an opened crack: its fan is not closed.
   logical function node_on_boundary(mesh, node)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      integer :: last
      last = first_of_fan(mesh, node)
      node_on_boundary = turn(mesh, last, node, [1, 2, 3]) == 0 .or. mesh%hinge(node)
   end function node_on_boundary

   !> Operation 1: put a node at the middle of an edge and cut the one or two triangles on it. A cracked edge gives
   !> each side its own midpoint and two cracked halves.
   subroutine bisect_edge(mesh, element, edge, changes, midpoint, position)
      type(mesh_t), intent(inout) :: mesh
      !> the edge: its element and its number there
      integer, intent(in) :: element, edge
      type(changes_t), intent(inout) :: changes
      !> the new node on the element's side
      integer, intent(out) :: midpoint
      !> where the node is put [length] (absent: the middle)
      real(wp), intent(in), optional :: position(2)
      integer :: other, k, child, other_child, far_midpoint, segment
      logical :: on_boundary

      other = mesh%neighbour(edge, element)
      segment = mesh%segment_at(edge, element)
      on_boundary = other == 0
      call new_midpoint(mesh, element, edge, on_boundary, changes, midpoint, position)
      if (other == 0) then
         call cut_triangle(mesh, element, edge, midpoint, changes, child)
         return
      end if
      k = mesh%edge_index(other, element)
      far_midpoint = midpoint
      if (segment > 0) call new_midpoint(mesh, other, k, .false., changes, far_midpoint, position)
      call cut_triangle(mesh, element, edge, midpoint, changes, child)
      call cut_triangle(mesh, other, k, far_midpoint, changes, other_child)
      mesh%neighbour(edge, element) = other_child
      mesh%neighbour(k, other_child) = element
      mesh%neighbour(edge, child) = other
      mesh%neighbour(k, other) = child
      if (segment > 0) call halve_segment(mesh, segment, [element, other_child], [child, other], [edge, k])
   end subroutine bisect_edge

   !> A node at the middle of an edge. It belongs to the node sets of both ends where the edge is a boundary edge.
   subroutine new_midpoint(mesh, element, edge, on_boundary, changes, node, position)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: element, edge
      logical, intent(in) :: on_boundary
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: node
      real(wp), intent(in), optional :: position(2)
      integer :: a, b
      a = mesh%connectivity(edge, element)
      b = mesh%connectivity(next_corner(edge), element)
      call append_node(mesh, node)
      mesh%x(:, node) = 0.5_wp*(mesh%x(:, a) + mesh%x(:, b))
      if (present(position)) mesh%x(:, node) = position
      mesh%node_origin(node) = no_origin
      mesh%share(node) = 0
      mesh%node_membership(:, node) = 0
      if (on_boundary) mesh%node_membership(:, node) = iand(mesh%node_membership(:, a), mesh%node_membership(:, b))
      call changes%add_node(node, [a, b], on_boundary)
   end subroutine new_midpoint

   !> Room and numbers for one more node.
   subroutine append_node(mesh, node)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(out) :: node
      node = mesh%n_nodes + 1
      call mesh%keep_copies()
      call mesh%reserve_nodes(node)
      mesh%n_nodes = node
      mesh%last_node_id = mesh%last_node_id + 1
      mesh%node_id(node) = mesh%last_node_id
      mesh%node_rank(node) = node
      mesh%hinge(node) = .false.
   end subroutine append_node

   !> Cut a triangle from the middle of an edge to the far corner: it keeps the part at the edge's first node, the
   !> child gets the other, with the edge and its neighbours on the same local numbers.
   subroutine cut_triangle(mesh, element, edge, midpoint, changes, child)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: element, edge, midpoint
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: child
      integer :: second, third, across, b

      second = next_corner(edge)
      third = previous_corner(edge)
      call append_element(mesh, element, child)
      b = mesh%connectivity(second, element)
      mesh%connectivity(second, element) = midpoint
      mesh%connectivity(edge, child) = midpoint
      if (mesh%element_of(b) == element) mesh%element_of(b) = child
      mesh%element_of(midpoint) = element

      across = mesh%neighbour(second, element)        ! b - c now belongs to the child
      if (across > 0) mesh%neighbour(mesh%edge_index(across, element), across) = child
      call move_segment(mesh, mesh%segment_at(second, element), element, child)
      mesh%neighbour(second, element) = child
      mesh%neighbour(third, child) = element
      if (allocated(mesh%segment)) then
         mesh%segment(second, element) = 0
         mesh%segment(third, child) = 0
      end if
      if (allocated(mesh%face_tag)) then
         mesh%face_tag(second, element) = 0
         mesh%face_tag(third, child) = 0
      end if
      call changes%add_child(child, element)
   end subroutine cut_triangle

   !> One more element with all properties of its parent, one generation above it.
   subroutine append_element(mesh, parent, child)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: parent
      integer, intent(out) :: child
      child = mesh%n_elements + 1
      call mesh%keep_copies()
      call mesh%reserve_elements(child)
      mesh%n_elements = child
      mesh%split_level(parent) = mesh%split_level(parent) + 1_i1
      mesh%connectivity(:, child) = mesh%connectivity(:, parent)
      mesh%neighbour(:, child) = mesh%neighbour(:, parent)
      if (allocated(mesh%segment)) mesh%segment(:, child) = mesh%segment(:, parent)
      if (allocated(mesh%face_tag)) mesh%face_tag(:, child) = mesh%face_tag(:, parent)
      mesh%element_origin(child) = mesh%element_origin(parent)
      mesh%section(child) = mesh%section(parent)
      mesh%split_level(child) = mesh%split_level(parent)
      mesh%element_membership(:, child) = mesh%element_membership(:, parent)
      mesh%last_element_id = mesh%last_element_id + 1
      mesh%element_id(child) = mesh%last_element_id
      mesh%element_rank(child) = child
   end subroutine append_element

   !> A crack segment's side passes from one element to another.
   subroutine move_segment(mesh, segment, from, to)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: segment, from, to
      if (segment == 0) return
      where (mesh%segment_element(:, segment) == from) mesh%segment_element(:, segment) = to
   end subroutine move_segment

   !> A cracked edge was bisected: its segment keeps the half of the first pair of elements, a new one gets the other.
   subroutine halve_segment(mesh, segment, first_half, second_half, edges)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: segment, first_half(2), second_half(2), edges(2)
      integer :: s, order(2), event, crack
      integer(i1) :: mode
      order = [1, 2]       ! keeps which side is the first
      if (mesh%segment_element(1, segment) /= first_half(1)) order = [2, 1]
      mode = mesh%segment_mode(segment)       ! copies: the arrays move when they grow
      event = mesh%segment_event(segment)
      crack = mesh%segment_crack(segment)
      call append_segment(mesh, mode, event, crack, s)
      mesh%segment_straight(s) = mesh%segment_straight(segment)
      mesh%segment_element(:, segment) = first_half(order)
      mesh%segment_element(:, s) = second_half(order)
      mesh%segment(edges(1), first_half(1)) = segment
      mesh%segment(edges(2), first_half(2)) = segment
      mesh%segment(edges(1), second_half(1)) = s
      mesh%segment(edges(2), second_half(2)) = s
   end subroutine halve_segment

   subroutine append_segment(mesh, mode, event, crack, segment)
      type(mesh_t), intent(inout) :: mesh
      integer(i1), intent(in) :: mode
      integer, intent(in) :: event, crack
      integer, intent(out) :: segment
      segment = mesh%n_segments + 1
      call mesh%reserve_segments(segment)
      mesh%n_segments = segment
      mesh%segment_mode(segment) = mode
      mesh%segment_event(segment) = event
      mesh%segment_crack(segment) = crack
      mesh%segment_straight(segment) = 1
   end subroutine append_segment

   !> Operation 2: flag an edge as cracked. An edge of the boundary, or one that is cracked already, stays as it is.
   subroutine crack_edge(mesh, element, edge, mode, event, crack)
      type(mesh_t), intent(inout) :: mesh
      !> the edge: its element and its number there
      integer, intent(in) :: element, edge
      !> 1 tension, 2 shear, 0 pre-existing
      integer(i1), intent(in) :: mode
      !> number of the event (0: pre-existing)
      integer, intent(in) :: event
      !> number of the *CRACK it belongs to (absent: of none)
      integer, intent(in), optional :: crack
      integer :: other, k, segment, number
      other = mesh%neighbour(edge, element)
      if (other == 0 .or. mesh%segment_at(edge, element) > 0) return
      k = mesh%edge_index(other, element)
      number = 0
      if (present(crack)) number = crack
      call append_segment(mesh, mode, event, number, segment)
      call mesh%keep_segments()
      mesh%segment(edge, element) = segment
      mesh%segment(k, other) = segment
      mesh%segment_element(:, segment) = [min(element, other), max(element, other)]
   end subroutine crack_edge

   !> Operation 3: group the elements round a node into fans connected through intact edges. The fan with the first
   !> element (in the order of the output) keeps the node, each other gets a copy of it.
   subroutine refan_node(mesh, node, changes, n_copies)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: node
      type(changes_t), intent(inout) :: changes
      !> copies there are now, the node itself included
      integer, intent(out) :: n_copies
      integer, allocatable :: around(:)
      integer :: n

      n_copies = 1
      if (mesh%hinge(node)) return
      call elements_around(mesh, node, around, n)
      around = around(:n)
      call part_fans(mesh, node, around, changes, n_copies)
   end subroutine refan_node

   !> The same with the elements of the node known: they need not hang together through edges.
   subroutine part_fans(mesh, node, around, changes, n_copies)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: node
      !> elements of the node; put into the order of the output, so that internal numbering does not show
      integer, intent(inout) :: around(:)
      type(changes_t), intent(inout) :: changes
      !> copies there are now, the node itself included
      integer, intent(out) :: n_copies
      integer, allocatable :: fan(:)
      integer :: n, i, copy, f
      n = size(around)
      around = around(sorted_order(int(mesh%element_rank(around), i8)))
      call group_fans(mesh, node, around, fan, n_copies)
      if (n_copies == 1) return
      call mesh%keep_copies()
      mesh%share(node) = mesh%share(node)/n_copies
      mesh%element_of(node) = around(1)
      do f = 2, n_copies
         call append_node(mesh, copy)
         mesh%x(:, copy) = mesh%x(:, node)
         mesh%node_origin(copy) = mesh%node_origin(node)
         mesh%share(copy) = mesh%share(node)
         mesh%node_membership(:, copy) = mesh%node_membership(:, node)
         call changes%add_node(copy, [node, 0], .false.)
         do i = n, 1, -1
            if (fan(i) /= f) cycle
            mesh%connectivity(corner_of(mesh, around(i), node), around(i)) = copy
            mesh%element_of(copy) = around(i)
            call changes%add_element(around(i))
         end do
      end do
      do i = 1, n
         if (fan(i) == 1) call changes%add_element(around(i))
      end do
   end subroutine part_fans

   !> Number the fans round a node, the one with the lowest element first.
   subroutine group_fans(mesh, node, around, fan, n_fans)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> elements round the node, ascending
      integer, intent(in) :: around(:)
      !> number of the fan of each
      integer, allocatable, intent(out) :: fan(:)
      integer, intent(out) :: n_fans
      integer :: i
      allocate (fan(size(around)), source=0)
      n_fans = 0
      do i = 1, size(around)
         if (fan(i) /= 0) cycle
         n_fans = n_fans + 1
         call label(around(i), [1, 2, 3])
         call label(around(i), previous_corner)
      end do

   contains

      !> Give the number of the fan to all elements met on turning one way until a crack or the boundary.
      subroutine label(first, side)
         integer, intent(in) :: first, side(3)
         integer :: e
         e = first
         do
            fan(findloc_first(around, e)) = n_fans
            if (mesh%segment_at(side(corner_of(mesh, e, node)), e) > 0) exit
            e = turn(mesh, e, node, side)
            if (e == 0 .or. e == first) exit
         end do
      end subroutine label

   end subroutine group_fans

   pure integer function findloc_first(list, value) result(i)
      integer, intent(in) :: list(:), value
      do i = 1, size(list) - 1
         if (list(i) == value) return
      end do
      i = size(list)
   end function findloc_first

   !> Insertion sort; the lists are short.
   pure subroutine sort_ascending(list)
      integer, intent(inout) :: list(:)
      integer :: i, j, value
      do i = 2, size(list)
         value = list(i)
         do j = i - 1, 1, -1
            if (list(j) <= value) exit
            list(j + 1) = list(j)
         end do
         list(j + 1) = value
      end do
   end subroutine sort_ascending

   !> To or from a checkpoint. (Derived: listed_at from the list.)
   subroutine exchange(self, archive)
      class(changes_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n_nodes', self%n_nodes)
      call archive%exchange('n_elements', self%n_elements)
      call archive%exchange('node', self%node)
      call archive%exchange('parent', self%parent)
      call archive%exchange('on_boundary', self%on_boundary)
      call archive%exchange('element', self%element)
      call archive%exchange('child', self%child)
      call archive%exchange('n_children', self%n_children)
      if (archive%reading .and. allocated(self%listed_at)) deallocate (self%listed_at)
   end subroutine exchange

end module rf_topology
