!> Numbering by parts of the node graph, which METIS forms (Karypis & Kumar 1998, SIAM J. Sci. Comput. 20, 359-392).
!> The only file that knows METIS; without_metis/rf_partition.f90 takes its place where METIS was not found.
module rf_partition
   use, intrinsic :: iso_c_binding, only: c_int, c_int32_t, c_ptr, c_null_ptr
   use rf_kinds, only: wp, i8
   use rf_numbering, only: hilbert_order, identity_order, order_by_key, places_of
   implicit none
   private
   public :: partition_order, partitions_available

   !> this build can form parts
   logical, parameter :: partitions_available = .true.
   !> indices of METIS (CMake has looked that they are so wide)
   integer, parameter :: idx = c_int32_t
   !> options of METIS: how many, success, and the places of seed and numbering among them, counted from 0
   integer, parameter :: n_options = 40, ok = 1, option_seed = 8, option_numbering = 17
   !> fixed, so that a mesh always has the same parts
   integer(idx), parameter :: seed = 1

   interface
      integer(c_int) function metis_set_default_options(options) bind(c, name='METIS_SetDefaultOptions')
         import :: c_int, idx, n_options
         integer(idx), intent(out) :: options(0:n_options - 1)
      end function metis_set_default_options

      integer(c_int) function metis_mesh_to_nodal(ne, nn, eptr, eind, numflag, xadj, adjncy) &
         bind(c, name='METIS_MeshToNodal')
         import :: c_int, c_ptr, idx
         integer(idx), intent(in) :: ne, nn, numflag
         integer(idx), intent(inout) :: eptr(*), eind(*)
         type(c_ptr), intent(out) :: xadj, adjncy
      end function metis_mesh_to_nodal

      integer(c_int) function metis_part_graph_kway(nvtxs, ncon, xadj, adjncy, vwgt, vsize, adjwgt, nparts, tpwgts, ubvec, &
                                                    options, objval, part) bind(c, name='METIS_PartGraphKway')
         import :: c_int, c_ptr, idx
         integer(idx), intent(in) :: nvtxs, ncon, nparts, options(*)
         type(c_ptr), value :: xadj, adjncy, vwgt, vsize, adjwgt, tpwgts, ubvec
         integer(idx), intent(out) :: objval, part(*)
      end function metis_part_graph_kway

      integer(c_int) function metis_free(pointer) bind(c, name='METIS_Free')
         import :: c_int, c_ptr
         type(c_ptr), value :: pointer
      end function metis_free
   end interface

contains

   !> Order of nodes part by part, parts and the nodes in them along a Hilbert curve. Where METIS gives up, all nodes are
   !> one part.
   function partition_order(x, connectivity, part_size) result(order)
      !> nodes [length], (2, n)
      real(wp), intent(in) :: x(:, :)
      !> nodes of the triangles, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> nodes that a part should have
      integer, intent(in) :: part_size
      !> old numbers in their new sequence, (n)
      integer, allocatable :: order(:)
      integer, allocatable :: part(:), place(:)
      integer(i8), allocatable :: key(:)
      real(wp), allocatable :: centre(:, :)
      integer, allocatable :: members(:)
      integer :: n, n_parts, i
      n = size(x, 2)
      n_parts = max(1, (n - 1)/part_size + 1)
      allocate (part, source=parts_of(connectivity, n, n_parts))
      allocate (centre(2, n_parts), source=0.0_wp)
      allocate (members(n_parts), source=0)
      do i = 1, n
         members(part(i)) = members(part(i)) + 1
         centre(:, part(i)) = centre(:, part(i)) + x(:, i)
      end do
      do i = 1, n_parts
         centre(:, i) = centre(:, i)/max(1, members(i))
      end do
      allocate (place, source=places_of(hilbert_order(centre)))
      allocate (key(n))
      order = hilbert_order(x)
      do i = 1, n
         key(i) = place(part(order(i)))
      end do
      order = order(order_by_key(key))         ! equal keys keep their sequence along the curve
   end function partition_order

   !> Part of each node, 1 to n_parts.
   function parts_of(connectivity, n_nodes, n_parts) result(part)
      integer, intent(in) :: connectivity(:, :), n_nodes, n_parts
      integer, allocatable :: part(:)
      integer(idx), allocatable :: first(:), node(:)
      integer(idx) :: options(0:n_options - 1), cut
      type(c_ptr) :: neighbours_from, neighbours
      integer(c_int) :: status
      integer :: n_elements
      allocate (part(n_nodes), source=1)
      n_elements = size(connectivity, 2)
      if (n_parts == 1 .or. n_elements == 0) return     ! METIS divides by n_parts - 1
      first = int(3*(identity_order(n_elements + 1) - 1), idx)
      node = int(reshape(connectivity, [3*n_elements]) - 1, idx)
      status = metis_mesh_to_nodal(int(n_elements, idx), int(n_nodes, idx), first, node, 0_idx, neighbours_from, neighbours)
      if (status /= ok) return
      if (metis_set_default_options(options) == ok) then
         options(option_seed) = seed
         options(option_numbering) = 0
         if (metis_part_graph_kway(int(n_nodes, idx), 1_idx, neighbours_from, neighbours, c_null_ptr, c_null_ptr, c_null_ptr, &
                                   int(n_parts, idx), c_null_ptr, c_null_ptr, options, cut, part) == ok) then
            part = part + 1
         else
            part = 1
         end if
      end if
      status = metis_free(neighbours_from)
      status = metis_free(neighbours)
   end function parts_of

end module rf_partition
