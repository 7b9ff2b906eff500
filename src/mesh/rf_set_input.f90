!> Reads `*NSET` and `*ELSET`: members by id, by the name of another set, in steps (GENERATE), or by place (BOX,
!> CIRCLE, NEAREST). Whatever else is known of the entries comes as plain arrays.
module rf_set_input
   use rf_kinds, only: wp
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_model
   use rf_number, only: read_integer, number_junk
   use rf_sets, only: in_box, in_ring, nearest_point
   use rf_text, only: to_text
   implicit none
   private
   public :: read_sets, run_of_ids

   !> part of the model's size by which a place may be missed (deck.md)
   real(wp), parameter :: margin_of_size = 1.0e-6_wp

   !> ids named in a warning about a block
   integer, parameter :: ids_named = 5

   !> what the members of a block are
   integer, parameter :: by_id = 0, by_steps = 1, by_box = 2, by_ring = 3, by_nearest = 4

contains

   !> Read all blocks of `*NSET` or `*ELSET`.
   subroutine read_sets(deck, keyword, catalogue, x, present_entries, size_of_model)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> NSET or ELSET: also the parameter with the name
      character(len=*), intent(in) :: keyword
      !> of nodes or elements, with all ids
      type(catalogue_t), intent(inout) :: catalogue
      !> coordinates of nodes or of elements' centroids [length], (2, entries)
      real(wp), intent(in) :: x(:, :)
      !> the entry will be in the mesh, (entries)
      logical, intent(in) :: present_entries(:)
      !> longest side of the box round all nodes [length]
      real(wp), intent(in) :: size_of_model
      type(card_t) :: card
      character(len=:), allocatable :: name
      integer :: set, manner
      call deck%open(card, keyword, where=in_model, bulk=.true., about='names a set of '//catalogue%noun()// &
                     's; blocks of the same name add up')
      do while (deck%next(card))
         call card%get_name(keyword, name, about='name of the set')
         call check_name(card, name)
         set = catalogue%sets%define(name, card%keyword_place())
         call get_manner(card, catalogue%noun(), manner)
         if (manner == by_id .or. card%describing()) call read_list(card, catalogue, set)
         if (manner == by_steps .or. card%describing()) call read_steps(card, catalogue, set)
         if (manner == by_box .or. card%describing()) &
            call read_boxes(card, catalogue, set, x, present_entries, margin_of_size*size_of_model)
         if (manner == by_ring .or. card%describing()) &
            call read_rings(card, catalogue, set, x, present_entries, margin_of_size*size_of_model)
         if (manner == by_nearest .or. card%describing()) &
            call read_nearest(card, catalogue, set, x, present_entries, margin_of_size*size_of_model)
      end do
   end subroutine read_sets

   !> A name that reads as a number could not be told from an id.
   subroutine check_name(card, name)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> of the set
      character(len=*), intent(in) :: name
      integer :: number, status
      if (len(name) == 0) return
      call read_integer(name, number, status)
      if (status /= number_junk) call card%keyword_error('a set cannot be called '//name//': that is an id')
   end subroutine check_name

   !> Which of the forms a block has.
   subroutine get_manner(card, noun, manner)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> node or element
      character(len=*), intent(in) :: noun
      !> by_id to by_nearest
      integer, intent(out) :: manner
      logical :: given(by_steps:by_nearest)
      integer :: k
      call card%get_flag('GENERATE', given(by_steps), about='ids in equal steps')
      call card%get_flag('BOX', given(by_box), about=noun//'s in boxes (elements by their centroid); a margin of 1e-6 of '// &
                         'the model''s size is included')
      call card%get_flag('CIRCLE', given(by_ring), about=noun//'s between two circles, with the same margin')
      call card%get_flag('NEAREST', given(by_nearest), about='the '//noun//' nearest to each point (of several the lowest id)')
      manner = by_id
      do k = by_steps, by_nearest
         if (given(k)) manner = k
      end do
      if (count(given) > 1) call card%keyword_error('only one of GENERATE, BOX, CIRCLE, NEAREST can be given')
   end subroutine get_manner

   !> Ids and names of sets, as many on a line as the user likes. Ids that are not defined are left out with a warning, as
   !> CalculiX does: tools that drop the line elements of an export leave their sets behind.
   subroutine read_list(card, catalogue, set)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set they belong to
      integer, intent(in) :: set
      character(len=:), allocatable :: name
      integer :: id, entry, i, unknown
      character(len=:), allocatable :: unknown_ids
      unknown = 0
      unknown_ids = ''
      call card%form('ids')
      if (.not. card%needs_line('ids or names of sets')) return
      do
         do i = 1, card%fields()
            if (card%next_is_integer()) then
               call card%field_integer('id', id, at_least=1)
               entry = catalogue%ids%find(id)
               if (card%line_failed) exit
               if (entry > 0) call catalogue%sets%add_entry(set, entry)
               if (entry > 0) cycle
               unknown = unknown + 1
               if (unknown <= ids_named) unknown_ids = unknown_ids//' '//to_text(id)
            else
               call card%field_name('id or set', name, about='ids or names of other sets, any number on a line')
               if (card%line_failed .or. card%describing()) exit
               call catalogue%sets%add_reference(set, name, card%place())
            end if
         end do
         if (.not. card%line()) exit
      end do
      if (unknown > ids_named) unknown_ids = unknown_ids//' ...'
      if (unknown == 1) call card%warning('an id is left out, no '//catalogue%noun()//' has it:'//unknown_ids)
      if (unknown > 1) call card%warning(to_text(unknown)//' ids are left out, no '//catalogue%noun()//' has them:'//unknown_ids)
   end subroutine read_list

   !> First, last and step of ids.
   subroutine read_steps(card, catalogue, set)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set they belong to
      integer, intent(in) :: set
      integer :: first, last, step, n, missing
      call card%form('GENERATE')
      if (.not. card%needs_line('first, last[, step]')) return
      do
         call card%field_integer('first', first, at_least=1, about='first id')
         call card%field_integer('last', last, at_least=1, about='last id')
         call card%field_integer('step', step, default=1, at_least=1, about='from one to the next')
         if (last < first .and. .not. card%line_failed) call card%error('the last id, '//to_text(last)// &
                                                                        ', comes before the first, '//to_text(first))
         if (.not. (card%line_failed .or. card%describing())) then
            call run_of_ids(catalogue, set, first, last, step, n, missing)
            if (n == 0) then
               call card%warning('no '//catalogue%noun()//' with any of these ids is defined')
            else if (missing > 0) then
               call card%warning(to_text(missing)//' of these ids are not defined')
            end if
         end if
         if (.not. card%line()) exit
      end do
   end subroutine read_steps

   !> Add all entries whose id is first, first + step, ... up to last.
   subroutine run_of_ids(catalogue, set, first, last, step, n, missing)
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set they belong to
      integer, intent(in) :: set
      !> ids
      integer, intent(in) :: first, last, step
      !> entries found; ids without one
      integer, intent(out) :: n, missing
      integer :: wanted, i, entry, id
      n = 0
      wanted = (last - first)/step + 1
      if (wanted <= catalogue%ids%n) then
         do i = 0, wanted - 1
            entry = catalogue%ids%find(first + i*step)
            if (entry == 0) cycle
            call catalogue%sets%add_entry(set, entry)
            n = n + 1
         end do
      else ! a run longer than the deck: look at what there is
         do entry = 1, catalogue%ids%n
            id = catalogue%ids%id(entry)
            if (id < first .or. id > last) cycle
            if (mod(id - first, step) /= 0) cycle
            call catalogue%sets%add_entry(set, entry)
            n = n + 1
         end do
      end if
      missing = wanted - n
   end subroutine run_of_ids

   !> Boxes.
   subroutine read_boxes(card, catalogue, set, x, present_entries, margin)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set
      integer, intent(in) :: set
      !> places of the entries [length]
      real(wp), intent(in) :: x(:, :)
      !> the entry will be in the mesh
      logical, intent(in) :: present_entries(:)
      !> [length]
      real(wp), intent(in) :: margin
      real(wp) :: low(2), high(2)
      integer :: entry, n
      call card%form('BOX')
      if (.not. card%needs_line('xmin, xmax, ymin, ymax')) return
      do
         call card%field_real('xmin', low(1), unit='length', about='left side of the box')
         call card%field_real('xmax', high(1), unit='length', about='right side')
         call card%field_real('ymin', low(2), unit='length', about='lower side')
         call card%field_real('ymax', high(2), unit='length', about='upper side')
         if (any(low > high) .and. .not. card%line_failed) call card%error('a box needs xmin <= xmax and ymin <= ymax')
         n = 0
         do entry = 1, merge(0, size(present_entries), card%line_failed .or. card%describing())
            if (.not. present_entries(entry)) cycle
            if (.not. in_box(x(:, entry), low, high, margin)) cycle
            call catalogue%sets%add_entry(set, entry)
            n = n + 1
         end do
         if (n == 0) call nothing_there(card, catalogue, 'the box', x, present_entries)
         if (.not. card%line()) exit
      end do
   end subroutine read_boxes

   !> Rings and circles.
   subroutine read_rings(card, catalogue, set, x, present_entries, margin)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set
      integer, intent(in) :: set
      !> places of the entries [length]
      real(wp), intent(in) :: x(:, :)
      !> the entry will be in the mesh
      logical, intent(in) :: present_entries(:)
      !> [length]
      real(wp), intent(in) :: margin
      real(wp) :: centre(2), inner, outer
      integer :: entry, n
      call card%form('CIRCLE')
      if (.not. card%needs_line('xc, yc, r_inner, r_outer')) return
      do
         call card%field_real('xc', centre(1), unit='length', about='centre')
         call card%field_real('yc', centre(2), unit='length', about='centre')
         call card%field_real('r_inner', inner, at_least=0.0_wp, unit='length', about='inner radius')
         call card%field_real('r_outer', outer, at_least=0.0_wp, unit='length', about='outer radius')
         if (inner > outer .and. .not. card%line_failed) call card%error('r_inner is larger than r_outer')
         n = 0
         do entry = 1, merge(0, size(present_entries), card%line_failed .or. card%describing())
            if (.not. present_entries(entry)) cycle
            if (.not. in_ring(x(:, entry), centre, inner, outer, margin)) cycle
            call catalogue%sets%add_entry(set, entry)
            n = n + 1
         end do
         if (n == 0) call nothing_there(card, catalogue, 'the ring', x, present_entries)
         if (.not. card%line()) exit
      end do
   end subroutine read_rings

   !> The nearest of all to each point.
   subroutine read_nearest(card, catalogue, set, x, present_entries, margin)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> the set
      integer, intent(in) :: set
      !> places of the entries [length]
      real(wp), intent(in) :: x(:, :)
      !> the entry will be in the mesh
      logical, intent(in) :: present_entries(:)
      !> [length]
      real(wp), intent(in) :: margin
      real(wp) :: point(2)
      integer :: entry
      call card%form('NEAREST')
      if (.not. card%needs_line('x, y')) return
      do
         call card%field_real('x', point(1), unit='length', about='place')
         call card%field_real('y', point(2), unit='length', about='place')
         if (.not. (card%line_failed .or. card%describing())) then
            entry = nearest_point(x, present_entries, catalogue%ids%id, point, margin)
            if (entry > 0) call catalogue%sets%add_entry(set, entry)
         end if
         if (.not. card%line()) exit
      end do
   end subroutine read_nearest

   !> A place without any member: most likely a slip, so the error says where the model is.
   subroutine nothing_there(card, catalogue, what, x, present_entries)
      !> the block being read
      type(card_t), intent(inout) :: card
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(in) :: catalogue
      !> 'the box'
      character(len=*), intent(in) :: what
      !> places of the entries [length]
      real(wp), intent(in) :: x(:, :)
      !> the entry will be in the mesh
      logical, intent(in) :: present_entries(:)
      character(len=:), allocatable :: text
      if (card%line_failed .or. card%describing() .or. .not. any(present_entries)) return
      text = 'no '//catalogue%noun()//' lies in '//what
      if (catalogue%of_elements) text = 'no element has its centroid in '//what
      call card%error(text//'; they lie at x = '//range_of(x(1, :), present_entries)//' and y = '// &
                      range_of(x(2, :), present_entries))
   end subroutine nothing_there

   !> 'a to b'
   pure function range_of(values, counts) result(text)
      !> any numbers
      real(wp), intent(in) :: values(:)
      !> values that count
      logical, intent(in) :: counts(:)
      character(len=:), allocatable :: text
      text = to_text(minval(values, mask=counts))//' to '//to_text(maxval(values, mask=counts))
   end function range_of
end module rf_set_input
