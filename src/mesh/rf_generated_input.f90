!> Reads `*MESH`: a mesh made by pattern instead of a listed one.
module rf_generated_input
   use rf_kinds, only: wp, i8
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_model
   use rf_diagnostics, only: place_t
   use rf_generate, only: generate, mesh_counts, largest_jitter, staggered_jitter, side_left, side_right, side_bottom, side_top
   use rf_memory, only: memory_problem, bytes_to_read
   use rf_mesh_draft, only: draft_t, largest_length, smallest_length
   use rf_text, only: to_text
   implicit none
   private
   public :: read_generator

   !> three node numbers of each element must be countable
   integer(i8), parameter :: most_elements = 500000000_i8
   !> names of the sides' sets, by the bits of rf_generate
   character(len=6), parameter :: side_name(side_left:side_top) = [character(len=6) :: 'LEFT', 'RIGHT', 'BOTTOM', 'TOP']

   !> what `*MESH` says
   type :: order_t
      character(len=:), allocatable :: pattern, kind, set
      real(wp) :: jitter = 0, corner(2) = 0, lengths(2) = 1
      integer :: seed = 1, cells(2) = 1
   end type order_t

contains

   !> The `*MESH` block, if there is one.
   subroutine read_generator(deck, nodes, elements, draft)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets
      type(catalogue_t), intent(inout) :: nodes, elements
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      type(card_t) :: card
      type(order_t) :: order
      call deck%open(card, 'MESH', where=in_model, about='makes nodes and elements of a rectangle. Node sets '// &
                     'LEFT, RIGHT, BOTTOM and TOP include the corners. Node (i, j) has id 1 + i + j (nx + 1), centres '// &
                     'of CROSS come after them; STAGGERED is a near-equilateral lattice with sides of about '// &
                     'the cells'' size, ids row by row')
      do while (deck%next(card))
         call read_order(card, order)
         if (card%describing()) cycle
         if (card%number > 1) call card%keyword_error('a deck can have one *MESH only')
         if (draft%listed) call card%keyword_error('*MESH makes all nodes and elements: no *NODE or *ELEMENT can stand beside it')
         if (.not. card%failed()) call check_counts(card, order)
         if (card%failed()) then
            draft%failed_elements = draft%failed_elements + 1
            call name_sets(order, nodes, elements, card%keyword_place())
         else
            call carry_out(order, nodes, elements, draft, card%keyword_place())
         end if
      end do
   end subroutine read_generator

   !> Parameters and data line.
   subroutine read_order(card, order)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> what is asked for
      type(order_t), intent(inout) :: order
      character(len=:), allocatable :: shape
      call card%get_word('SHAPE', shape, allowed='RECTANGLE', default='RECTANGLE', about='shape of the body')
      call card%get_word('TYPE', order%kind, allowed='CPE3 CPS3', default='CPE3', about='CPE3: plane strain, CPS3: plane stress')
      call card%get_name('ELSET', order%set, default='', about='set that all elements belong to')
      call card%get_word('PATTERN', order%pattern, allowed='DIAGONAL ALTERNATING CROSS STAGGERED', default='STAGGERED', &
                         about='how the cells are cut')
      call card%get_real('JITTER', order%jitter, default=merge(staggered_jitter, 0.0_wp, order%pattern == 'STAGGERED'), &
                         at_least=0.0_wp, at_most=largest_jitter, shown='0.15 for STAGGERED, else 0', &
                         about='how far inner nodes are moved at random, at most, as a part of a cell''s shorter side')
      call card%get_integer('SEED', order%seed, default=1, about='of the random moves')
      if (.not. card%needs_line('x0, y0, width, height, nx, ny')) return
      call card%field_real('x0', order%corner(1), unit='length', about='lower left corner')
      call card%field_real('y0', order%corner(2), unit='length', about='lower left corner')
      call card%field_real('width', order%lengths(1), above=0.0_wp, unit='length', about='of the rectangle')
      call card%field_real('height', order%lengths(2), above=0.0_wp, unit='length', about='of the rectangle')
      call card%field_integer('nx', order%cells(1), at_least=1, about='cells across')
      call card%field_integer('ny', order%cells(2), at_least=1, about='cells up')
      if (card%line()) call card%error('*MESH has one data line only')
   end subroutine read_order

   !> Refuse a mesh that cannot be counted, and one whose cells are smaller than a coordinate's last bits.
   subroutine check_counts(card, order)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> what is asked for
      type(order_t), intent(in) :: order
      integer(i8) :: n_nodes, n_elements
      character(len=:), allocatable :: problem
      if (any(abs(order%corner) > largest_length) .or. any(order%lengths > largest_length) .or. &
          any(order%lengths/order%cells < smallest_length)) then
         call card%error('lengths must lie between '//to_text(smallest_length)//' and '//to_text(largest_length))
         return
      end if
      call mesh_counts(order%pattern, order%lengths(1), order%lengths(2), order%cells(1), order%cells(2), n_nodes, n_elements)
      if (n_elements > most_elements) then
         call card%error('a mesh of '//to_text(n_elements)//' elements is too large: at most '//to_text(most_elements))
      else
         call memory_problem(n_elements, bytes_to_read, 'to be read', problem)
         if (allocated(problem)) call card%error(problem)
      end if
      if (any(order%lengths/order%cells <= 1.0e6_wp*epsilon(1.0_wp)*abs(order%corner))) &
         call card%error('the cells are too small for coordinates as large as these')
   end subroutine check_counts

   !> The sets that there would be: after an error they are empty, but known.
   subroutine name_sets(order, nodes, elements, place)
      type(order_t), intent(in) :: order
      type(catalogue_t), intent(inout) :: nodes, elements
      !> of the keyword
      type(place_t), intent(in) :: place
      integer :: side, set
      do side = side_left, side_top
         set = nodes%sets%define(trim(side_name(side)), place)
      end do
      if (len(order%set) > 0) set = elements%sets%define(order%set, place)
   end subroutine name_sets

   !> Make the mesh.
   subroutine carry_out(order, nodes, elements, draft, place)
      !> what is asked for
      type(order_t), intent(in) :: order
      !> ids and sets
      type(catalogue_t), intent(inout) :: nodes, elements
      !> the mesh so far
      type(draft_t), intent(inout) :: draft
      !> of the keyword
      type(place_t), intent(in) :: place
      integer, allocatable :: sides(:)
      integer :: side, set, node, element, known
      call generate(order%pattern, order%corner, order%lengths, order%cells, order%jitter, order%seed, draft%raw%x, &
                    draft%raw%connectivity, sides)
      draft%raw%n_nodes = size(draft%raw%x, 2)
      draft%raw%n_elements = size(draft%raw%connectivity, 2)
      draft%raw%plane_strain = spread(order%kind == 'CPE3', 1, draft%raw%n_elements)
      do node = 1, draft%raw%n_nodes
         call nodes%ids%add(node, known)
      end do
      do element = 1, draft%raw%n_elements
         call elements%ids%add(element, known)
      end do
      do side = side_left, side_top
         set = nodes%sets%define(trim(side_name(side)), place)
         do node = 1, draft%raw%n_nodes
            if (btest(sides(node), side)) call nodes%sets%add_entry(set, node)
         end do
      end do
      if (len(order%set) > 0) call elements%sets%add_run(elements%sets%define(order%set, place), 1, draft%raw%n_elements)
   end subroutine carry_out
end module rf_generated_input
