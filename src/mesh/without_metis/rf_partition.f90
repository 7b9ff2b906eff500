!> Stands in for with_metis/rf_partition.f90 where METIS was not found: says so. The deck's reader refuses ORDERING=METIS.
module rf_partition
   use rf_kinds, only: wp
   use rf_numbering, only: hilbert_order
   implicit none
   private
   public :: partition_order, partitions_available

   !> this build can form parts
   logical, parameter :: partitions_available = .false.

contains

   !> Never called while partitions are not available; a Hilbert curve is the nearest thing.
   function partition_order(x, connectivity, part_size) result(order)
      !> nodes [length], (2, n)
      real(wp), intent(in) :: x(:, :)
      !> nodes of the triangles, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> nodes that a part should have
      integer, intent(in) :: part_size
      !> old numbers in their new sequence, (n)
      integer, allocatable :: order(:)
      associate (unused => connectivity, unused_too => part_size)
      end associate
      order = hilbert_order(x)
   end function partition_order

end module rf_partition
