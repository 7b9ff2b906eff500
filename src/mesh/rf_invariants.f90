!> What must hold for every mesh after every event, whatever was split and where: tests and debug builds ask here.
!>
!> Nothing is taken from the walks round nodes that splitting itself uses (rf_topology): fans, pieces and the table of
!> edges are found anew, by joining corners across intact edges and by sorting edges.
module rf_invariants
   use rf_disjoint, only: unite
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_t
   use rf_text, only: to_text
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t, no_origin
   use rf_topology, only: changes_t, next_corner
   implicit none
   private
   public :: baseline_t, take_baseline, check_invariants

   !> areas and lengths of sums over the body agree within this part of the sum
   real(wp), parameter :: sum_tolerance = 1.0e-11_wp

   !> What no split may change.
   type :: baseline_t
      !> area [length^2] and length of the boundary, cracks left out [length]
      real(wp) :: area = 0, perimeter = 0
      !> Euler characteristic of the body with its cracks closed
      integer :: euler = 0
      !> nodes and elements, and ids given, before the first split
      integer :: n_nodes = 0, n_elements = 0, last_node_id = 0, last_element_id = 0
   contains
      procedure :: exchange
   end type baseline_t

   !> Parts of the body as joined corners: corner k of element e is number 3 (e - 1) + k.
   type :: joined_t
      !> a corner of the same fan, through intact edges; of the same point, through cracked ones too, (3 elements)
      integer, allocatable :: fan(:), point(:)
      !> an element of the same piece, (elements)
      integer, allocatable :: piece(:)
   end type joined_t

contains

   !> Remember what no split may change.
   subroutine take_baseline(mesh, baseline)
      !> the body before its first split
      type(mesh_t), intent(in) :: mesh
      type(baseline_t), intent(out) :: baseline
      type(joined_t) :: joined
      call measure(mesh, baseline%area, baseline%perimeter)
      call join(mesh, joined)
      baseline%euler = closed_euler(mesh, joined)
      baseline%n_nodes = mesh%n_nodes
      baseline%n_elements = mesh%n_elements
      baseline%last_node_id = mesh%last_node_id
      baseline%last_element_id = mesh%last_element_id
   end subroutine take_baseline

   !> Check everything; the first thing found wrong is told.
   subroutine check_invariants(mesh, baseline, problem, changes)
      type(mesh_t), intent(in) :: mesh
      type(baseline_t), intent(in) :: baseline
      !> what is wrong and where, in internal numbers; empty if nothing is
      character(len=:), allocatable, intent(out) :: problem
      !> what the last split changed
      type(changes_t), intent(in), optional :: changes
      type(joined_t) :: joined
      problem = ''
      call check_elements(mesh, baseline, problem)
      if (len(problem) == 0) call check_edges(mesh, problem)
      if (len(problem) == 0) call check_table(mesh, problem)
      if (len(problem) == 0) call check_segments(mesh, problem)
      if (len(problem) == 0) call check_numbers(mesh, baseline, problem)
      if (len(problem) == 0) call check_shares(mesh, problem)
      if (len(problem) > 0) return
      call join(mesh, joined)
      call check_fans(mesh, joined, problem)
      if (len(problem) == 0) call check_euler(mesh, baseline, joined, problem)
      if (len(problem) == 0 .and. present(changes)) call check_births(mesh, changes, problem)
   end subroutine check_invariants

   !> Area, and length of the edges that have no neighbour.
   subroutine measure(mesh, area, perimeter)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(out) :: area, perimeter
      integer :: e, k
      area = 0
      perimeter = 0
      do e = 1, mesh%n_elements
         area = area + mesh%area(e)
         do k = 1, 3
            if (mesh%neighbour(k, e) /= 0) cycle
            perimeter = perimeter + norm2(mesh%x(:, mesh%connectivity(next_corner(k), e)) - mesh%x(:, mesh%connectivity(k, e)))
         end do
      end do
   end subroutine measure

   !> Every element has three nodes and a positive area; none of the body is lost.
   subroutine check_elements(mesh, baseline, problem)
      type(mesh_t), intent(in) :: mesh
      type(baseline_t), intent(in) :: baseline
      character(len=:), allocatable, intent(inout) :: problem
      integer :: e
      real(wp) :: area, perimeter
      do e = 1, mesh%n_elements
         if (any(mesh%connectivity(:, e) < 1 .or. mesh%connectivity(:, e) > mesh%n_nodes)) then
            problem = 'element '//to_text(e)//' has a node that is none'
         else if (.not. mesh%area(e) > 0) then
            problem = 'element '//to_text(e)//' has the area '//to_text(mesh%area(e))
         else if (any(mesh%neighbour(:, e) < 0 .or. mesh%neighbour(:, e) > mesh%n_elements .or. mesh%neighbour(:, e) == e)) then
            problem = 'element '//to_text(e)//' has a neighbour that is none'
         end if
         if (len(problem) > 0) return
      end do
      call measure(mesh, area, perimeter)
      if (.not. abs(area - baseline%area) <= sum_tolerance*baseline%area) &
         problem = 'area '//to_text(area)//', was '//to_text(baseline%area)
      if (.not. abs(perimeter - baseline%perimeter) <= sum_tolerance*baseline%perimeter) &
         problem = 'boundary of length '//to_text(perimeter)//', was '//to_text(baseline%perimeter)
   end subroutine check_elements

   !> Edge by edge: neighbours name each other, intact edges share both nodes, cracked ones coincide.
   subroutine check_edges(mesh, problem)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(inout) :: problem
      integer :: e, k, other, back, s, mine(2), theirs(2)
      do e = 1, mesh%n_elements
         do k = 1, 3
            other = mesh%neighbour(k, e)
            s = mesh%segment_at(k, e)
            if (other == 0) then
               if (s /= 0) problem = 'a crack segment on the boundary'
            else if (count(mesh%neighbour(:, other) == e) /= 1) then
               problem = 'its neighbour '//to_text(other)//' does not name it once'
            else
               back = mesh%edge_index(other, e)
               mine = mesh%connectivity([k, next_corner(k)], e)
               theirs = mesh%connectivity([next_corner(back), back], other)
               if (mesh%tag_at(k, e) > 0) problem = 'a waking face tag inside the body'
               if (mesh%segment_at(back, other) /= s) problem = 'another segment than its neighbour '//to_text(other)
               if (s < 0 .or. s > mesh%n_segments) problem = 'a segment that is none'
               if (s == 0 .and. any(mine /= theirs)) problem = 'an intact edge with other nodes than '//to_text(other)
               if (any(abs(mesh%x(:, mine) - mesh%x(:, theirs)) > 0)) problem = 'its ends are not those of '//to_text(other)
            end if
            if (len(problem) == 0) cycle
            problem = 'element '//to_text(e)//', edge '//to_text(k)//': '//problem
            return
         end do
      end do
   end subroutine check_edges

   !> The table of neighbours against one made from scratch: edges with the same two nodes, found by sorting.
   subroutine check_table(mesh, problem)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(inout) :: problem
      integer(i8), allocatable :: key(:)
      integer, allocatable :: order(:)
      integer :: e, k, i, first, n, corner(2)
      n = 3*mesh%n_elements
      allocate (key(n))
      do e = 1, mesh%n_elements
         do k = 1, 3
            associate (a => mesh%connectivity(k, e), b => mesh%connectivity(next_corner(k), e))
               key(3*(e - 1) + k) = int(min(a, b), i8)*2_i8**32 + int(max(a, b), i8)
            end associate
         end do
      end do
      allocate (order, source=sorted_order(key))
      first = 1
      do i = 2, n + 1
         if (i <= n) then
            if (key(order(i)) == key(order(first))) cycle
         end if
         corner = order([first, i - 1])
         e = (corner(1) - 1)/3 + 1
         k = corner(1) - 3*(e - 1)
         if (i - first > 2) then
            problem = 'element '//to_text(e)//', edge '//to_text(k)//' is the edge of '//to_text(i - first)//' elements'
         else if (i - first == 2 .and. mesh%neighbour(k, e) /= (corner(2) - 1)/3 + 1) then
            problem = 'element '//to_text(e)//', edge '//to_text(k)//' lacks its neighbour '//to_text((corner(2) - 1)/3 + 1)
         else if (i - first == 1 .and. mesh%neighbour(k, e) /= 0 .and. mesh%segment_at(k, e) == 0) then
            problem = 'element '//to_text(e)//', edge '//to_text(k)//' is intact but has one side only'
         end if
         if (len(problem) > 0) return
         first = i
      end do
   end subroutine check_table

   !> Every segment is one edge of two elements, which name it.
   subroutine check_segments(mesh, problem)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(inout) :: problem
      integer :: s, e(2), n
      n = 0
      if (allocated(mesh%segment)) n = count(mesh%segment(:, :mesh%n_elements) > 0)
      if (n /= 2*mesh%n_segments) problem = to_text(mesh%n_segments)//' segments on '//to_text(n)//' edges'
      do s = 1, mesh%n_segments
         if (len(problem) > 0) return
         e = mesh%segment_element(:, s)
         if (any(e < 1 .or. e > mesh%n_elements) .or. e(1) == e(2)) then
            problem = 'segment '//to_text(s)//' has no two elements'
         else if (count(mesh%segments_of(e(1)) == s) /= 1 .or. count(mesh%segments_of(e(2)) == s) /= 1) then
            problem = 'segment '//to_text(s)//': its elements do not name it once'
         else if (.not. any(mesh%segments_of(e(1)) == s .and. mesh%neighbour(:, e(1)) == e(2))) then
            problem = 'segment '//to_text(s)//' is not between its elements'
         else if ((mesh%segment_mode(s) == 0) .neqv. (mesh%segment_event(s) == 0)) then
            problem = 'segment '//to_text(s)//' has mode '//to_text(int(mesh%segment_mode(s)))//' and event '// &
               to_text(mesh%segment_event(s))
         else if (mesh%segment_mode(s) < 0 .or. mesh%segment_mode(s) > 2 .or. mesh%segment_event(s) < 0) then
            problem = 'segment '//to_text(s)//' has no mode or event'
         else if (mesh%segment_crack(s) < 0 .or. (mesh%segment_crack(s) > 0 .and. mesh%segment_event(s) > 0)) then
            problem = 'segment '//to_text(s)//' of event '//to_text(mesh%segment_event(s))//' belongs to crack '// &
               to_text(mesh%segment_crack(s))
         end if
      end do
   end subroutine check_segments

   !> Ids are unique and count on from those of the deck; ranks are a permutation; element_of has the node.
   subroutine check_numbers(mesh, baseline, problem)
      type(mesh_t), intent(in) :: mesh
      type(baseline_t), intent(in) :: baseline
      character(len=:), allocatable, intent(inout) :: problem
      integer :: n, e
      call check_list('node', mesh%node_id(:mesh%n_nodes), mesh%node_rank(:mesh%n_nodes), &
                      max(mesh%n_numbered_nodes, baseline%n_nodes), baseline%n_nodes, baseline%last_node_id, &
                      mesh%last_node_id, problem)
      call check_list('element', mesh%element_id(:mesh%n_elements), mesh%element_rank(:mesh%n_elements), &
                      max(mesh%n_numbered_elements, baseline%n_elements), baseline%n_elements, baseline%last_element_id, &
                      mesh%last_element_id, problem)
      do n = 1, mesh%n_nodes
         if (len(problem) > 0) return
         e = mesh%element_of(n)
         if (e < 1 .or. e > mesh%n_elements) then
            problem = 'node '//to_text(n)//' has no element'
         else if (all(mesh%connectivity(:, e) /= n)) then
            problem = 'node '//to_text(n)//' is not on its element '//to_text(e)
         end if
      end do
   end subroutine check_numbers

   !> Ids and ranks of nodes or elements.
   subroutine check_list(what, id, rank, n_ordered, n_before, last_before, last, problem)
      !> node or element
      character(len=*), intent(in) :: what
      !> ids and ranks of all of them
      integer, intent(in) :: id(:), rank(:)
      !> how many may lie in another order than that of their ids (the first ones), and there were before the first split; the
      !> largest id then, and now
      integer, intent(in) :: n_ordered, n_before, last_before, last
      character(len=:), allocatable, intent(inout) :: problem
      integer, allocatable :: order(:)
      integer :: i
      allocate (order, source=sorted_order(int(id, i8)))
      do i = 2, size(id)
         if (id(order(i)) == id(order(i - 1))) problem = 'two '//what//'s with the id '//to_text(id(order(i)))
      end do
      do i = n_ordered + 1, size(id)
         if (id(i) /= last_before + i - n_before) problem = what//' '//to_text(i)//' has the id '//to_text(id(i))
         if (rank(i) /= i) problem = what//' '//to_text(i)//' has the rank '//to_text(rank(i))
      end do
      if (last /= last_before + size(id) - n_before) problem = 'last '//what//' id is '//to_text(last)
      order = sorted_order(int(rank(:n_ordered), i8))
      do i = 1, n_ordered
         if (rank(order(i)) /= i) problem = what//' ranks are no permutation'
      end do
   end subroutine check_list

   !> Copies of a deck node share it; midpoints have no share.
   subroutine check_shares(mesh, problem)
      type(mesh_t), intent(in) :: mesh
      character(len=:), allocatable, intent(inout) :: problem
      integer, allocatable :: order(:)
      integer :: i, n
      real(wp) :: total
      allocate (order, source=sorted_order(int(mesh%node_origins(), i8)))
      total = 0
      do i = 1, mesh%n_nodes
         n = order(i)
         if (mesh%origin_of_node(n) == no_origin) then
            if (abs(mesh%share_of(n)) > 0) problem = 'node '//to_text(n)//' is no copy of a deck node and has a share'
            cycle
         end if
         total = total + mesh%share_of(n)
         if (i < mesh%n_nodes) then
            if (mesh%origin_of_node(order(i + 1)) == mesh%origin_of_node(n)) cycle
         end if
         if (abs(total - 1) > sum_tolerance) &
            problem = 'shares of deck node '//to_text(mesh%origin_of_node(n))//' sum to '//to_text(total)
         total = 0
      end do
   end subroutine check_shares

   !> Join the corners of each fan, of each point, and the elements of each piece.
   subroutine join(mesh, joined)
      type(mesh_t), intent(in) :: mesh
      type(joined_t), intent(out) :: joined
      integer :: e, k, other, back, i, mine(2), theirs(2)
      joined%fan = [(i, i=1, 3*mesh%n_elements)]
      joined%point = joined%fan
      joined%piece = [(i, i=1, mesh%n_elements)]
      do e = 1, mesh%n_elements
         do k = 1, 3
            other = mesh%neighbour(k, e)
            if (other < e) cycle
            back = mesh%edge_index(other, e)
            mine = 3*(e - 1) + [k, next_corner(k)]
            theirs = 3*(other - 1) + [next_corner(back), back]
            do i = 1, 2
               call unite(joined%point, mine(i), theirs(i))
               if (mesh%segment_at(k, e) == 0) call unite(joined%fan, mine(i), theirs(i))
            end do
            if (mesh%segment_at(k, e) == 0) call unite(joined%piece, e, other)
         end do
      end do
      do i = 1, 3*mesh%n_elements      ! a root is the least of its set, so each is final when it is met
         joined%fan(i) = joined%fan(joined%fan(i))
         joined%point(i) = joined%point(joined%point(i))
      end do
      do e = 1, mesh%n_elements
         joined%piece(e) = joined%piece(joined%piece(e))
      end do
   end subroutine join

   !> Sets that were joined.
   pure integer function sets(root)
      integer, intent(in) :: root(:)
      integer :: i
      sets = 0
      do i = 1, size(root)
         if (root(i) == i) sets = sets + 1
      end do
   end function sets

   !> Copies are fans: every node has one, but for hinges, which have one at least.
   subroutine check_fans(mesh, joined, problem)
      type(mesh_t), intent(in) :: mesh
      type(joined_t), intent(in) :: joined
      character(len=:), allocatable, intent(inout) :: problem
      integer, allocatable :: fans(:)
      integer :: i, n
      allocate (fans(mesh%n_nodes), source=0)
      do i = 1, size(joined%fan)
         if (joined%fan(i) /= i) cycle
         n = node_of(mesh, i)
         fans(n) = fans(n) + 1
      end do
      do n = 1, mesh%n_nodes
         if (fans(n) == 0) problem = 'node '//to_text(n)//' is on no element'
         if (fans(n) > 1 .and. .not. mesh%hinge(n)) problem = 'node '//to_text(n)//' has '//to_text(fans(n))//' fans'
         if (len(problem) > 0) return
      end do
   end subroutine check_fans

   !> The node at a corner.
   pure integer function node_of(mesh, corner)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: corner
      node_of = mesh%connectivity(mod(corner - 1, 3) + 1, (corner - 1)/3 + 1)
   end function node_of

   !> Points less edges plus elements of the body with its cracks closed.
   integer function closed_euler(mesh, joined) result(euler)
      type(mesh_t), intent(in) :: mesh
      type(joined_t), intent(in) :: joined
      integer :: edges
      edges = (3*mesh%n_elements + count(mesh%neighbour(:, :mesh%n_elements) == 0))/2
      euler = sets(joined%point) - edges + mesh%n_elements
   end function closed_euler

   !> The closed body is what it was; the cracked one obeys Euler's formula: fans - edges + elements =
   !> 2 pieces - rims, where rims are the closed lines of boundary and crack faces.
   subroutine check_euler(mesh, baseline, joined, problem)
      type(mesh_t), intent(in) :: mesh
      type(baseline_t), intent(in) :: baseline
      type(joined_t), intent(in) :: joined
      character(len=:), allocatable, intent(inout) :: problem
      logical, allocatable :: rim(:)
      integer :: edges, euler, pieces, rims
      euler = closed_euler(mesh, joined)
      if (euler /= baseline%euler) &
         problem = 'Euler characteristic of the closed body '//to_text(euler)//', was '//to_text(baseline%euler)
      if (len(problem) > 0) return
      call find_rims(mesh, joined, rim)
      edges = (3*mesh%n_elements + count(rim))/2
      euler = sets(joined%fan) - edges + mesh%n_elements
      pieces = sets(joined%piece)
      rims = count_rims(mesh, rim)
      if (euler /= 2*pieces - rims) problem = 'Euler characteristic '//to_text(euler)//' with '//to_text(pieces)// &
         ' pieces and '//to_text(rims)//' rims'
   end subroutine check_euler

   !> Which edges are boundary or a face of an opened crack; one that is cracked between two tips has not opened.
   subroutine find_rims(mesh, joined, rim)
      type(mesh_t), intent(in) :: mesh
      type(joined_t), intent(in) :: joined
      !> edge k of element e is number 3 (e - 1) + k
      logical, allocatable, intent(out) :: rim(:)
      integer :: e, k, other, back
      allocate (rim(3*mesh%n_elements), source=.false.)
      do e = 1, mesh%n_elements
         do k = 1, 3
            other = mesh%neighbour(k, e)
            rim(3*(e - 1) + k) = other == 0
            if (mesh%segment_at(k, e) == 0) cycle
            back = mesh%edge_index(other, e)
            rim(3*(e - 1) + k) = joined%fan(3*(e - 1) + k) /= joined%fan(3*(other - 1) + next_corner(back)) .or. &
               joined%fan(3*(e - 1) + next_corner(k)) /= joined%fan(3*(other - 1) + back)
         end do
      end do
   end subroutine find_rims

   !> Closed lines that the rim edges form: from each on to the next one round its second node.
   integer function count_rims(mesh, rim) result(rims)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: rim(:)
      logical, allocatable :: seen(:)
      integer :: start, edge, e, k, other
      allocate (seen(size(rim)), source=.false.)
      rims = 0
      do start = 1, size(rim)
         if (.not. rim(start) .or. seen(start)) cycle
         rims = rims + 1
         edge = start
         do while (.not. seen(edge))
            seen(edge) = .true.
            do
               e = (edge - 1)/3 + 1
               k = next_corner(edge - 3*(e - 1))
               edge = 3*(e - 1) + k
               if (rim(edge)) exit
               other = mesh%neighbour(k, e)
               edge = 3*(other - 1) + mesh%edge_index(other, e)
            end do
         end do
      end do
   end function count_rims

   !> New nodes lie where they come from.
   subroutine check_births(mesh, changes, problem)
      type(mesh_t), intent(in) :: mesh
      type(changes_t), intent(in) :: changes
      character(len=:), allocatable, intent(inout) :: problem
      integer :: i, n, a, b
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         if (any(abs(mesh%x(:, n) - 0.5_wp*(mesh%x(:, a) + mesh%x(:, b))) > 0)) &
            problem = 'new node '//to_text(n)//' is not where its parents are'
         if (n /= mesh%n_nodes - changes%n_nodes + i) problem = 'new node '//to_text(n)//' is out of order'
      end do
      do i = 1, changes%n_children
         if (mesh%section(changes%child(1, i)) /= mesh%section(changes%child(2, i)) .or. &
             mesh%origin_of_element(changes%child(1, i)) /= mesh%origin_of_element(changes%child(2, i))) &
            problem = 'new element '//to_text(changes%child(1, i))//' is not like its parent'
      end do
      do i = 1, changes%n_elements
         if (count(changes%element(:changes%n_elements) == changes%element(i)) /= 1) &
            problem = 'element '//to_text(changes%element(i))//' is listed twice among the changes'
      end do
   end subroutine check_births

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(baseline_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('area', self%area)
      call archive%exchange('perimeter', self%perimeter)
      call archive%exchange('euler', self%euler)
      call archive%exchange('n_nodes', self%n_nodes)
      call archive%exchange('n_elements', self%n_elements)
      call archive%exchange('last_node_id', self%last_node_id)
      call archive%exchange('last_element_id', self%last_element_id)
   end subroutine exchange

end module rf_invariants
