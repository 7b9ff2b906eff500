!> Cracks along edges of the mesh that lie on a line: the edges are flagged, then all nodes on them are re-fanned
!> (operations 2 and 3 of rf_topology).
module rf_crack_line
   use rf_kinds, only: wp, i1, i8
   use rf_grow, only: grow
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, crack_edge, refan_node, next_corner
   implicit none
   private
   public :: line_margin, flag_edges, open_cracks, clip_to_element, parts_inside, is_beside

   !> places closer than this part of the model's size are the same (deck.md's margin for geometric sets)
   real(wp), parameter :: line_margin = 1.0e-6_wp
   !> a line that passes a node within the margin may touch an element over this many margins
   real(wp), parameter :: grazing = 10.0_wp
   !> segments that are there from the start
   integer(i1), parameter :: pre_existing = 0_i1

contains

   !> Flag the edges that lie on a straight line as cracked. What of the line lies in the body must run along edges.
   subroutine flag_edges(mesh, from, to, crack, n_flagged, left, gap)
      type(mesh_t), intent(inout) :: mesh
      !> ends of the line [length]
      real(wp), intent(in) :: from(2), to(2)
      !> number of the crack
      integer, intent(in) :: crack
      !> edges flagged, or flagged before
      integer, intent(out) :: n_flagged
      !> the line leaves the edges inside the body: nothing is flagged
      logical, intent(out) :: left
      !> where the first part without edges begins and ends [length], (2, 2)
      real(wp), intent(out) :: gap(2, 2)
      real(wp), allocatable :: place(:), covered(:, :)
      logical, allocatable :: on(:)
      real(wp) :: along(2), margin, ends(2), missing(2)
      integer :: e, k, n, n_covered, pass

      margin = line_margin*mesh%size
      along = (to - from)/norm2(to - from)
      allocate (on(mesh%n_nodes), place(mesh%n_nodes), covered(2, 3*mesh%n_elements))
      do n = 1, mesh%n_nodes
         place(n) = dot_product(mesh%x(:, n) - from, along)
         on(n) = abs(along(1)*(mesh%x(2, n) - from(2)) - along(2)*(mesh%x(1, n) - from(1))) <= margin .and. &
                 place(n) >= -margin .and. place(n) <= norm2(to - from) + margin
      end do
      n_flagged = 0
      n_covered = 0
      left = .false.
      gap = 0
      do pass = 1, 2
         do e = 1, mesh%n_elements
            do k = 1, 3
               associate (a => mesh%connectivity(k, e), b => mesh%connectivity(next_corner(k), e))
                  if (.not. (on(a) .and. on(b))) cycle
                  ends = [min(place(a), place(b)), max(place(a), place(b))]
               end associate
               if (pass == 1) then
                  n_covered = n_covered + 1
                  covered(:, n_covered) = ends
               else if (mesh%neighbour(k, e) > e) then
                  n_flagged = n_flagged + 1
                  call crack_edge(mesh, e, k, pre_existing, 0, crack)
               end if
            end do
         end do
         if (pass == 2) exit
         call find_gap(mesh, from, to, covered(:, :n_covered), grazing*margin, left, missing)
         gap(:, 1) = from + missing(1)*along
         gap(:, 2) = from + missing(2)*along
         if (left) exit
      end do
   end subroutine flag_edges

   !> The first part of a line that lies in the body and not on edges.
   subroutine find_gap(mesh, from, to, covered, margin, found, gap)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: from(2), to(2)
      !> parts of the line that edges lie on, from its start [length], (2, edges)
      real(wp), intent(in) :: covered(:, :)
      !> shorter gaps are none [length]
      real(wp), intent(in) :: margin
      logical, intent(out) :: found
      !> [length] from the start
      real(wp), intent(out) :: gap(2)
      real(wp), allocatable :: joined(:, :), gaps(:, :)
      real(wp) :: inside(2), at
      integer :: e, i, n
      logical :: meets
      call join_intervals(covered, joined)
      allocate (gaps(2, 0))
      n = 0
      do e = 1, mesh%n_elements
         if (is_beside(mesh, e, min(from, to), max(from, to))) cycle
         call clip_to_element(mesh, e, from, to, meets, inside)
         if (.not. meets) cycle
         at = inside(1)
         do i = 1, size(joined, 2) + 1
            if (i <= size(joined, 2)) then
               if (joined(2, i) <= at) cycle
               if (joined(1, i) > at + margin .and. inside(2) > at + margin) call note_gap(at, min(joined(1, i), inside(2)))
               at = max(at, joined(2, i))
            else if (inside(2) > at + margin) then
               call note_gap(at, inside(2))
            end if
         end do
      end do
      found = n > 0
      gap = 0
      if (.not. found) return
      call join_intervals(gaps(:, :n), joined)
      gap = joined(:, 1)

   contains

      subroutine note_gap(first, last)
         real(wp), intent(in) :: first, last
         n = n + 1
         call grow(gaps, n)
         gaps(:, n) = [first, last]
      end subroutine note_gap

   end subroutine find_gap

   !> The parts of a straight line that lie in the body, one after the other.
   subroutine parts_inside(mesh, from, to, parts)
      type(mesh_t), intent(in) :: mesh
      !> ends of the line [length]
      real(wp), intent(in) :: from(2), to(2)
      !> start and end of each part [length], measured from the start of the line, (2, parts)
      real(wp), allocatable, intent(out) :: parts(:, :)
      real(wp), allocatable :: joined(:, :), inside(:, :)
      real(wp) :: reach(2)
      integer :: e, i, n
      logical :: meets
      allocate (inside(2, 0))
      n = 0
      do e = 1, mesh%n_elements
         if (is_beside(mesh, e, min(from, to), max(from, to))) cycle
         call clip_to_element(mesh, e, from, to, meets, reach)
         if (.not. meets) cycle
         n = n + 1
         call grow(inside, n)
         inside(:, n) = reach
      end do
      call join_intervals(inside(:, :n), joined)
      parts = joined(:, pack([(i, i=1, size(joined, 2))], joined(2, :) - joined(1, :) > grazing*line_margin*mesh%size))
   end subroutine parts_inside

   !> Intervals in ascending order, those that touch made one.
   subroutine join_intervals(intervals, joined)
      !> (2, n)
      real(wp), intent(in) :: intervals(:, :)
      real(wp), allocatable, intent(out) :: joined(:, :)
      integer, allocatable :: order(:)
      real(wp) :: low, high, widest
      integer :: i, n
      allocate (joined(2, size(intervals, 2)))
      n = 0
      if (size(intervals) > 0) then
         low = minval(intervals)
         high = maxval(intervals)
         widest = max(high - low, tiny(1.0_wp))
         ! sorted by their starts; starts that fall together there are parts of 1e-15 apart
         allocate (order, source=sorted_order(int((intervals(1, :) - low)/widest*1.0e15_wp, i8)))
         do i = 1, size(order)
            associate (interval => intervals(:, order(i)))
               if (n > 0) then
                  if (interval(1) <= joined(2, n) + line_margin*widest) then
                     joined(2, n) = max(joined(2, n), interval(2))
                     cycle
                  end if
               end if
               n = n + 1
               joined(:, n) = interval
            end associate
         end do
      end if
      joined = joined(:, :n)
   end subroutine join_intervals

   !> Whether an element lies beside a box: a quick answer that spares a closer look at most elements.
   pure logical function is_beside(mesh, element, low, high)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      !> corners of the box [length]
      real(wp), intent(in) :: low(2), high(2)
      integer :: i
      is_beside = .false.
      associate (a => mesh%connectivity(1, element), b => mesh%connectivity(2, element), c => mesh%connectivity(3, element))
         do i = 1, 2
            is_beside = is_beside .or. min(mesh%x(i, a), mesh%x(i, b), mesh%x(i, c)) > high(i) &
                        .or. max(mesh%x(i, a), mesh%x(i, b), mesh%x(i, c)) < low(i)
         end do
      end associate
   end function is_beside

   !> The part of a straight line that lies in an element.
   pure subroutine clip_to_element(mesh, element, from, to, meets, inside)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp), intent(in) :: from(2), to(2)
      !> there is such a part
      logical, intent(out) :: meets
      !> its start and end [length], measured from the start of the line
      real(wp), intent(out) :: inside(2)
      real(wp) :: along(2), edge(2), start(2), approach, height
      integer :: k
      along = (to - from)/norm2(to - from)
      inside = [0.0_wp, norm2(to - from)]
      meets = .false.
      do k = 1, 3
         start = mesh%x(:, mesh%connectivity(k, element))
         edge = mesh%x(:, mesh%connectivity(next_corner(k), element)) - start
         approach = edge(1)*along(2) - edge(2)*along(1)        ! > 0: towards the inside
         height = edge(1)*(from(2) - start(2)) - edge(2)*(from(1) - start(1))
         if (approach > 0) then
            inside(1) = max(inside(1), -height/approach)
         else if (approach < 0) then
            inside(2) = min(inside(2), -height/approach)
         else if (height < 0) then
            return
         end if
      end do
      meets = inside(2) > inside(1)
   end subroutine clip_to_element

   !> Re-fan all nodes on crack segments, in the order of the output.
   subroutine open_cracks(mesh, changes)
      type(mesh_t), intent(inout) :: mesh
      !> gets the copies
      type(changes_t), intent(inout) :: changes
      logical, allocatable :: on(:)
      integer, allocatable :: node(:)
      integer :: e, k, i, copies
      allocate (on(mesh%n_nodes))
      on = .false.
      do e = 1, mesh%n_elements
         do k = 1, 3
            if (mesh%segment_at(k, e) == 0) cycle
            on(mesh%connectivity(k, e)) = .true.
            on(mesh%connectivity(next_corner(k), e)) = .true.
         end do
      end do
      node = pack([(i, i=1, mesh%n_nodes)], on)
      node = node(sorted_order(int(mesh%node_rank(node), i8)))
      do i = 1, size(node)
         call refan_node(mesh, node(i), changes, copies)
      end do
   end subroutine open_cracks

end module rf_crack_line
