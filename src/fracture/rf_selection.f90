!> Which nodes split together, before the body is relaxed again (theory: section 8). WORST needs no list: the
!> node with the largest utilisation splits alone. A list is made from one look at the criterion; each node of it is then
!> planned (failure%plan_at) just before it is split, because the splits before it may have changed the elements round it.
module rf_selection
   use rf_kinds, only: wp, i8
   use rf_sort, only: sorted_order
   use rf_failure, only: failure_t, select_separated, select_all
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around
   implicit none
   private
   public :: others_of_round, failing_nodes, separated_nodes, distance_or_default

   !> utilisations closer than this tie
   real(wp), parameter :: tie = 1.0e-6_wp
   !> how far separated nodes may lie below the largest utilisation, as a part of it
   real(wp), parameter :: standard_window = 0.02_wp
   !> distance of separated nodes unless the deck gives one [mean edge]
   real(wp), parameter :: standard_distance = 10.0_wp

contains

   !> All nodes that fail, by falling utilisation; those that tie with the first of them by id.
   subroutine failing_nodes(failure, mesh, list)
      type(failure_t), intent(in) :: failure
      type(mesh_t), intent(in) :: mesh
      integer, allocatable, intent(out) :: list(:)
      integer :: n, first, last
      list = pack([(n, n=1, mesh%n_nodes)], [(failure%utilisation(n) >= 1 .and. failure%may_fail(mesh, n), n=1, mesh%n_nodes)])
      ! the bits of positive reals, read as integers, are in the order of the reals
      list = list(sorted_order(-transfer(failure%utilisation(list), [0_i8])))
      first = 1
      do while (first <= size(list))
         last = first
         do while (last < size(list))
            if (failure%utilisation(list(last + 1)) < failure%utilisation(list(first))*(1 - tie)) exit
            last = last + 1
         end do
         list(first:last) = list(first - 1 + sorted_order(int(mesh%node_id(list(first:last)), i8)))
         first = last + 1
      end do
   end subroutine failing_nodes

   !> Failing nodes that come before all their neighbours, within a part of the largest utilisation, each at a distance
   !> from those before it.
   subroutine separated_nodes(failure, mesh, distance, window, list)
      type(failure_t), intent(in) :: failure
      type(mesh_t), intent(in) :: mesh
      !> smallest distance [length]
      real(wp), intent(in) :: distance
      !> how far their utilisation may lie below the largest, as a part of it [-]; 1 or more: all that fail
      real(wp), intent(in) :: window
      integer, allocatable, intent(out) :: list(:)
      integer, allocatable :: failing(:), place(:)
      real(wp) :: limit
      integer :: i, n, node
      call failing_nodes(failure, mesh, failing)
      allocate (place(mesh%n_nodes), source=huge(1))
      place(failing) = [(i, i=1, size(failing))]
      limit = (1 - window)*maxval(failure%utilisation(failing))
      n = 0
      do i = 1, size(failing)
         node = failing(i)
         if (failure%utilisation(node) < limit .or. .not. is_peak(mesh, place, node)) cycle
         if (too_close(mesh, failing(:n), node, distance)) cycle
         n = n + 1
         failing(n) = node
      end do
      list = failing(:n)
   end subroutine separated_nodes

   !> Whether no neighbour has an earlier place.
   logical function is_peak(mesh, place, node)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: place(:), node
      integer, allocatable :: around(:)
      integer :: n, i
      call elements_around(mesh, node, around, n)
      is_peak = .true.
      do i = 1, n
         is_peak = is_peak .and. all(place(mesh%connectivity(:, around(i))) >= place(node))
      end do
   end function is_peak

   !> Whether a node of a list lies within a distance.
   pure logical function too_close(mesh, list, node, distance)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: list(:), node
      real(wp), intent(in) :: distance
      integer :: i
      too_close = .false.
      do i = 1, size(list)
         too_close = too_close .or. norm2(mesh%x(:, list(i)) - mesh%x(:, node)) < distance
      end do
   end function too_close

   !> A distance, or what is taken where none is given (0) [length].
   pure real(wp) function distance_or_default(distance, mesh)
      real(wp), intent(in) :: distance
      type(mesh_t), intent(in) :: mesh
      distance_or_default = merge(distance, standard_distance*mesh%mean_edge, distance > 0)
   end function distance_or_default

   !> The nodes that split together with the first one, as the deck wants it, largest utilisation first.
   subroutine others_of_round(failure, mesh, first, list)
      type(failure_t), intent(in) :: failure
      type(mesh_t), intent(in) :: mesh
      !> the node that failure%plan has chosen
      integer, intent(in) :: first
      integer, allocatable, intent(out) :: list(:)
      select case (failure%settings%selection)
      case (select_all)
         call failing_nodes(failure, mesh, list)
      case (select_separated)
         call separated_nodes(failure, mesh, distance_or_default(failure%settings%distance, mesh), standard_window, list)
      case default
         allocate (list(0))
      end select
      list = pack(list, list /= first)
   end subroutine others_of_round

end module rf_selection
