!> Carry out a split: the only place where the mesh grows. Types I, II and III of Qiu & Ding (2007, figs. 4 to 6) are
!> sequences of the three operations of rf_topology; run-through inside (fig. 8) and at the boundary (fig. 9) need nothing
!> more, because every node of the new crack is re-fanned at the end. A crack along an edge of the mesh bisects nothing.
module rf_splitting
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, bisect_edge, crack_edge, refan_node, elements_around, corner_of, next_corner, &
      previous_corner
   use rf_ray, only: split_t, type_one, type_two, type_three, type_edge
   implicit none
   private
   public :: split_mesh

   !> nodes that a crack of one event passes at most: A, M, N, M', Q
   integer, parameter :: longest_path = 5

contains

   !> Split the mesh as planned. The changes list everything that is new.
   subroutine split_mesh(mesh, split, event, changes, keep)
      type(mesh_t), intent(inout) :: mesh
      type(split_t), intent(in) :: split
      !> number of the event
      integer, intent(in) :: event
      type(changes_t), intent(inout) :: changes
      !> the changes join those there are (default: they replace them)
      logical, intent(in), optional :: keep
      integer :: path(longest_path), n, i, copies
      logical :: fresh
      fresh = .true.
      if (present(keep)) fresh = .not. keep
      if (fresh) call changes%clear()
      select case (split%kind)
      case (type_one)
         call cut_type_one(mesh, split, changes, path, n)
      case (type_two)
         call cut_type_two(mesh, split, changes, path, n)
      case (type_three)
         call cut_type_three(mesh, split, changes, path, n)
      case (type_edge)
         call take_edge(mesh, split, path, n)
      case default
         return
      end select
      do i = 1, n - 1
         call crack_between(mesh, path(i), path(i + 1), split, event)
      end do
      do i = 1, n
         call refan_node(mesh, path(i), changes, copies)
      end do
   end subroutine split_mesh

   !> Type I: A - M - D, or A - M where B-C is a boundary or a crack.
   subroutine cut_type_one(mesh, split, changes, path, n)
      type(mesh_t), intent(inout) :: mesh
      type(split_t), intent(in) :: split
      type(changes_t), intent(inout) :: changes
      !> nodes of the crack in order, and their number
      integer, intent(out) :: path(longest_path), n
      integer :: k, far
      logical :: goes_on
      k = next_corner(corner_of(mesh, split%element, split%node))
      far = mesh%neighbour(k, split%element)
      goes_on = far > 0 .and. mesh%segment_at(k, split%element) == 0
      path = 0
      path(1) = split%node
      if (goes_on) path(3) = mesh%connectivity(previous_corner(mesh%edge_index(far, split%element)), far)
      call bisect_edge(mesh, split%element, k, changes, path(2))
      n = merge(3, 2, goes_on)
   end subroutine cut_type_one

   !> Type II: A - M - B along the edge that the ray is close to.
   subroutine cut_type_two(mesh, split, changes, path, n)
      type(mesh_t), intent(inout) :: mesh
      type(split_t), intent(in) :: split
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: path(longest_path), n
      integer :: k
      k = corner_of(mesh, split%element, split%node)
      path = 0
      path(1) = split%node
      if (split%corner == 1) then
         path(3) = mesh%connectivity(next_corner(k), split%element)
      else
         k = previous_corner(k)
         path(3) = mesh%connectivity(k, split%element)
      end if
      call bisect_edge(mesh, split%element, k, changes, path(2))
      n = 3
   end subroutine cut_type_two

   !> Along an edge: A - B.
   subroutine take_edge(mesh, split, path, n)
      type(mesh_t), intent(in) :: mesh
      type(split_t), intent(in) :: split
      integer, intent(out) :: path(longest_path), n
      integer :: k
      k = corner_of(mesh, split%element, split%node)
      path = 0
      path(1) = split%node
      path(2) = mesh%connectivity(merge(next_corner(k), previous_corner(k), split%corner == 1), split%element)
      n = 2
   end subroutine take_edge

   !> Type III: A - M - N - M' - Q; shorter where the boundary or a crack ends it.
   subroutine cut_type_three(mesh, split, changes, path, n)
      type(mesh_t), intent(inout) :: mesh
      type(split_t), intent(in) :: split
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: path(longest_path), n
      integer :: i, j, p, q, k, b, c, d, r, o, e, cracked
      i = split%element
      k = next_corner(corner_of(mesh, i, split%node))
      b = mesh%connectivity(k, i)
      c = mesh%connectivity(next_corner(k), i)
      j = mesh%neighbour(k, i)
      d = far_corner(mesh, j, b, c)
      r = merge(b, c, split%corner == 1)
      call find_edge(mesh, j, r, d, k)
      p = mesh%neighbour(k, j)
      cracked = mesh%segment_at(k, j)
      e = 0
      if (p > 0 .and. cracked == 0) e = far_corner(mesh, p, r, d)
      path = 0
      path(1) = split%node
      call bisect_edge(mesh, j, k, changes, path(3))
      call bisect_between(mesh, b, c, changes, path(2))
      n = 3
      if (e == 0) return
      o = merge(r, d, split%second_corner == 1)
      call locate_edge(mesh, o, e, path(3), p, k)       ! p's child that has N and the edge O-E
      q = mesh%neighbour(k, p)
      if (mesh%segment_at(k, p) > 0) q = 0
      if (q > 0) path(5) = far_corner(mesh, q, o, e)
      call bisect_edge(mesh, p, k, changes, path(4))
      n = merge(5, 4, q > 0)
   end subroutine cut_type_three

   !> The corner of an element that is neither of two others.
   pure integer function far_corner(mesh, element, a, b) result(far)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, a, b
      integer :: k
      far = 0
      do k = 1, 3
         if (mesh%connectivity(k, element) /= a .and. mesh%connectivity(k, element) /= b) far = mesh%connectivity(k, element)
      end do
   end function far_corner

   !> Number of the edge between two nodes of an element.
   pure subroutine find_edge(mesh, element, a, b, edge)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element, a, b
      integer, intent(out) :: edge
      edge = corner_of(mesh, element, a)
      if (mesh%connectivity(next_corner(edge), element) /= b) edge = corner_of(mesh, element, b)
   end subroutine find_edge

   !> The element that has nodes a, b and the third one (0: any), and the number of its edge a-b.
   subroutine locate_edge(mesh, a, b, third, element, edge)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: a, b, third
      !> 0 where there is none
      integer, intent(out) :: element, edge
      integer, allocatable :: around(:)
      integer :: n, i
      element = 0
      edge = 0
      call elements_around(mesh, a, around, n)
      do i = 1, n
         if (corner_of(mesh, around(i), b) == 0) cycle
         if (third > 0) then
            if (corner_of(mesh, around(i), third) == 0) cycle
         end if
         element = around(i)
         call find_edge(mesh, element, a, b, edge)
         return
      end do
   end subroutine locate_edge

   subroutine bisect_between(mesh, a, b, changes, midpoint)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: a, b
      type(changes_t), intent(inout) :: changes
      integer, intent(out) :: midpoint
      integer :: element, edge
      call locate_edge(mesh, a, b, 0, element, edge)
      call bisect_edge(mesh, element, edge, changes, midpoint)
   end subroutine bisect_between

   !> Flag the edge between two nodes as cracked.
   subroutine crack_between(mesh, a, b, split, event)
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: a, b, event
      type(split_t), intent(in) :: split
      integer :: element, edge, before
      real(wp) :: along(2)
      call locate_edge(mesh, a, b, 0, element, edge)
      before = mesh%n_segments
      call crack_edge(mesh, element, edge, split%mode, event, split%crack)
      along = mesh%x(:, b) - mesh%x(:, a)
      if (mesh%n_segments > before) mesh%segment_straight(mesh%n_segments) = abs(dot_product(along, split%direction))/norm2(along)
   end subroutine crack_between

end module rf_splitting
