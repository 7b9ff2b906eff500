!> Fits the mesh to cracks that exist from the start (`*CRACK, SPLITTING=FIT`), so that each lies exactly on its line:
!> its points become nodes, nodes near the line move onto it, edges that still cross it are cut there (theory: section
!> 7.1, eqs. 35a and 35b). Afterwards rf_crack_line finds the edges on the line.
module rf_crack_fit
   use rf_kinds, only: wp, i1, i8, pi
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, bisect_edge, elements_around, corner_of, next_corner, previous_corner
   use rf_crack_line, only: line_margin, is_beside
   use rf_fit_freedom, only: freedom_t, fixed, along_line, free, fan_angle, smallest_angle_of, edge_length, side_of
   implicit none
   private
   public :: fit_t

   !> nodes nearer to the line than this part of the edge length move onto it
   real(wp), parameter :: reach = 0.3_wp
   !> a node on a border moves by this part of the edge length at most
   real(wp), parameter :: border_reach = 0.45_wp
   !> a move must leave angles of this part of the distance over the edge length, which is about what a cut would leave
   real(wp), parameter :: least_gain = 0.7_wp
   !> triangles with smaller angles near a crack are improved by moving free nodes [rad]; how often; least gain [rad]
   real(wp), parameter :: good_angle = 30*pi/180, worthwhile = 1.0e-3_wp
   integer, parameter :: smoothing_passes = 6
   !> nodes within this many edge lengths of a crack may be smoothed
   real(wp), parameter :: smoothing_reach = 3
   !> nodes on the line but for rounding [part of the model's size]; too far away to be worth a walk [mean edges]
   real(wp), parameter :: rounding = 8*epsilon(1.0_wp), far = 100
   !> digits to which distances are compared, so that rounding does not decide the order
   real(wp), parameter :: sort_scale = 1.0e9_wp

   type :: fit_t
      type(freedom_t) :: freedom
      !> nodes moved, the largest of their moves [length], edges cut
      integer :: moved = 0, cut = 0
      real(wp) :: largest_move = 0
      !> smallest angle of the triangles near the cracks [rad]
      real(wp) :: smallest_angle = pi
      !> elements of the deck in the order of the output
      integer, allocatable, private :: order(:)
      !> where the nodes of the deck were [length], (2, nodes of the deck); which of them have been moved
      real(wp), allocatable, private :: home(:, :)
      logical, allocatable, private :: has_moved(:)
   contains
      procedure :: begin, fit_line, finish
      procedure, private :: embed_point, embed_on_border, embed_inside, move_nodes, move_to, cut_edges, smooth, near_nodes
   end type fit_t

contains

   !> Start with a mesh without cracks.
   subroutine begin(self, mesh, named)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> nodes that must stay where they are, besides those where sets end, (nodes)
      logical, intent(in), optional :: named(:)
      self%freedom%margin = line_margin*mesh%size
      call self%freedom%hold(mesh, named)
      self%home = mesh%x(:, :mesh%n_nodes)
      self%has_moved = spread(.false., 1, mesh%n_nodes)
      self%order = sorted_order(int(mesh%element_rank(:mesh%n_elements), i8))
   end subroutine begin

   !> Fit the mesh to a straight line: what of it lies in the body becomes a row of edges.
   subroutine fit_line(self, mesh, from, to, changes)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> its ends [length]
      real(wp), intent(in) :: from(2), to(2)
      type(changes_t), intent(inout) :: changes
      call self%embed_point(mesh, from, changes)
      call self%embed_point(mesh, to, changes)
      call self%move_nodes(mesh, from, to)
      call self%cut_edges(mesh, from, to, changes)
      call self%freedom%add_line(from, to)
   end subroutine fit_line

   !> Improve the triangles near the lines.
   subroutine finish(self, mesh, first_line)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> the lines from this one on were fitted
      integer, intent(in) :: first_line
      logical, allocatable :: near(:)
      integer, allocatable :: node(:)
      integer :: pass, e, i
      allocate (near, source=self%near_nodes(mesh, first_line))
      node = pack([(i, i=1, mesh%n_nodes)], near)
      node = node(sorted_order(int(mesh%node_rank(node), i8)))
      if (self%moved + self%cut > 0) then
         do pass = 1, smoothing_passes
            call self%smooth(mesh, node)
         end do
      end if
      do e = 1, mesh%n_elements
         if (any(near(mesh%connectivity(:, e)))) &
            self%smallest_angle = min(self%smallest_angle, smallest_angle_of(mesh%x(:, mesh%connectivity(:, e))))
      end do
      mesh%split_level(:mesh%n_elements) = 0_i1      ! the run starts with this mesh
   end subroutine finish

   !> Make a point of a crack a node, unless it lies outside the body.
   subroutine embed_point(self, mesh, point, changes)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> [length]
      real(wp), intent(in) :: point(2)
      type(changes_t), intent(inout) :: changes
      integer :: n, e, element, k, how
      real(wp) :: least, inside, direction(2)
      do n = 1, mesh%n_nodes
         if (maxval(abs(mesh%x(:, n) - point)) > self%freedom%margin) cycle
         call self%freedom%of_node(mesh, n, how, direction)
         if (how == free) mesh%x(:, n) = point
         call self%freedom%pin(n)
         return
      end do
      element = 0
      inside = -self%freedom%margin
      do e = 1, mesh%n_elements
         if (is_beside(mesh, e, point - self%freedom%margin, point + self%freedom%margin)) cycle
         least = huge(1.0_wp)
         do k = 1, 3
            least = min(least, side_of(point, mesh%x(:, mesh%connectivity(k, e)), mesh%x(:, mesh%connectivity(next_corner(k), e))))
         end do
         if (least < inside) cycle
         inside = least
         element = e
      end do
      if (element == 0) return
      do k = 1, 3
         if (abs(side_of(point, mesh%x(:, mesh%connectivity(k, element)), &
                         mesh%x(:, mesh%connectivity(next_corner(k), element)))) > self%freedom%margin) cycle
         if (self%freedom%is_border(mesh, element, k)) exit
      end do
      if (k <= 3) call self%embed_on_border(mesh, point, element, k, changes, n)
      if (k > 3) call self%embed_inside(mesh, point, element, changes, n)
      call self%freedom%pin(n)
   end subroutine embed_point

   !> Make a point on an edge that must stay where it is a node: an end of the edge slides there, or the edge is cut.
   subroutine embed_on_border(self, mesh, point, element, edge, changes, node)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: element, edge
      type(changes_t), intent(inout) :: changes
      !> the node there
      integer, intent(out) :: node
      real(wp) :: ends(2, 2), along(2), place(2), direction(2), score, best
      integer :: i, n, how
      ends = mesh%x(:, mesh%connectivity([edge, next_corner(edge)], element))
      along = (ends(:, 2) - ends(:, 1))/norm2(ends(:, 2) - ends(:, 1))
      place = ends(:, 1) + dot_product(point - ends(:, 1), along)*along
      best = cut_angle(mesh, element, edge, place)
      node = 0
      do i = 1, 2
         n = mesh%connectivity(merge(edge, next_corner(edge), i == 1), element)
         call self%freedom%of_node(mesh, n, how, direction)
         if (how /= along_line) cycle
         score = fan_angle(mesh, n, place)
         if (score < best) cycle
         best = score
         node = n
      end do
      if (node > 0) then
         call self%move_to(mesh, node, place)
      else
         call bisect_edge(mesh, element, edge, changes, node, place)
         self%cut = self%cut + 1
      end if
   end subroutine embed_on_border

   !> Make a point inside an element a node, in the way that leaves the largest smallest angle: a corner moves there, an
   !> edge is cut and bent to it; and if neither may be, the element is cut through the point.
   subroutine embed_inside(self, mesh, point, element, changes, node)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      real(wp), intent(in) :: point(2)
      integer, intent(in) :: element
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: node
      real(wp) :: score, best, direction(2), foot(2)
      integer :: k, best_k, how, foot_node, apex
      best = 0
      best_k = 0
      do k = 1, 3
         call self%freedom%of_node(mesh, mesh%connectivity(k, element), how, direction)
         if (how == free) call consider(fan_angle(mesh, mesh%connectivity(k, element), point), k)
         if (.not. self%freedom%is_border(mesh, element, k)) call consider(cut_angle(mesh, element, k, point), 3 + k)
      end do
      if (best_k == 0) then
         foot = cut_through(mesh, element, 1, point)
         apex = mesh%connectivity(3, element)
         call bisect_edge(mesh, element, 1, changes, foot_node, foot)
         call bisect_edge(mesh, element, edge_between(mesh, element, foot_node, apex), changes, node, point)
         self%cut = self%cut + 2
      else if (best_k <= 3) then
         node = mesh%connectivity(best_k, element)
         call self%move_to(mesh, node, point)
      else
         call bisect_edge(mesh, element, best_k - 3, changes, node, point)
         self%cut = self%cut + 1
      end if

   contains

      subroutine consider(angle, choice)
         real(wp), intent(in) :: angle
         integer, intent(in) :: choice
         score = angle
         if (score <= best) return
         best = score
         best_k = choice
      end subroutine consider

   end subroutine embed_inside

   !> Where the line from the corner across an edge through a point meets the edge [length].
   pure function cut_through(mesh, element, edge, point) result(place)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, edge
      real(wp), intent(in) :: point(2)
      real(wp) :: place(2), ends(2, 2), apex(2), a, b
      ends = mesh%x(:, mesh%connectivity([edge, next_corner(edge)], element))
      apex = mesh%x(:, mesh%connectivity(previous_corner(edge), element))
      a = side_of(ends(:, 1), apex, point)
      b = side_of(ends(:, 2), apex, point)
      place = ends(:, 1) + a/(a - b)*(ends(:, 2) - ends(:, 1))
   end function cut_through

   !> Number of the edge between two nodes of an element.
   pure integer function edge_between(mesh, element, a, b) result(edge)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, a, b
      edge = corner_of(mesh, element, a)
      if (mesh%connectivity(next_corner(edge), element) /= b) edge = previous_corner(edge)
   end function edge_between

   !> Smallest angle of the two or four triangles that come of cutting an edge at a place [rad].
   pure real(wp) function cut_angle(mesh, element, edge, place) result(angle)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, edge
      real(wp), intent(in) :: place(2)
      real(wp) :: corner(2, 3)
      integer :: e, k, side, i
      angle = pi
      e = element
      k = edge
      do side = 1, 2
         do i = 1, 2
            corner = mesh%x(:, mesh%connectivity(:, e))
            corner(:, merge(k, next_corner(k), i == 1)) = place
            angle = min(angle, smallest_angle_of(corner))
         end do
         e = mesh%neighbour(edge, element)
         if (e == 0) exit
         k = mesh%edge_index(e, element)
      end do
   end function cut_angle

   !> Move nodes near a line onto it, the nearest first.
   subroutine move_nodes(self, mesh, from, to)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      real(wp), intent(in) :: from(2), to(2)
      integer, allocatable :: node(:), order(:)
      real(wp), allocatable :: ratio(:)
      real(wp) :: along(2), s, distance, place(2)
      integer :: n, i, found
      logical :: allowed
      along = (to - from)/norm2(to - from)
      allocate (node(mesh%n_nodes), ratio(mesh%n_nodes))
      found = 0
      do n = 1, mesh%n_nodes
         s = dot_product(mesh%x(:, n) - from, along)
         if (s <= self%freedom%margin .or. s >= norm2(to - from) - self%freedom%margin) cycle
         distance = abs(side_of(mesh%x(:, n), from, to))
         if (distance <= rounding*mesh%size .or. distance > far*mesh%mean_edge) cycle
         distance = distance/edge_length(mesh, n)
         if (distance > reach) cycle
         found = found + 1
         node(found) = n
         ratio(found) = distance
      end do
      order = sorted_order(int(mesh%node_rank(node(:found)), i8))
      order = order(sorted_order(int(ratio(order)*sort_scale, i8)))
      do i = 1, found
         n = node(order(i))
         call find_place(self, mesh, n, from, to, allowed, place)
         if (.not. allowed) cycle
         if (fan_angle(mesh, n, place) < min(fan_angle(mesh, n, mesh%x(:, n)), least_gain*ratio(order(i)))) cycle
         call self%move_to(mesh, n, place)
      end do
   end subroutine move_nodes

   !> Where a node would meet a line.
   subroutine find_place(self, mesh, node, from, to, allowed, place)
      class(fit_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      real(wp), intent(in) :: from(2), to(2)
      !> it may move there
      logical, intent(out) :: allowed
      !> [length]
      real(wp), intent(out) :: place(2)
      real(wp) :: along(2), direction(2), normal(2), distance, step, s
      integer :: how
      along = (to - from)/norm2(to - from)
      normal = [-along(2), along(1)]
      distance = side_of(mesh%x(:, node), from, to)
      call self%freedom%of_node(mesh, node, how, direction)
      if (how == free) direction = normal
      allowed = how /= fixed .and. abs(dot_product(direction, normal))*border_reach*edge_length(mesh, node) > abs(distance)
      place = mesh%x(:, node)
      if (.not. allowed) return
      step = -distance/dot_product(direction, normal)
      place = place + step*direction
      s = dot_product(place - from, along)
      allowed = s > self%freedom%margin .and. s < norm2(to - from) - self%freedom%margin
   end subroutine find_place

   !> Move a node. Those of the deck are counted, each once.
   subroutine move_to(self, mesh, node, place)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: node
      real(wp), intent(in) :: place(2)
      mesh%x(:, node) = place
      if (node > size(self%has_moved)) return
      if (.not. self%has_moved(node)) self%moved = self%moved + 1
      self%has_moved(node) = .true.
      self%largest_move = max(self%largest_move, norm2(place - self%home(:, node)))
   end subroutine move_to

   !> Cut all edges that cross a line, where they cross it. Elements come in the order of the output, new ones after them.
   subroutine cut_edges(self, mesh, from, to, changes)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      real(wp), intent(in) :: from(2), to(2)
      type(changes_t), intent(inout) :: changes
      real(wp) :: place(2), low(2), high(2)
      integer :: i, e, k, node
      low = min(from, to)
      high = max(from, to)
      i = 0
      do while (i < mesh%n_elements)
         i = i + 1
         e = i
         if (i <= size(self%order)) e = self%order(i)
         if (is_beside(mesh, e, low, high)) cycle
         k = 0
         do while (k < 3)
            k = k + 1
            if (.not. crosses()) cycle
            call bisect_edge(mesh, e, k, changes, node, place)
            self%cut = self%cut + 1
            k = 0
         end do
      end do

   contains

      !> Whether edge k of element e crosses the line, and where.
      logical function crosses()
         real(wp) :: a(2), b(2), sa, sb, s
         crosses = .false.
         a = mesh%x(:, mesh%connectivity(k, e))
         b = mesh%x(:, mesh%connectivity(next_corner(k), e))
         sa = side_of(a, from, to)
         sb = side_of(b, from, to)
         if (min(abs(sa), abs(sb)) <= self%freedom%margin .or. sa*sb > 0) return
         place = a + sa/(sa - sb)*(b - a)
         s = dot_product(place - from, to - from)/norm2(to - from)
         crosses = s > self%freedom%margin .and. s < norm2(to - from) - self%freedom%margin
      end function crosses

   end subroutine cut_edges

   !> Which nodes lie near one of the lines that were fitted.
   pure function near_nodes(self, mesh, first_line) result(near)
      class(fit_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: first_line
      !> (nodes)
      logical, allocatable :: near(:)
      real(wp) :: from(2), to(2), along(2), low(2), high(2), s, distance
      integer :: i, n
      allocate (near(mesh%n_nodes))
      near = .false.
      distance = smoothing_reach*mesh%mean_edge
      do i = first_line, self%freedom%n_lines
         from = self%freedom%line(:, 2*i - 1)
         to = self%freedom%line(:, 2*i)
         along = (to - from)/norm2(to - from)
         low = min(from, to) - distance
         high = max(from, to) + distance
         do n = 1, mesh%n_nodes
            if (near(n) .or. any(mesh%x(:, n) < low) .or. any(mesh%x(:, n) > high)) cycle
            s = min(max(dot_product(mesh%x(:, n) - from, along), 0.0_wp), norm2(to - from))
            near(n) = norm2(mesh%x(:, n) - from - s*along) <= distance
         end do
      end do
   end function near_nodes

   !> Move free nodes near the lines towards the middle of their neighbours where that makes the smallest angle larger.
   subroutine smooth(self, mesh, node)
      class(fit_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> the nodes, in the order of the output
      integer, intent(in) :: node(:)
      integer, allocatable :: around(:)
      real(wp) :: before, after, middle(2), place(2), direction(2)
      integer :: i, j, k, n, n_around, how, attempt
      do i = 1, size(node)
         n = node(i)
         before = fan_angle(mesh, n, mesh%x(:, n))
         if (before >= good_angle) cycle
         call self%freedom%of_node(mesh, n, how, direction)
         if (how == fixed) cycle
         call elements_around(mesh, n, around, n_around)
         middle = 0
         do j = 1, n_around
            k = corner_of(mesh, around(j), n)
            middle = middle + mesh%x(:, mesh%connectivity(next_corner(k), around(j))) &
                     + mesh%x(:, mesh%connectivity(previous_corner(k), around(j)))
         end do
         middle = middle/(2*n_around) - mesh%x(:, n)
         if (how == along_line) middle = dot_product(middle, direction)*direction
         do attempt = 0, 3
            place = mesh%x(:, n) + 0.5_wp**attempt*middle
            after = fan_angle(mesh, n, place)
            if (after < before + worthwhile) cycle
            call self%move_to(mesh, n, place)
            exit
         end do
      end do
   end subroutine smooth

end module rf_crack_fit
