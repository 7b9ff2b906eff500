!> The triangle mesh with its cracks: flat arrays (component, entity), entities in internal numbering.
!>
!> Edge k of element e runs from its k-th to its (k mod 3)+1-th node, counter-clockwise. Across it lies
!> neighbour(k, e), also when the edge is cracked: then segment(k, e) > 0 names the crack segment, and the two sides
!> have nodes of their own wherever the crack has opened the fan (rf_topology).
module rf_mesh
   use rf_kinds, only: wp, i1
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   implicit none
   private
   public :: mesh_t, no_origin, sets_in_a_word

   !> node_origin of a node that is no copy of a node of the deck: a midpoint or a copy of one
   integer, parameter :: no_origin = 0
   !> sets whose membership one small integer holds
   integer, parameter :: sets_in_a_word = 8

   type :: mesh_t
      !> nodes, elements and crack segments present (arrays may be larger)
      integer :: n_nodes = 0, n_elements = 0, n_segments = 0
      !> nodes and elements of the deck, or those that were there when the numbers last changed (rf_renumber); those after
      !> them came by splitting
      integer :: n_numbered_nodes = 0, n_numbered_elements = 0
      !> internal numbering (rf_ordering)
      integer :: ordering = 0
      !> largest ids given so far: new nodes and elements count on from them
      integer :: last_node_id = 0, last_element_id = 0
      !> longest side of the box round all nodes, diagonal of that box, mean edge length [length]
      real(wp) :: size = 0, diagonal = 0, mean_edge = 0

      ! --- nodes
      !> reference coordinates [length], (2, capacity)
      real(wp), allocatable :: x(:, :)
      !> id shown to the user
      integer, allocatable :: node_id(:)
      !> deck id of the node it is a copy of (no_origin: none); not allocated as long as that is its own id everywhere, see
      !> origin_of_node
      integer, allocatable :: node_origin(:)
      !> place of the node in all output: deck order, then order of creation
      integer, allocatable :: node_rank(:)
      !> an element that has this node
      integer, allocatable :: element_of(:)
      !> part of one deck node's loads and means that this copy carries [-]; midpoints carry none. Not allocated as long as
      !> every node carries its own whole, see share_of
      real(wp), allocatable :: share(:)
      !> the node joins parts of the body at a point only (it then never breaks)
      logical, allocatable :: hinge(:)
      !> bit b of word w: the node belongs to node set 8 (w - 1) + b + 1
      integer(i1), allocatable :: node_membership(:, :)

      ! --- elements
      !> node numbers, counter-clockwise, (3, capacity)
      integer, allocatable :: connectivity(:, :)
      !> element across edge k (0: boundary), (3, capacity)
      integer, allocatable :: neighbour(:, :)
      !> crack segment on edge k (0: intact), (3, capacity); not allocated as long as nothing is cracked, see segment_at
      integer, allocatable :: segment(:, :)
      !> load group of the face k (0: none; with a minus sign while it lies inside the body); follows the face through every
      !> split, (3, capacity); not allocated as long as nothing presses on a face, see tag_at
      integer, allocatable :: face_tag(:, :)
      !> id shown to the user
      integer, allocatable :: element_id(:)
      !> deck id of the ancestor; not allocated as long as that is its own id everywhere, see origin_of_element
      integer, allocatable :: element_origin(:)
      !> place of the element in all output
      integer, allocatable :: element_rank(:)
      !> section of the element (rf_material)
      integer, allocatable :: section(:)
      !> how often an ancestor was bisected
      integer(i1), allocatable :: split_level(:)
      !> bit b of word w: the element belongs to element set 8 (w - 1) + b + 1
      integer(i1), allocatable :: element_membership(:, :)

      ! --- crack segments: one cracked edge each
      !> the two elements that share the cracked edge, (2, capacity)
      integer, allocatable :: segment_element(:, :)
      !> 1 tension, 2 shear, 0 pre-existing
      integer(i1), allocatable :: segment_mode(:)
      !> event that cracked it (0: pre-existing)
      integer, allocatable :: segment_event(:)
      !> number of the *CRACK it belongs to (0: broken in the run)
      integer, allocatable :: segment_crack(:)
      !> its length along the ray that it stands for, as a part of its own [-]: paths through midpoints zigzag about rays
      real(wp), allocatable :: segment_straight(:)
   contains
      procedure :: reserve_nodes, reserve_elements, reserve_segments
      procedure :: keep_segments, keep_tags, keep_copies
      procedure :: segment_at, segments_of, tag_at, share_of, origin_of_node, origin_of_element, node_origins, element_origins
      procedure :: edge_index, area, node_in_set, element_in_set
      procedure :: exchange
   end type mesh_t

contains

   !> Make room for n nodes in all node arrays that are kept.
   subroutine reserve_nodes(self, n)
      class(mesh_t), intent(inout) :: self
      !> nodes that must fit
      integer, intent(in) :: n
      call grow(self%x, n, 2)
      call grow(self%node_id, n)
      if (allocated(self%node_origin)) call grow(self%node_origin, n)
      call grow(self%node_rank, n)
      call grow(self%element_of, n)
      if (allocated(self%share)) call grow(self%share, n)
      call grow(self%hinge, n)
      call grow(self%node_membership, n, 1)
   end subroutine reserve_nodes

   !> Make room for n elements in all element arrays that are kept.
   subroutine reserve_elements(self, n)
      class(mesh_t), intent(inout) :: self
      !> elements that must fit
      integer, intent(in) :: n
      call grow(self%connectivity, n, 3)
      call grow(self%neighbour, n, 3)
      if (allocated(self%segment)) call grow(self%segment, n, 3)
      if (allocated(self%face_tag)) call grow(self%face_tag, n, 3)
      call grow(self%element_id, n)
      if (allocated(self%element_origin)) call grow(self%element_origin, n)
      call grow(self%element_rank, n)
      call grow(self%section, n)
      call grow(self%split_level, n)
      call grow(self%element_membership, n, 1)
   end subroutine reserve_elements

   !> Make room for n crack segments.
   subroutine reserve_segments(self, n)
      class(mesh_t), intent(inout) :: self
      !> segments that must fit
      integer, intent(in) :: n
      call grow(self%segment_element, n, 2)
      call grow(self%segment_mode, n)
      call grow(self%segment_event, n)
      call grow(self%segment_crack, n)
      call grow(self%segment_straight, n)
   end subroutine reserve_segments

   !> From now on edges may be cracked.
   subroutine keep_segments(self)
      class(mesh_t), intent(inout) :: self
      if (.not. allocated(self%segment)) call grow(self%segment, size(self%connectivity, 2), 3)
   end subroutine keep_segments

   !> From now on faces may be pressed.
   subroutine keep_tags(self)
      class(mesh_t), intent(inout) :: self
      if (.not. allocated(self%face_tag)) call grow(self%face_tag, size(self%connectivity, 2), 3)
   end subroutine keep_tags

   !> From now on there may be nodes and elements that the deck has not.
   subroutine keep_copies(self)
      class(mesh_t), intent(inout) :: self
      if (allocated(self%share)) return
      call grow(self%share, size(self%node_id))
      self%share = 1
      self%node_origin = self%node_id
      self%element_origin = self%element_id
   end subroutine keep_copies

   !> Crack segment on an edge (0: intact).
   pure integer function segment_at(self, k, element) result(segment)
      class(mesh_t), intent(in) :: self
      !> edge, element
      integer, intent(in) :: k, element
      segment = 0
      if (allocated(self%segment)) segment = self%segment(k, element)
   end function segment_at

   !> Crack segments on the edges of an element (0: intact).
   pure function segments_of(self, element) result(segments)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: element
      integer :: segments(3)
      segments = 0
      if (allocated(self%segment)) segments = self%segment(:, element)
   end function segments_of

   !> Load group of a face (face_tag).
   pure integer function tag_at(self, k, element) result(tag)
      class(mesh_t), intent(in) :: self
      !> edge, element
      integer, intent(in) :: k, element
      tag = 0
      if (allocated(self%face_tag)) tag = self%face_tag(k, element)
   end function tag_at

   !> Part of one deck node's loads and means that a node carries [-].
   pure real(wp) function share_of(self, node) result(share)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: node
      share = 1
      if (allocated(self%share)) share = self%share(node)
   end function share_of

   !> Deck id of the node that a node is a copy of (no_origin: none).
   pure integer function origin_of_node(self, node) result(origin)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: node
      origin = self%node_id(node)
      if (allocated(self%node_origin)) origin = self%node_origin(node)
   end function origin_of_node

   !> Deck id of the ancestor of an element.
   pure integer function origin_of_element(self, element) result(origin)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: element
      origin = self%element_id(element)
      if (allocated(self%element_origin)) origin = self%element_origin(element)
   end function origin_of_element

   !> The same of all nodes.
   pure function node_origins(self) result(origins)
      class(mesh_t), intent(in) :: self
      integer, allocatable :: origins(:)
      if (allocated(self%node_origin)) then
         origins = self%node_origin(:self%n_nodes)
      else
         origins = self%node_id(:self%n_nodes)
      end if
   end function node_origins

   !> The same of all elements.
   pure function element_origins(self) result(origins)
      class(mesh_t), intent(in) :: self
      integer, allocatable :: origins(:)
      if (allocated(self%element_origin)) then
         origins = self%element_origin(:self%n_elements)
      else
         origins = self%element_id(:self%n_elements)
      end if
   end function element_origins

   !> Which edge (1 to 3) of an element has a given neighbour across it; 0 if none.
   pure integer function edge_index(self, element, across) result(k)
      class(mesh_t), intent(in) :: self
      !> the element and the one across the edge
      integer, intent(in) :: element, across
      do k = 3, 1, -1
         if (self%neighbour(k, element) == across) return
      end do
   end function edge_index

   !> Area of an element [length^2], positive for counter-clockwise nodes.
   pure real(wp) function area(self, element)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: element
      real(wp) :: a(2), b(2)
      a = self%x(:, self%connectivity(2, element)) - self%x(:, self%connectivity(1, element))
      b = self%x(:, self%connectivity(3, element)) - self%x(:, self%connectivity(1, element))
      area = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
   end function area

   !> Whether a node belongs to a node set.
   pure logical function node_in_set(self, node, set)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: node
      !> number of the set (0: none, nothing belongs to it)
      integer, intent(in) :: set
      node_in_set = .false.
      if (set > 0) node_in_set = btest(self%node_membership((set - 1)/sets_in_a_word + 1, node), mod(set - 1, sets_in_a_word))
   end function node_in_set

   !> Whether an element belongs to an element set.
   pure logical function element_in_set(self, element, set)
      class(mesh_t), intent(in) :: self
      integer, intent(in) :: element
      !> number of the set (0: none)
      integer, intent(in) :: set
      element_in_set = .false.
      if (set > 0) element_in_set = btest(self%element_membership((set - 1)/sets_in_a_word + 1, element), &
                                          mod(set - 1, sets_in_a_word))
   end function element_in_set

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(mesh_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n_nodes', self%n_nodes)
      call archive%exchange('n_elements', self%n_elements)
      call archive%exchange('n_segments', self%n_segments)
      call archive%exchange('n_numbered_nodes', self%n_numbered_nodes)
      call archive%exchange('n_numbered_elements', self%n_numbered_elements)
      call archive%exchange('ordering', self%ordering)
      call archive%exchange('last_node_id', self%last_node_id)
      call archive%exchange('last_element_id', self%last_element_id)
      call archive%exchange('size', self%size)
      call archive%exchange('diagonal', self%diagonal)
      call archive%exchange('mean_edge', self%mean_edge)
      call archive%exchange('x', self%x)
      call archive%exchange('node_id', self%node_id)
      call archive%exchange('node_origin', self%node_origin)
      call archive%exchange('node_rank', self%node_rank)
      call archive%exchange('element_of', self%element_of)
      call archive%exchange('share', self%share)
      call archive%exchange('hinge', self%hinge)
      call archive%exchange('node_membership', self%node_membership)
      call archive%exchange('connectivity', self%connectivity)
      call archive%exchange('neighbour', self%neighbour)
      call archive%exchange('segment', self%segment)
      call archive%exchange('face_tag', self%face_tag)
      call archive%exchange('element_id', self%element_id)
      call archive%exchange('element_origin', self%element_origin)
      call archive%exchange('element_rank', self%element_rank)
      call archive%exchange('section', self%section)
      call archive%exchange('split_level', self%split_level)
      call archive%exchange('element_membership', self%element_membership)
      call archive%exchange('segment_element', self%segment_element)
      call archive%exchange('segment_mode', self%segment_mode)
      call archive%exchange('segment_event', self%segment_event)
      call archive%exchange('segment_crack', self%segment_crack)
      call archive%exchange('segment_straight', self%segment_straight)
   end subroutine exchange

end module rf_mesh
