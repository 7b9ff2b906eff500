!> From the nodes and elements as the deck gives them to a mesh in internal numbering. Plain arrays in deck order
!> (entries); a line element is an entry without nodes.
module rf_mesh_assembly
   use rf_kinds, only: wp, i1, i8
   use rf_mesh, only: mesh_t
   use rf_numbering, only: identity_order
   use rf_ordering, only: ordering_metis, order_of_nodes, order_of_elements
   implicit none
   private
   public :: raw_mesh_t, turn_clockwise, flat_elements, used_nodes, box_of, assemble, is_triangle

   !> a triangle whose double area is less than this part of its longest side squared has none: its smallest angle
   !> is below 1e-10 radian
   real(wp), parameter :: flat_ratio = 1.0e-10_wp
   !> coordinates are only known to their last bit: an area of a few bits of the largest one times the side is none either
   real(wp), parameter :: coordinate_bits = 8*epsilon(1.0_wp)

   !> nodes and elements in deck order; arrays may be larger than the counts
   type :: raw_mesh_t
      integer :: n_nodes = 0, n_elements = 0
      !> coordinates [length], (2, nodes)
      real(wp), allocatable :: x(:, :)
      !> entries of the nodes, (3, elements); 0: a line element
      integer, allocatable :: connectivity(:, :)
      !> the element is in plane strain (else plane stress)
      logical, allocatable :: plane_strain(:)
   end type raw_mesh_t

contains

   !> Whether an element is a triangle (else a line, which is left out).
   pure logical function is_triangle(raw, element)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> the element
      integer, intent(in) :: element
      is_triangle = raw%connectivity(1, element) > 0
   end function is_triangle

   !> Which nodes a triangle has.
   pure function used_nodes(raw) result(used)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> (nodes)
      logical, allocatable :: used(:)
      integer :: e
      allocate (used(raw%n_nodes))
      used = .false.
      do e = 1, raw%n_elements
         if (is_triangle(raw, e)) used(raw%connectivity(:, e)) = .true.
      end do
   end function used_nodes

   !> Box round the nodes that count; zero if there are none.
   pure subroutine box_of(raw, used, low, high)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> nodes that count
      logical, intent(in) :: used(:)
      !> lower left and upper right corner [length]
      real(wp), intent(out) :: low(2), high(2)
      integer :: i
      low = huge(1.0_wp); high = -huge(1.0_wp)
      do i = 1, raw%n_nodes
         if (.not. used(i)) cycle
         low = min(low, raw%x(:, i))
         high = max(high, raw%x(:, i))
      end do
      if (.not. any(used)) low = 0
      if (.not. any(used)) high = 0
   end subroutine box_of

   !> Turn clockwise triangles round, by exchanging their second and third node.
   pure subroutine turn_clockwise(raw, turned)
      !> the deck's mesh
      type(raw_mesh_t), intent(inout) :: raw
      !> which were turned, (elements)
      logical, allocatable, intent(out) :: turned(:)
      real(wp) :: corner(2, 3)
      integer :: e
      allocate (turned(raw%n_elements))
      turned = .false.
      do e = 1, raw%n_elements
         if (.not. is_triangle(raw, e)) cycle
         corner = raw%x(:, raw%connectivity(:, e))
         turned(e) = double_area(corner) < 0
         if (turned(e)) raw%connectivity(2:3, e) = raw%connectivity([3, 2], e)
      end do
   end subroutine turn_clockwise

   !> Triangles without area, or with the same node twice; relative to their own size.
   pure function flat_elements(raw) result(flat)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> the elements
      integer, allocatable :: flat(:)
      logical, allocatable :: is_flat(:)
      real(wp) :: corner(2, 3)
      integer :: e
      allocate (is_flat(raw%n_elements))
      is_flat = .false.
      do e = 1, raw%n_elements
         if (.not. is_triangle(raw, e)) cycle
         corner = raw%x(:, raw%connectivity(:, e))
         is_flat(e) = has_no_area(corner)
      end do
      flat = pack(identity_order(raw%n_elements), is_flat)
   end function flat_elements

   !> Whether a triangle has no area.
   pure logical function has_no_area(corner)
      !> coordinates of its nodes [length]
      real(wp), intent(in) :: corner(2, 3)
      real(wp) :: longest
      longest = max(norm2(corner(:, 2) - corner(:, 1)), norm2(corner(:, 3) - corner(:, 2)), norm2(corner(:, 1) - corner(:, 3)))
      has_no_area = abs(double_area(corner)) <= longest*(flat_ratio*longest + coordinate_bits*maxval(abs(corner)))
   end function has_no_area

   !> Twice the area of a triangle [length^2], positive if counter-clockwise.
   pure real(wp) function double_area(corner)
      !> coordinates of its nodes [length]
      real(wp), intent(in) :: corner(2, 3)
      real(wp) :: a(2), b(2)
      a = corner(:, 2) - corner(:, 1)
      b = corner(:, 3) - corner(:, 1)
      double_area = a(1)*b(2) - a(2)*b(1)
   end function double_area

   !> Fill a mesh with all triangles and the nodes they have, numbered anew. Sets, sections and what topology gives
   !> stay empty.
   subroutine assemble(raw, node_id, element_id, ordering, mesh, node_place, element_place)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> ids of the entries
      integer, intent(in) :: node_id(:), element_id(:)
      !> one of the internal numberings (rf_ordering)
      integer, intent(in) :: ordering
      !> the mesh
      type(mesh_t), intent(inout) :: mesh
      !> place of each entry in the mesh (0: left out)
      integer, allocatable, intent(out) :: node_place(:), element_place(:)
      integer, allocatable :: kept(:), triangles(:), order(:), graph(:, :)
      kept = pack(identity_order(raw%n_nodes), used_nodes(raw))
      triangles = pack(identity_order(raw%n_elements), raw%connectivity(1, :raw%n_elements) > 0)
      mesh%ordering = ordering
      allocate (graph(3, 0))      ! only METIS asks for it
      if (ordering == ordering_metis) graph = renamed(raw%connectivity(:, triangles), scattered(kept, raw%n_nodes))
      order = order_of_nodes(ordering, raw%x(:, kept), graph)
      call fill_nodes(raw, node_id, kept, order, mesh)
      node_place = scattered(kept(order), raw%n_nodes)
      order = order_of_elements(ordering, renamed(raw%connectivity(:, triangles), node_place))
      call fill_elements(raw, element_id, triangles, order, node_place, mesh)
      element_place = scattered(triangles(order), raw%n_elements)
      call measure(mesh)
   end subroutine assemble

   !> Place of each of n entries in a list that does not have all of them (0: not in it).
   pure function scattered(list, n) result(place)
      !> entries
      integer, intent(in) :: list(:)
      !> how many entries there are
      integer, intent(in) :: n
      integer, allocatable :: place(:)
      integer :: i
      allocate (place(n))
      place = 0
      do i = 1, size(list)
         place(list(i)) = i
      end do
   end function scattered

   !> Connectivity in other node numbers.
   pure function renamed(connectivity, place) result(nodes)
      !> node numbers, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> new number of each
      integer, intent(in) :: place(:)
      integer, allocatable :: nodes(:, :)
      integer :: e
      allocate (nodes(3, size(connectivity, 2)))
      do e = 1, size(nodes, 2)
         nodes(:, e) = place(connectivity(:, e))
      end do
   end function renamed

   !> The node arrays of the mesh.
   subroutine fill_nodes(raw, node_id, kept, order, mesh)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> ids of the node entries
      integer, intent(in) :: node_id(:)
      !> entries that stay, in deck order; their numbers 1, 2, ... in the new sequence
      integer, intent(in) :: kept(:), order(:)
      !> the mesh
      type(mesh_t), intent(inout) :: mesh
      integer :: n, i
      n = size(kept)
      if (allocated(mesh%share)) deallocate (mesh%share, mesh%node_origin, mesh%element_origin)
      call mesh%reserve_nodes(n)
      mesh%n_nodes = n
      mesh%n_numbered_nodes = n
      do i = 1, n
         mesh%x(:, i) = raw%x(:, kept(order(i)))
         mesh%node_id(i) = node_id(kept(order(i)))
         mesh%node_rank(i) = order(i)
      end do
   end subroutine fill_nodes

   !> The element arrays of the mesh.
   subroutine fill_elements(raw, element_id, kept, order, node_place, mesh)
      !> the deck's mesh
      type(raw_mesh_t), intent(in) :: raw
      !> ids of the element entries
      integer, intent(in) :: element_id(:)
      !> entries that stay, in deck order; their numbers 1, 2, ... in the new sequence
      integer, intent(in) :: kept(:), order(:)
      !> place of each node entry in the mesh
      integer, intent(in) :: node_place(:)
      !> the mesh
      type(mesh_t), intent(inout) :: mesh
      integer :: n, i
      n = size(kept)
      call mesh%reserve_elements(n)
      mesh%n_elements = n
      mesh%n_numbered_elements = n
      do i = 1, n
         mesh%connectivity(:, i) = node_place(raw%connectivity(:, kept(order(i))))
         mesh%element_id(i) = element_id(kept(order(i)))
         mesh%element_rank(i) = order(i)
      end do
      mesh%split_level(:n) = 0_i1
   end subroutine fill_elements

   !> Size of the model and mean length of the elements' sides.
   pure subroutine measure(mesh)
      !> the mesh
      type(mesh_t), intent(inout) :: mesh
      real(wp) :: low(2), high(2), total
      integer :: e, k
      if (mesh%n_elements == 0) return
      low = minval(mesh%x(:, :mesh%n_nodes), dim=2)
      high = maxval(mesh%x(:, :mesh%n_nodes), dim=2)
      mesh%size = maxval(high - low)
      mesh%diagonal = norm2(high - low)
      total = 0
      do e = 1, mesh%n_elements
         do k = 1, 3
            total = total + norm2(mesh%x(:, mesh%connectivity(mod(k, 3) + 1, e)) - mesh%x(:, mesh%connectivity(k, e)))
         end do
      end do
      mesh%mean_edge = total/(3*mesh%n_elements)
   end subroutine measure
end module rf_mesh_assembly
