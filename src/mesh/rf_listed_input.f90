!> Reads `*NODE` and `*ELEMENT`. A few errors of each kind are reported, the others are counted.
module rf_listed_input
   use rf_kinds, only: wp
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_model
   use rf_deck_store, only: line_place
   use rf_diagnostics, only: place_t
   use rf_mesh_draft, only: draft_t, shown, largest_length
   use rf_text, only: to_text
   implicit none
   private
   public :: read_nodes, read_elements

   !> what Abaqus, CalculiX and Gmsh call elements that are lines: they are left out
   character(len=*), parameter :: line_types = 'T2D2 T2D3 T3D2 T3D3 B21 B22 B23 B31 B31R B32 B32R B33'

contains

   !> All `*NODE` blocks.
   subroutine read_nodes(deck, nodes, draft)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets of the nodes
      type(catalogue_t), intent(inout) :: nodes
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      type(card_t) :: card
      character(len=:), allocatable :: set
      integer :: id, known, first
      real(wp) :: x(2)
      call deck%open(card, 'NODE', where=in_model, bulk=.true., about='nodes; they may come after the elements')
      do while (deck%next(card))
         draft%listed = .true.
         call card%get_name('NSET', set, default='', about='set that these nodes belong to')
         first = nodes%ids%n + 1
         do while (card%line())
            call card%field_integer('id', id, at_least=1, about='any number, in any sequence')
            call card%field_real('x', x(1), unit='length', about='coordinate')
            call card%field_real('y', x(2), unit='length', about='coordinate')
            call card%field_skip('z', about='third coordinate')
            if (any(abs(x) > largest_length)) call card%error('coordinates must lie within '//to_text(largest_length))
            if (card%line_failed) cycle
            call nodes%ids%add(id, known)
            if (known == 0) then
               call draft%add_node(x, card%data_line)
            else
               call defined_twice(card, 'node', id, draft%node_line(known), draft%twice_nodes)
            end if
         end do
         if (len(set) > 0) call nodes%sets%add_run(nodes%sets%define(set, card%keyword_place()), first, nodes%ids%n)
      end do
      if (draft%twice_nodes > shown) call card%error(to_text(draft%twice_nodes - shown)//' more nodes are defined twice')
   end subroutine read_nodes

   !> The error about an id that comes again.
   subroutine defined_twice(card, noun, id, line, n)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> node or element
      character(len=*), intent(in) :: noun
      !> the id
      integer, intent(in) :: id
      !> data line of the first definition
      integer, intent(in) :: line
      !> errors of this kind
      integer, intent(inout) :: n
      type(place_t) :: first
      n = n + 1
      if (n > shown) return
      first = line_place(card%store, line)
      call card%error(noun//' '//to_text(id)//' is defined already at '//first%label())
   end subroutine defined_twice

   !> All `*ELEMENT` blocks; the nodes are known by now.
   subroutine read_elements(deck, nodes, elements, draft)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets of the nodes
      type(catalogue_t), intent(in) :: nodes
      !> ids and sets of the elements
      type(catalogue_t), intent(inout) :: elements
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      type(card_t) :: card
      character(len=:), allocatable :: kind, set
      integer :: first
      call deck%open(card, 'ELEMENT', where=in_model, bulk=.true., about='elements: triangles of three nodes. Line elements ('// &
                     line_types//') are left out with a note')
      do while (deck%next(card))
         draft%listed = .true.
         call card%get_word('TYPE', kind, allowed='CPE3 CPS3 '//line_types, about='CPE3: plane strain, CPS3: plane stress')
         call card%get_name('ELSET', set, default='', about='set that these elements belong to')
         first = elements%ids%n + 1
         if (card%failed()) then
            call read_ids(card, elements, draft)
            draft%failed_elements = draft%failed_elements + 1
         else if (kind == 'CPE3' .or. kind == 'CPS3') then
            call read_triangles(card, nodes, elements, draft, kind == 'CPE3')
         else
            draft%lines = draft%lines - elements%ids%n
            call read_ids(card, elements, draft)
            draft%lines = draft%lines + elements%ids%n
         end if
         if (len(set) > 0) call elements%sets%add_run(elements%sets%define(set, card%keyword_place()), first, elements%ids%n)
      end do
      if (draft%twice_elements > shown) call card%error(to_text(draft%twice_elements - shown)//' more elements are defined twice')
      if (draft%unknown_nodes > shown) &
         call card%error(to_text(draft%unknown_nodes - shown)//' more elements have nodes that are not defined')
   end subroutine read_elements

   !> The data lines of a block of triangles.
   subroutine read_triangles(card, nodes, elements, draft, plane_strain)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets of the nodes
      type(catalogue_t), intent(in) :: nodes
      !> ids and sets of the elements
      type(catalogue_t), intent(inout) :: elements
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      !> the elements are in plane strain
      logical, intent(in) :: plane_strain
      integer :: id, node_id(3), node(3), known, k
      do while (card%line())
         call card%field_integer('id', id, at_least=1, about='any number, in any sequence')
         call card%field_integer('n1', node_id(1), at_least=1, about='id of the first node')
         call card%field_integer('n2', node_id(2), at_least=1, about='id of the second')
         call card%field_integer('n3', node_id(3), at_least=1, about='id of the third; clockwise elements are turned round')
         if (card%describing()) cycle
         if (card%line_failed) then
            draft%failed_elements = draft%failed_elements + 1
            cycle
         end if
         do k = 1, 3
            node(k) = nodes%ids%find(node_id(k))
         end do
         call elements%ids%add(id, known)
         if (known > 0) then
            call defined_twice(card, 'element', id, draft%element_line(known), draft%twice_elements)
            cycle
         end if
         if (any(node == 0)) call unknown_node(card, id, node_id(findloc_zero(node)), draft)
         if (any(node == 0)) node = 0
         call draft%add_element(node, plane_strain, card%data_line)
      end do
   end subroutine read_triangles

   !> First place of a zero among three numbers.
   pure integer function findloc_zero(numbers) result(k)
      !> three numbers
      integer, intent(in) :: numbers(3)
      do k = 1, 2
         if (numbers(k) == 0) return
      end do
   end function findloc_zero

   !> The error about an element whose node does not exist.
   subroutine unknown_node(card, element_id, node_id, draft)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids
      integer, intent(in) :: element_id, node_id
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      draft%unknown_nodes = draft%unknown_nodes + 1
      draft%failed_elements = draft%failed_elements + 1
      if (draft%unknown_nodes <= shown) &
         call card%error('element '//to_text(element_id)//': no node '//to_text(node_id)//' is defined')
   end subroutine unknown_node

   !> The data lines of a block that stays out of the mesh: only the ids are kept, for the sets that name them.
   subroutine read_ids(card, elements, draft)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets of the elements
      type(catalogue_t), intent(inout) :: elements
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      integer :: id, known
      do while (card%line())
         call card%field_integer('id', id, at_least=1)
         call card%skip_line()
         if (card%line_failed) cycle
         call elements%ids%add(id, known)
         if (known > 0) then
            call defined_twice(card, 'element', id, draft%element_line(known), draft%twice_elements)
         else
            call draft%add_element([0, 0, 0], .false., card%data_line)
         end if
      end do
   end subroutine read_ids
end module rf_listed_input
