!> From a failed node to a split: which of the possible directions, through which element, of which type (Qiu & Ding
!> 2007, section 2.3, figs. 2 to 6; theory: eqs. 34 and 35), or along which edge. Decides only; rf_splitting carries it out.
module rf_ray
   use rf_kinds, only: wp, i1, degree
   use rf_archive, only: archive_t
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around, corner_of, is_corner, next_corner, previous_corner
   implicit none
   private
   public :: split_t, split_limits_t, choose_split, split_type_name
   public :: type_none, type_one, type_two, type_three, type_edge

   !> types of splitting
   integer, parameter :: type_none = 0, type_one = 1, type_two = 2, type_three = 3, type_edge = 4
   !> the ray meets the far edge within this distance of its middle: type I; of an end: type II (parts of the edge)
   real(wp), parameter :: middle_zone = 0.20_wp, end_zone = 0.20_wp
   !> utilisations of crossed elements closer than this tie
   real(wp), parameter :: tie = 1.0e-6_wp
   !> turns (cosines) closer than this tie
   real(wp), parameter :: turn_tie = 1.0e-6_wp
   !> a ray this close to an edge [rad] enters the elements on both sides of it: rounding shall not choose between them,
   !> nor let the ray pass between both
   real(wp), parameter :: edge_tie = 1.0e-9_wp

   type :: split_limits_t
      !> generations of children
      integer :: max_level = 2
      !> smallest angle of a child [rad]
      real(wp) :: smallest_angle = 12*degree
      !> smallest angle between a new crack and one that is at the node [rad]
      real(wp) :: crack_angle = 30*degree
      !> cracks run along edges of the mesh, nothing is bisected
      logical :: along_edges = .false.
   end type split_limits_t

   !> One split as planned.
   type :: split_t
      !> failed node (0: no split) and crossed element
      integer :: node = 0, element = 0
      integer :: kind = type_none
      !> direction of the ray, unit vector
      real(wp) :: direction(2) = 0
      !> where the ray meets the far edge B-C: B + s (C - B)
      real(wp) :: s = 0
      integer(i1) :: mode = 0_i1
      !> number of the *CRACK that it makes (0: none)
      integer :: crack = 0
      !> principal stresses of the node, compression positive [stress], its utilisation [-]
      real(wp) :: sigma1 = 0, sigma3 = 0, utilisation = 0
      !> type I and III: far corner (1: B, 2: C) that the ray passes in the neighbour; type II and edge: the near corner
      integer :: corner = 0
      !> type III: the second ray's far corner O, 1: R, 2: D
      integer :: second_corner = 0
   contains
      procedure :: exchange
   end type split_t

   !> a direction with the element it enters
   type :: candidate_t
      integer :: element = 0
      real(wp) :: direction(2) = 0, s = 0, utilisation = 0, turn = 0
   end type candidate_t

contains

   !> Name of a type in the event table.
   pure function split_type_name(kind) result(name)
      integer, intent(in) :: kind
      character(len=4) :: name
      character(len=4), parameter :: names(0:4) = ['-   ', 'I   ', 'II  ', 'III ', 'edge']
      name = names(kind)
   end function split_type_name

   !> The best admissible split at a node: of all directions the one whose crossed element has the largest
   !> utilisation; ties by the smaller turn from a crack that ends here, then by the lower element number.
   subroutine choose_split(mesh, node, ray, limits, element_utilisation, no_split_node, no_split_element, split)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> directions, unit vectors, (2, rays)
      real(wp), intent(in) :: ray(:, :)
      type(split_limits_t), intent(in) :: limits
      !> (elements)
      real(wp), intent(in) :: element_utilisation(:)
      !> what never breaks
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      !> split%node = 0 where no direction is admissible
      type(split_t), intent(out) :: split
      type(candidate_t), allocatable :: list(:)
      integer, allocatable :: around(:)
      integer :: n, i, best, n_list
      logical, allocatable :: tried(:)
      call elements_around(mesh, node, around, n)
      allocate (list(2*n*size(ray, 2)), tried(2*n*size(ray, 2)))
      call collect(mesh, node, around(:n), ray, limits, element_utilisation, list, n_list)
      tried = .false.
      do i = 1, n_list
         best = best_of(mesh, list(:n_list), tried(:n_list))
         tried(best) = .true.
         if (no_split_element(list(best)%element)) cycle
         if (limits%along_edges) then
            call fit_edge(mesh, node, list(best), no_split_node, no_split_element, split)
         else
            call fit_type(mesh, node, list(best), limits, no_split_node, no_split_element, split)
         end if
         if (split%node > 0) return
      end do
   end subroutine choose_split

   !> All directions that enter an element of the node's fan and keep their distance from cracks at the node.
   subroutine collect(mesh, node, around, ray, limits, element_utilisation, list, n)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, around(:)
      real(wp), intent(in) :: ray(:, :)
      type(split_limits_t), intent(in) :: limits
      real(wp), intent(in) :: element_utilisation(:)
      type(candidate_t), intent(inout) :: list(:)
      integer, intent(out) :: n
      real(wp) :: s, turn
      integer :: r, i
      n = 0
      do r = 1, size(ray, 2)
         if (near_crack(mesh, node, around, ray(:, r), limits%crack_angle)) cycle
         turn = turn_from_tip(mesh, node, around, ray(:, r))
         do i = 1, size(around)
            if (.not. enters(mesh, node, around(i), ray(:, r), s)) cycle
            n = n + 1
            list(n) = candidate_t(around(i), ray(:, r), s, element_utilisation(around(i)), turn)
         end do
      end do
   end subroutine collect

   !> Whether a ray from a node enters an element, and where it meets the far edge.
   logical function enters(mesh, node, element, direction, s)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, element
      real(wp), intent(in) :: direction(2)
      real(wp), intent(out) :: s
      real(wp) :: b(2), c(2), right, left
      integer :: k
      k = corner_of(mesh, element, node)
      b = mesh%x(:, mesh%connectivity(next_corner(k), element)) - mesh%x(:, node)
      c = mesh%x(:, mesh%connectivity(previous_corner(k), element)) - mesh%x(:, node)
      right = cross(b, direction)
      left = cross(direction, c)
      s = 0
      enters = right >= -edge_tie*norm2(b) .and. left >= -edge_tie*norm2(c) .and. right + left > 0
      if (enters) s = min(1.0_wp, max(0.0_wp, right/(right + left)))
   end function enters

   pure real(wp) function cross(a, b)
      real(wp), intent(in) :: a(2), b(2)
      cross = a(1)*b(2) - a(2)*b(1)
   end function cross

   !> Whether a cracked edge at the node lies within an angle of a direction.
   pure logical function near_crack(mesh, node, around, direction, angle)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, around(:)
      real(wp), intent(in) :: direction(2), angle
      integer :: i
      near_crack = .false.
      do i = 1, size(around)
         near_crack = near_crack .or. close_to(around(i))
      end do

   contains

      pure logical function close_to(element)
         integer, intent(in) :: element
         integer :: k
         real(wp) :: along(2)
         k = corner_of(mesh, element, node)
         close_to = .false.
         if (mesh%segment_at(k, element) > 0) then
            along = mesh%x(:, mesh%connectivity(next_corner(k), element)) - mesh%x(:, node)
            close_to = dot_product(along, direction) > cos(angle)*norm2(along)
         end if
         k = previous_corner(k)
         if (mesh%segment_at(k, element) > 0) then
            along = mesh%x(:, mesh%connectivity(k, element)) - mesh%x(:, node)
            close_to = close_to .or. dot_product(along, direction) > cos(angle)*norm2(along)
         end if
      end function close_to

   end function near_crack

   !> How far a direction turns from a crack that ends at the node: 1 - cosine of the angle to its continuation. 0 where
   !> none ends here: then the node is on no crack, or on the face of one that has opened.
   pure real(wp) function turn_from_tip(mesh, node, around, direction) result(turn)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, around(:)
      real(wp), intent(in) :: direction(2)
      real(wp) :: along(2)
      integer :: i, k
      turn = 0
      do i = 1, size(around)
         k = corner_of(mesh, around(i), node)
         if (mesh%segment_at(k, around(i)) == 0) cycle
         if (.not. is_corner(mesh, mesh%neighbour(k, around(i)), node)) cycle      ! its other side has a copy of the node
         along = mesh%x(:, node) - mesh%x(:, mesh%connectivity(next_corner(k), around(i)))
         turn = 1 - dot_product(along, direction)/norm2(along)
      end do
   end function turn_from_tip

   !> The candidate to try next.
   integer function best_of(mesh, list, tried) result(best)
      type(mesh_t), intent(in) :: mesh
      type(candidate_t), intent(in) :: list(:)
      logical, intent(in) :: tried(:)
      real(wp) :: largest
      integer :: i
      largest = maxval(list%utilisation, .not. tried)
      best = 0
      do i = 1, size(list)
         if (tried(i) .or. list(i)%utilisation < largest - tie*abs(largest)) cycle
         if (best == 0) then
            best = i
         else if (list(i)%turn < list(best)%turn - turn_tie) then
            best = i
         else if (list(i)%turn <= list(best)%turn + turn_tie .and. &
                  mesh%element_id(list(i)%element) < mesh%element_id(list(best)%element)) then
            best = i
         end if
      end do
   end function best_of

   !> The type by where the ray meets the far edge, or the next best that is admissible: III, I, II / I, II / II, I.
   subroutine fit_type(mesh, node, candidate, limits, no_split_node, no_split_element, split)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(candidate_t), intent(in) :: candidate
      type(split_limits_t), intent(in) :: limits
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      type(split_t), intent(out) :: split
      integer :: order(3), i
      logical :: admissible
      if (abs(candidate%s - 0.5_wp) <= middle_zone) then
         order = [type_one, type_two, type_none]
      else if (min(candidate%s, 1 - candidate%s) <= end_zone) then
         order = [type_two, type_one, type_none]
      else
         order = [type_three, type_one, type_two]
      end if
      split%element = candidate%element
      split%direction = candidate%direction
      split%s = candidate%s
      do i = 1, 3
         split%kind = order(i)
         admissible = .false.
         select case (order(i))
         case (type_one)
            admissible = fits_one(mesh, node, split, limits, no_split_node, no_split_element)
         case (type_two)
            admissible = fits_two(mesh, node, split, limits, no_split_node, no_split_element)
         case (type_three)
            admissible = fits_three(mesh, node, split, limits, no_split_node, no_split_element)
         end select
         if (admissible) then
            split%node = node
            return
         end if
      end do
      split%node = 0
   end subroutine fit_type

   !> The edge of the entered element that makes the smaller angle with the ray, or the other one where that is part of
   !> the boundary, cracked already, or never breaks.
   subroutine fit_edge(mesh, node, candidate, no_split_node, no_split_element, split)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(candidate_t), intent(in) :: candidate
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      type(split_t), intent(out) :: split
      real(wp) :: b(2), c(2)
      integer :: k, attempt
      split%kind = type_edge
      split%element = candidate%element
      split%direction = candidate%direction
      split%s = candidate%s
      k = corner_of(mesh, candidate%element, node)
      b = mesh%x(:, mesh%connectivity(next_corner(k), candidate%element)) - mesh%x(:, node)
      c = mesh%x(:, mesh%connectivity(previous_corner(k), candidate%element)) - mesh%x(:, node)
      split%corner = merge(1, 2, dot_product(b, split%direction)*norm2(c) >= dot_product(c, split%direction)*norm2(b))
      do attempt = 1, 2
         if (may_crack(mesh, node, split, no_split_node, no_split_element)) then
            split%node = node
            return
         end if
         split%corner = 3 - split%corner
      end do
   end subroutine fit_edge

   !> Whether the edge from the node to the near corner may become a crack as it is.
   logical function may_crack(mesh, node, split, no_split_node, no_split_element)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(split_t), intent(in) :: split
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      integer :: k, near
      k = corner_of(mesh, split%element, node)
      near = mesh%connectivity(merge(next_corner(k), previous_corner(k), split%corner == 1), split%element)
      if (split%corner == 2) k = previous_corner(k)
      may_crack = mesh%neighbour(k, split%element) > 0 .and. mesh%segment_at(k, split%element) == 0 .and. .not. no_split_node(near)
      if (may_crack) may_crack = .not. no_split_element(mesh%neighbour(k, split%element))
   end function may_crack

   !> Type I: crack from the node to the middle of the far edge and on to the far corner of the neighbour.
   logical function fits_one(mesh, node, split, limits, no_split_node, no_split_element) result(fits)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(split_t), intent(inout) :: split
      type(split_limits_t), intent(in) :: limits
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      integer :: k, far
      k = next_corner(corner_of(mesh, split%element, node))       ! the far edge B-C
      fits = may_bisect(mesh, split%element, k, limits, no_split_node, no_split_element)
      if (.not. fits) return
      far = mesh%neighbour(k, split%element)
      if (far == 0 .or. mesh%segment_at(k, split%element) > 0) return
      fits = .not. no_split_node(opposite(mesh, far, split%element))
   end function fits_one

   !> Type II: crack along the edge that the ray is close to, in two halves. Not on a boundary or a cracked edge.
   logical function fits_two(mesh, node, split, limits, no_split_node, no_split_element) result(fits)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(split_t), intent(inout) :: split
      type(split_limits_t), intent(in) :: limits
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      integer :: k, near
      k = corner_of(mesh, split%element, node)
      split%corner = merge(1, 2, split%s <= 0.5_wp)
      near = mesh%connectivity(merge(next_corner(k), previous_corner(k), split%corner == 1), split%element)
      if (split%corner == 2) k = previous_corner(k)
      fits = mesh%neighbour(k, split%element) > 0 .and. mesh%segment_at(k, split%element) == 0 .and. .not. no_split_node(near)
      if (fits) fits = may_bisect(mesh, split%element, k, limits, no_split_node, no_split_element)
   end function fits_two

   !> Type III: the ray goes on through the neighbour j = (B, C, D), leaves it through R-D at N into p = (R, D, E), and
   !> on through O-E into q. The crack runs A - M - N - M' - Q; p or q may be missing.
   logical function fits_three(mesh, node, split, limits, no_split_node, no_split_element) result(fits)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(split_t), intent(inout) :: split
      type(split_limits_t), intent(in) :: limits
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      integer :: i, j, p, q, k, kj, kp, b, c, d, r, s, e, o, level(4)
      real(wp) :: m(2), n(2), w(2), x(2, 8)
      fits = .false.
      i = split%element
      k = next_corner(corner_of(mesh, i, node))
      b = mesh%connectivity(k, i)
      c = mesh%connectivity(next_corner(k), i)
      j = mesh%neighbour(k, i)
      if (j == 0 .or. mesh%segment_at(k, i) > 0) return
      if (no_split_element(i) .or. no_split_element(j) .or. (no_split_node(b) .and. no_split_node(c))) return
      d = opposite(mesh, j, i)
      ! the ray passes D on one side and leaves j through the edge on the other
      split%corner = merge(2, 1, cross(split%direction, mesh%x(:, d) - mesh%x(:, node)) < 0)
      r = merge(b, c, split%corner == 1)
      s = merge(c, b, split%corner == 1)
      kj = edge_between(mesh, j, r, d)
      if (no_split_node(r) .and. no_split_node(d)) return
      m = 0.5_wp*(mesh%x(:, b) + mesh%x(:, c))
      n = 0.5_wp*(mesh%x(:, r) + mesh%x(:, d))
      fits = good_pair(mesh%x(:, node), mesh%x(:, b), mesh%x(:, c), m, limits) .and. &
             good(n, mesh%x(:, d), mesh%x(:, s), limits) .and. good(mesh%x(:, r), n, m, limits) .and. &
             good(m, n, mesh%x(:, s), limits)
      level = 0
      level(:2) = [int(mesh%split_level(i)) + 1, int(mesh%split_level(j)) + 2]
      p = mesh%neighbour(kj, j)
      if (p > 0) then
         kp = mesh%edge_index(p, j)
         level(3) = mesh%split_level(p) + 1
         e = opposite(mesh, p, j)
         fits = fits .and. .not. no_split_element(p) .and. p /= i .and. &
                good_pair(mesh%x(:, e), mesh%x(:, r), mesh%x(:, d), n, limits)
         split%second_corner = 0
         if (mesh%segment_at(kp, p) == 0) then      ! else the crack ends at the one it meets
            split%second_corner = merge(1, 2, (cross(split%direction, mesh%x(:, e) - n) < 0) .eqv. &
                                        (cross(split%direction, mesh%x(:, r) - n) > 0))
            o = merge(r, d, split%second_corner == 1)
            w = 0.5_wp*(mesh%x(:, o) + mesh%x(:, e))
            level(3) = level(3) + 1
            fits = fits .and. e /= node .and. .not. (no_split_node(o) .and. no_split_node(e)) .and. &
                   good(n, mesh%x(:, o), w, limits) .and. good(n, w, mesh%x(:, e), limits)
            q = mesh%neighbour(edge_between(mesh, p, o, e), p)
            if (q > 0) then
               level(4) = mesh%split_level(q) + 1
               fits = fits .and. q /= i .and. q /= j .and. .not. no_split_element(q)
               x(:, 1) = mesh%x(:, opposite(mesh, q, p))
               fits = fits .and. good_pair(x(:, 1), mesh%x(:, o), mesh%x(:, e), w, limits)
               if (mesh%segment_at(edge_between(mesh, p, o, e), p) == 0) &
                  fits = fits .and. .not. no_split_node(opposite(mesh, q, p)) .and. opposite(mesh, q, p) /= node
            end if
         end if
      end if
      fits = fits .and. all(level <= limits%max_level)
   end function fits_three

   !> The corner of an element that is not on the edge to a neighbour.
   pure integer function opposite(mesh, element, neighbour)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, neighbour
      opposite = mesh%connectivity(previous_corner(mesh%edge_index(element, neighbour)), element)
   end function opposite

   !> Number of the edge of an element between two of its nodes.
   pure integer function edge_between(mesh, element, a, b) result(k)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, a, b
      k = corner_of(mesh, element, a)
      if (mesh%connectivity(next_corner(k), element) /= b) k = corner_of(mesh, element, b)
   end function edge_between

   !> Whether an edge may get a midpoint: levels, regions that never break, angles of the children.
   logical function may_bisect(mesh, element, edge, limits, no_split_node, no_split_element) result(may)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, edge
      type(split_limits_t), intent(in) :: limits
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      integer :: a, b, other
      a = mesh%connectivity(edge, element)
      b = mesh%connectivity(next_corner(edge), element)
      may = may_cut(element) .and. .not. (no_split_node(a) .and. no_split_node(b))
      other = mesh%neighbour(edge, element)
      if (may .and. other > 0) may = may_cut(other)

   contains

      logical function may_cut(e)
         integer, intent(in) :: e
         integer :: far
         may_cut = mesh%split_level(e) < limits%max_level .and. .not. no_split_element(e)
         if (.not. may_cut) return
         far = mesh%connectivity(previous_corner(edge), element)
         if (e /= element) far = opposite(mesh, e, element)
         may_cut = good_pair(mesh%x(:, far), mesh%x(:, a), mesh%x(:, b), 0.5_wp*(mesh%x(:, a) + mesh%x(:, b)), limits)
      end function may_cut

   end function may_bisect

   !> Whether both halves of the triangle (tip, a, b), cut from the tip to m, keep good angles.
   pure logical function good_pair(tip, a, b, m, limits)
      real(wp), intent(in) :: tip(2), a(2), b(2), m(2)
      type(split_limits_t), intent(in) :: limits
      good_pair = good(tip, a, m, limits) .and. good(tip, m, b, limits)
   end function good_pair

   !> Whether all angles of a triangle are at least the smallest allowed.
   pure logical function good(a, b, c, limits)
      real(wp), intent(in) :: a(2), b(2), c(2)
      type(split_limits_t), intent(in) :: limits
      good = angle_at(a, b, c) >= limits%smallest_angle .and. angle_at(b, c, a) >= limits%smallest_angle .and. &
             angle_at(c, a, b) >= limits%smallest_angle
   end function good

   pure real(wp) function angle_at(tip, b, c)
      real(wp), intent(in) :: tip(2), b(2), c(2)
      angle_at = atan2(abs(cross(b - tip, c - tip)), dot_product(b - tip, c - tip))
   end function angle_at

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(split_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('node', self%node)
      call archive%exchange('element', self%element)
      call archive%exchange('kind', self%kind)
      call archive%exchange_fixed('direction', self%direction)
      call archive%exchange('s', self%s)
      call archive%exchange('mode', self%mode)
      call archive%exchange('crack', self%crack)
      call archive%exchange('sigma1', self%sigma1)
      call archive%exchange('sigma3', self%sigma3)
      call archive%exchange('utilisation', self%utilisation)
      call archive%exchange('corner', self%corner)
      call archive%exchange('second_corner', self%second_corner)
   end subroutine exchange

end module rf_ray
