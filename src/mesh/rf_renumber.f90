!> New numbers for nodes, elements and crack segments: what stays keeps its data, what has no new number is gone. Every type
!> that holds something per node or per element has a procedure `renumber` that follows such a map. Here are the map, how
!> arrays follow it, and how the mesh does; on it stand the removal of elements (excavation) and the new order of a mesh
!> that has grown by splitting.
module rf_renumber
   use rf_kinds, only: wp, i1, i8
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t, no_origin
   use rf_numbering, only: identity_order, places_of
   use rf_ordering, only: order_of_nodes, order_of_elements
   use rf_topology, only: changes_t, part_fans, is_one_fan, list_corners
   implicit none
   private
   public :: renumbering_t, carry, plan_removal, plan_order, renumber_mesh, remove_from_mesh

   !> Old numbers to new ones and back.
   type :: renumbering_t
      !> how many stay
      integer :: n_nodes = 0, n_elements = 0, n_segments = 0
      !> how many of them then lie in the order of the mesh's numbering (the first ones; the others were appended since)
      integer :: n_numbered_nodes = 0, n_numbered_elements = 0
      !> new number of each old one, 0: it is gone, (old)
      integer, allocatable :: node(:), element(:), segment(:)
      !> old number of each new one, (new)
      integer, allocatable :: node_from(:), element_from(:), segment_from(:)
      !> new number of what stands for a node or element of the deck: itself, or if it is gone another copy of the node, another
      !> child of the element; 0 if none is left, (old)
      integer, allocatable :: node_deputy(:), element_deputy(:)
   end type renumbering_t

   !> Put the entities of an array (last dimension) into their new order; an array that is not allocated stays so.
   interface carry
      module procedure carry_real_1, carry_real_2, carry_integer_1, carry_integer_2, carry_small_1, carry_small_2, carry_logical_1
   end interface carry

contains

   !> The map that takes elements out, with the nodes that are left on none and the crack segments that lose a side. The order
   !> of the rest does not change.
   subroutine plan_removal(mesh, gone, map)
      type(mesh_t), intent(in) :: mesh
      !> the element goes, (elements)
      logical, intent(in) :: gone(:)
      type(renumbering_t), intent(out) :: map
      logical, allocatable :: node_stays(:), segment_stays(:)
      integer :: e, s
      allocate (node_stays(mesh%n_nodes), segment_stays(mesh%n_segments))
      node_stays = .false.
      do e = 1, mesh%n_elements
         if (.not. gone(e)) node_stays(mesh%connectivity(:, e)) = .true.
      end do
      do s = 1, mesh%n_segments
         segment_stays(s) = .not. any(gone(mesh%segment_element(:, s)))
      end do
      call number(node_stays, map%n_nodes, map%node, map%node_from)
      call number(.not. gone(:mesh%n_elements), map%n_elements, map%element, map%element_from)
      call number(segment_stays, map%n_segments, map%segment, map%segment_from)
      map%n_numbered_nodes = count(map%node_from <= mesh%n_numbered_nodes)
      map%n_numbered_elements = count(map%element_from <= mesh%n_numbered_elements)
      call find_deputies(mesh%node_origins(), mesh%node_rank(:mesh%n_nodes), map%node, map%node_deputy)
      call find_deputies(mesh%element_origins(), mesh%element_rank(:mesh%n_elements), map%element, &
                         map%element_deputy)
   end subroutine plan_removal

   !> The map that puts all nodes and elements into the order of the mesh's numbering, from where they are now: what splitting
   !> has appended comes to stand beside its neighbours.
   subroutine plan_order(mesh, map)
      type(mesh_t), intent(in) :: mesh
      type(renumbering_t), intent(out) :: map
      integer, allocatable :: connectivity(:, :)
      integer :: e
      map%n_nodes = mesh%n_nodes
      map%n_elements = mesh%n_elements
      map%n_segments = mesh%n_segments
      map%n_numbered_nodes = map%n_nodes
      map%n_numbered_elements = map%n_elements
      connectivity = mesh%connectivity(:, :mesh%n_elements)
      map%node_from = order_of_nodes(mesh%ordering, mesh%x(:, :mesh%n_nodes), connectivity)
      map%node = places_of(map%node_from)
      do e = 1, mesh%n_elements
         call translate(connectivity(:, e), map%node)
      end do
      map%element_from = order_of_elements(mesh%ordering, connectivity)
      map%element = places_of(map%element_from)
      map%segment_from = identity_order(mesh%n_segments)
      map%segment = map%segment_from
      map%node_deputy = map%node
      map%element_deputy = map%element
   end subroutine plan_order

   !> Number what stays in its order.
   subroutine number(stays, n, new, from)
      logical, intent(in) :: stays(:)
      integer, intent(out) :: n
      integer, allocatable, intent(out) :: new(:), from(:)
      integer :: i
      allocate (new(size(stays)), from(count(stays)))
      n = 0
      new = 0
      do i = 1, size(stays)
         if (.not. stays(i)) cycle
         n = n + 1
         new(i) = n
         from(n) = i
      end do
   end subroutine number

   !> Who stands for each entity: itself, or of those with the same origin that stay the first in the order of the output.
   subroutine find_deputies(origin, rank, new, deputy)
      integer, intent(in) :: origin(:), rank(:), new(:)
      integer, allocatable, intent(out) :: deputy(:)
      integer, allocatable :: order(:)
      integer :: i, first, last, best
      allocate (deputy, source=new)
      if (all(new > 0)) return
      allocate (order, source=sorted_order(int(origin, i8)))
      first = 1
      do while (first <= size(order))
         best = 0
         do last = first, size(order)
            if (origin(order(last)) /= origin(order(first))) exit
            if (new(order(last)) == 0) cycle
            if (best == 0) best = order(last)
            if (rank(order(last)) < rank(best)) best = order(last)
         end do
         do i = first, last - 1
            if (best > 0 .and. deputy(order(i)) == 0 .and. origin(order(i)) /= no_origin) deputy(order(i)) = new(best)
         end do
         first = last
      end do
   end subroutine find_deputies

   !> The mesh in its new numbers. Ranks stay in their order and without gaps; copies of a deck node that stay share it whole.
   subroutine renumber_mesh(mesh, map)
      type(mesh_t), intent(inout) :: mesh
      type(renumbering_t), intent(in) :: map
      integer :: e
      call carry(mesh%x, map%node_from)
      call carry(mesh%node_id, map%node_from)
      call carry(mesh%node_origin, map%node_from)
      call carry(mesh%node_rank, map%node_from)
      call carry(mesh%share, map%node_from)
      call carry(mesh%hinge, map%node_from)
      call carry(mesh%node_membership, map%node_from)
      call carry(mesh%element_of, map%node_from)
      call carry(mesh%connectivity, map%element_from)
      call carry(mesh%neighbour, map%element_from)
      call carry(mesh%segment, map%element_from)
      call carry(mesh%face_tag, map%element_from)
      call carry(mesh%element_id, map%element_from)
      call carry(mesh%element_origin, map%element_from)
      call carry(mesh%element_rank, map%element_from)
      call carry(mesh%section, map%element_from)
      call carry(mesh%split_level, map%element_from)
      call carry(mesh%element_membership, map%element_from)
      call carry(mesh%segment_element, map%segment_from)
      call carry(mesh%segment_mode, map%segment_from)
      call carry(mesh%segment_event, map%segment_from)
      call carry(mesh%segment_crack, map%segment_from)
      call carry(mesh%segment_straight, map%segment_from)
      mesh%n_nodes = map%n_nodes
      mesh%n_elements = map%n_elements
      mesh%n_segments = map%n_segments
      mesh%n_numbered_nodes = map%n_numbered_nodes
      mesh%n_numbered_elements = map%n_numbered_elements
      call translate(mesh%element_of, map%element)
      do e = 1, mesh%n_elements
         call translate(mesh%connectivity(:, e), map%node)
         call translate(mesh%neighbour(:, e), map%element)
         if (allocated(mesh%segment)) call translate(mesh%segment(:, e), map%segment)
      end do
      do e = 1, mesh%n_segments
         call translate(mesh%segment_element(:, e), map%element)
      end do
      do e = mesh%n_elements, 1, -1
         where (mesh%element_of(mesh%connectivity(:, e)) == 0) mesh%element_of(mesh%connectivity(:, e)) = e
      end do
      call close_gaps(mesh%node_rank)
      call close_gaps(mesh%element_rank)
      if (any(map%node == 0) .and. allocated(mesh%share)) call share_anew(mesh)
   end subroutine renumber_mesh

   !> Numbers become new ones; 0 stays 0.
   pure subroutine translate(numbers, new)
      integer, intent(inout) :: numbers(:)
      integer, intent(in) :: new(:)
      integer :: i
      do i = 1, size(numbers)
         if (numbers(i) > 0) numbers(i) = new(numbers(i))
      end do
   end subroutine translate

   !> Ranks 1 to n in the order of the ranks there are.
   subroutine close_gaps(rank)
      integer, intent(inout) :: rank(:)
      integer, allocatable :: order(:)
      integer :: i
      allocate (order, source=sorted_order(int(rank, i8)))
      do i = 1, size(rank)
         rank (order(i)) = i
      end do
   end subroutine close_gaps

   !> Shares of a deck node's copies sum to 1 again.
   subroutine share_anew(mesh)
      type(mesh_t), intent(inout) :: mesh
      integer, allocatable :: order(:)
      integer :: first, last
      real(wp) :: total
      allocate (order, source=sorted_order(int(mesh%node_origin(:mesh%n_nodes), i8)))
      first = 1
      do while (first <= mesh%n_nodes)
         total = 0
         do last = first, mesh%n_nodes
            if (mesh%node_origin(order(last)) /= mesh%node_origin(order(first))) exit
            total = total + mesh%share(order(last))
         end do
         if (total > 0) mesh%share(order(first:last - 1)) = mesh%share(order(first:last - 1))/total
         first = last
      end do
   end subroutine share_anew

   !> Take elements out of a mesh. Nodes whose remaining elements hang together at a point only, or are now parted by a crack
   !> that ended there, are parted (operation 3; theory: section 7). What was exposed becomes boundary.
   subroutine remove_from_mesh(mesh, gone, map, changes, exposed)
      type(mesh_t), intent(inout) :: mesh
      !> the element goes, (elements)
      logical, intent(in) :: gone(:)
      type(renumbering_t), intent(out) :: map
      !> copies of parted nodes
      type(changes_t), intent(inout) :: changes
      !> nodes that lost elements, or what lay across a crack, in the order of the output; copies come last, in new numbers
      integer, allocatable, intent(out) :: exposed(:)
      integer, allocatable :: order(:), first(:), corner_list(:), around(:)
      integer :: i, n, n_copies
      call plan_removal(mesh, gone, map)
      exposed = pack(map%node, touched(mesh, gone, map))
      call renumber_mesh(mesh, map)
      allocate (order, source=sorted_order(int(mesh%node_rank(exposed), i8)))
      exposed = exposed(order)
      call list_corners(mesh, first, corner_list)
      call changes%clear()
      do i = 1, size(exposed)
         n = exposed(i)
         around = (corner_list(first(n):first(n + 1) - 1) - 1)/3 + 1
         if (mesh%hinge(n)) mesh%hinge(n) = .not. is_one_fan(mesh, n, size(around))
         ! one that is a hinge no more may have cracks that came to it while it was, and were not opened
         if (.not. mesh%hinge(n)) call part_fans(mesh, n, around, changes, n_copies)
      end do
      if (changes%n_nodes > 0) exposed = [exposed, changes%node(:changes%n_nodes)]
   end subroutine remove_from_mesh

   !> Nodes of elements that go, and of their neighbours, which may face them across a crack only.
   function touched(mesh, gone, map) result(is_touched)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: gone(:)
      type(renumbering_t), intent(in) :: map
      logical, allocatable :: is_touched(:)
      integer :: e, k
      allocate (is_touched(mesh%n_nodes))
      is_touched = .false.
      do e = 1, mesh%n_elements
         if (.not. gone(e)) cycle
         is_touched(mesh%connectivity(:, e)) = .true.
         do k = 1, 3
            if (mesh%segment_at(k, e) > 0) is_touched(mesh%connectivity(:, mesh%neighbour(k, e))) = .true.
         end do
      end do
      is_touched = is_touched .and. map%node > 0
   end function touched

   subroutine carry_real_1(array, from)
      real(wp), allocatable, intent(inout) :: array(:)
      !> old place of each new entity
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(from)
   end subroutine carry_real_1

   subroutine carry_real_2(array, from)
      real(wp), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(:, from)
   end subroutine carry_real_2

   subroutine carry_integer_1(array, from)
      integer, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(from)
   end subroutine carry_integer_1

   subroutine carry_integer_2(array, from)
      integer, allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(:, from)
   end subroutine carry_integer_2

   subroutine carry_small_1(array, from)
      integer(i1), allocatable, intent(inout) :: array(:)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(from)
   end subroutine carry_small_1

   subroutine carry_small_2(array, from)
      integer(i1), allocatable, intent(inout) :: array(:, :)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(:, from)
   end subroutine carry_small_2

   subroutine carry_logical_1(array, from)
      logical, allocatable, intent(inout) :: array(:)
      integer, intent(in) :: from(:)
      if (allocated(array)) array = array(from)
   end subroutine carry_logical_1

end module rf_renumber
