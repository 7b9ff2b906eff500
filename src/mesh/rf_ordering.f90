!> Internal numberings of nodes and elements (`*JOB, ORDERING`). No result shows them.
module rf_ordering
   use rf_kinds, only: wp
   use rf_numbering, only: hilbert_order, identity_order, order_by_lowest_node
   use rf_partition, only: partition_order
   implicit none
   private
   public :: ordering_none, ordering_hilbert, ordering_metis
   public :: order_of_nodes, order_of_elements

   !> the deck's, along a Hilbert curve, part by part
   integer, parameter :: ordering_none = 0, ordering_hilbert = 1, ordering_metis = 2
   !> nodes of a part: a block of the relaxation step (rf_step_k)
   integer, parameter :: part_size = 512

contains

   !> Old numbers of the nodes in their new sequence.
   function order_of_nodes(ordering, x, connectivity) result(order)
      !> one of the internal numberings
      integer, intent(in) :: ordering
      !> nodes [length], (2, nodes); nodes of the triangles, (3, elements): ordering_metis only
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: connectivity(:, :)
      integer, allocatable :: order(:)
      select case (ordering)
      case (ordering_hilbert)
         order = hilbert_order(x)
      case (ordering_metis)
         order = partition_order(x, connectivity, part_size)
      case default
         order = identity_order(size(x, 2))
      end select
   end function order_of_nodes

   !> Old numbers of the elements in their new sequence.
   pure function order_of_elements(ordering, connectivity) result(order)
      !> one of the internal numberings
      integer, intent(in) :: ordering
      !> nodes of the triangles in their new numbers, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      integer, allocatable :: order(:)
      if (ordering == ordering_none) then
         order = identity_order(size(connectivity, 2))
      else
         order = order_by_lowest_node(connectivity)
      end if
   end function order_of_elements

end module rf_ordering
