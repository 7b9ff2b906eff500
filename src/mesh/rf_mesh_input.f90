!> Reads the mesh: `*NODE`, `*ELEMENT`, `*MESH`, `*NSET`, `*ELSET` (each in a module of its own) and the ORDERING of
!> `*JOB`, in whatever sequence they stand. Owns what the deck calls nodes and elements; rf_mesh_assembly fills the mesh.
module rf_mesh_input
   use rf_kinds, only: wp, i1
   use rf_catalogue, only: catalogue_t
   use rf_deck, only: deck_t, card_t, in_model
   use rf_deck_rules, only: any_failed
   use rf_deck_store, only: line_place
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_generated_input, only: read_generator
   use rf_grow, only: grow
   use rf_listed_input, only: read_nodes, read_elements
   use rf_mesh, only: mesh_t, sets_in_a_word
   use rf_mesh_assembly, only: assemble, box_of, flat_elements, is_triangle, turn_clockwise, used_nodes
   use rf_ordering, only: ordering_none, ordering_hilbert, ordering_metis
   use rf_mesh_draft, only: draft_t, shown
   use rf_partition, only: partitions_available
   use rf_set_input, only: read_sets
   use rf_text, only: to_text
   implicit none
   private
   public :: mesh_input_t

   !> ids that splitting may need above those of the deck
   integer, parameter :: room_for_ids = 100000000
   !> ids named in a note
   integer, parameter :: ids_named = 5
   type :: mesh_input_t
      !> ids and sets of nodes and of elements
      type(catalogue_t) :: nodes, elements
      !> the deck's element is in plane strain (else plane stress), by internal number
      logical, allocatable :: plane_strain(:)
      !> the deck's element was clockwise and has been turned round, by internal number
      logical, allocatable :: turned(:)
   contains
      procedure :: read => read_mesh
      procedure :: find_node, find_element, edge_of_face
   end type mesh_input_t

contains

   !> Read the mesh and its sets. After errors the mesh holds what was right, so that the rest of the deck can be read.
   subroutine read_mesh(self, deck, mesh, diagnostics)
      class(mesh_input_t), intent(inout) :: self
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> filled but for topology and sections
      type(mesh_t), intent(inout) :: mesh
      !> errors and notes
      type(diagnostics_t), intent(inout) :: diagnostics
      type(draft_t) :: draft
      logical, allocatable :: turned(:)
      integer :: ordering
      self%nodes%sets%kind = 'node'
      self%elements%sets%kind = 'element'
      self%elements%of_elements = .true.
      call grow(self%nodes%ids%id, 0)
      call grow(self%elements%ids%id, 0)
      call draft%start()
      call read_ordering(deck, ordering)
      call read_nodes(deck, self%nodes, draft)
      call read_elements(deck, self%nodes, self%elements, draft)
      call read_generator(deck, self%nodes, self%elements, draft)
      call read_both_sets(deck, self%nodes, self%elements, draft)
      if (deck%describing()) return
      call turn_clockwise(draft%raw, turned)
      call report(deck, self%elements, draft, turned, diagnostics)
      call assemble(draft%raw, self%nodes%ids%id, self%elements%ids%id, ordering, mesh, self%nodes%place, self%elements%place)
      mesh%last_node_id = self%nodes%ids%base_for_new(room_for_ids)
      mesh%last_element_id = self%elements%ids%base_for_new(room_for_ids)
      self%plane_strain = moved(draft%raw%plane_strain, self%elements%place, mesh%n_elements)
      self%turned = moved(turned, self%elements%place, mesh%n_elements)
      call adopt_sets(self%nodes, mesh%n_nodes, mesh%node_membership, diagnostics)
      call adopt_sets(self%elements, mesh%n_elements, mesh%element_membership, diagnostics)
      call note_left_out(self%nodes, self%elements, draft, diagnostics)
      self%nodes%incomplete = mesh%n_elements == 0 .or. any_failed(deck, 'NODE', in_model) .or. &
                              any_failed(deck, 'ELEMENT', in_model) .or. any_failed(deck, 'MESH', in_model)
      self%elements%incomplete = self%nodes%incomplete
   end subroutine read_mesh

   !> Internal number of the node of an id; 0 if there is none.
   pure integer function find_node(self, id)
      class(mesh_input_t), intent(in) :: self
      !> the deck's id
      integer, intent(in) :: id
      find_node = self%nodes%find(id)
   end function find_node

   !> Internal number of the element of an id; 0 if there is none.
   pure integer function find_element(self, id)
      class(mesh_input_t), intent(in) :: self
      !> the deck's id
      integer, intent(in) :: id
      find_element = self%elements%find(id)
   end function find_element

   !> Edge of a deck element that the user's face is: P1, P2, P3 go by the deck's node order, which a clockwise element
   !> no longer has.
   pure integer function edge_of_face(self, element, face) result(edge)
      class(mesh_input_t), intent(in) :: self
      !> internal number; 1 to 3
      integer, intent(in) :: element, face
      edge = face
      if (self%turned(element)) edge = 4 - face
   end function edge_of_face

   !> ORDERING of `*JOB`.
   subroutine read_ordering(deck, ordering)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> one of the internal numberings
      integer, intent(out) :: ordering
      type(card_t) :: card
      character(len=:), allocatable :: word
      ordering = ordering_hilbert
      call deck%open(card, 'JOB', where=in_model)
      do while (deck%next(card))
         call card%get_word('ORDERING', word, allowed='HILBERT METIS NONE', default='HILBERT', &
                            about='internal numbering (METIS: part by part); the answer is the same but for the order of '// &
                            'sums (last bits)')
         select case (word)
         case ('METIS')
            ordering = ordering_metis
            if (.not. (partitions_available .or. deck%describing())) &
               call card%keyword_error('ORDERING=METIS: this rfem was built without METIS; allowed: HILBERT, NONE')
         case ('NONE')
            ordering = ordering_none
         end select
      end do
   end subroutine read_ordering

   !> `*NSET` and `*ELSET`. Places of elements are their centroids; nodes on no element and lines have none.
   subroutine read_both_sets(deck, nodes, elements, draft)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets
      type(catalogue_t), intent(inout) :: nodes, elements
      !> the mesh so far
      type(draft_t), intent(in) :: draft
      real(wp), allocatable :: centroid(:, :)
      logical, allocatable :: counts(:)
      real(wp) :: low(2), high(2), model_size
      integer :: e
      allocate (counts, source=used_nodes(draft%raw))
      call box_of(draft%raw, counts, low, high)
      model_size = maxval(high - low)
      call read_sets(deck, 'NSET', nodes, draft%raw%x(:, :draft%raw%n_nodes), counts, model_size)
      allocate (centroid(2, draft%raw%n_elements))
      deallocate (counts)
      allocate (counts(draft%raw%n_elements))
      do e = 1, draft%raw%n_elements
         counts(e) = is_triangle(draft%raw, e)
         centroid(:, e) = 0
         if (counts(e)) centroid(:, e) = sum(draft%raw%x(:, draft%raw%connectivity(:, e)), dim=2)/3
      end do
      call read_sets(deck, 'ELSET', elements, centroid, counts, model_size)
   end subroutine read_both_sets

   !> Errors and notes about the elements as a whole.
   subroutine report(deck, elements, draft, turned, diagnostics)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets of the elements
      type(catalogue_t), intent(in) :: elements
      !> the mesh so far
      type(draft_t), intent(in) :: draft
      !> elements that were clockwise
      logical, intent(in) :: turned(:)
      !> errors and notes
      type(diagnostics_t), intent(inout) :: diagnostics
      type(place_t) :: nowhere
      integer :: n_triangles
      n_triangles = count(draft%raw%connectivity(1, :draft%raw%n_elements) > 0)
      if (n_triangles == 0 .and. draft%failed_elements == 0) then
         if (draft%lines > 0) then
            call diagnostics%error(nowhere, 'the deck has line elements only; triangles (CPE3, CPS3) are needed')
         else
            call diagnostics%error(nowhere, 'the deck has no elements: *ELEMENT or *MESH is missing')
         end if
      end if
      call report_flat(deck, elements, draft, diagnostics)
      if (any(turned)) call diagnostics%note(nowhere, counted(count(turned), 'clockwise element')//' turned round')
   end subroutine report

   !> The errors about elements without area.
   subroutine report_flat(deck, elements, draft, diagnostics)
      !> the deck
      type(deck_t), intent(inout) :: deck
      !> ids and sets of the elements
      type(catalogue_t), intent(in) :: elements
      !> the mesh so far
      type(draft_t), intent(in) :: draft
      !> errors and notes
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      type(place_t) :: nowhere, place
      integer, allocatable :: flat(:)
      integer :: i
      allocate (flat, source=flat_elements(draft%raw))
      if (size(flat) == 0) return
      call deck%open(card, 'ELEMENT', where=in_model)
      do i = 1, min(shown, size(flat))
         if (allocated(draft%element_line)) place = line_place(card%store, draft%element_line(flat(i))) ! else generated
         call diagnostics%error(place, 'element '//to_text(elements%ids%id(flat(i)))//' has no area')
      end do
      if (size(flat) > shown) &
         call diagnostics%error(nowhere, 'there are '//to_text(size(flat) - shown)//' more elements without area')
   end subroutine report_flat

   !> '1 element is', '2 elements are'.
   pure function counted(n, noun) result(text)
      !> how many
      integer, intent(in) :: n
      !> node or element
      character(len=*), intent(in) :: noun
      character(len=:), allocatable :: text
      text = to_text(n)//' '//noun
      if (n == 1) text = text//' is'
      if (n /= 1) text = text//'s are'
   end function counted

   !> A flag of each entry, by internal number.
   pure function moved(flag, place, n) result(by_place)
      !> by entry
      logical, intent(in) :: flag(:)
      !> internal number of each entry (0: none); how many there are
      integer, intent(in) :: place(:), n
      logical, allocatable :: by_place(:)
      integer :: entry
      allocate (by_place(n))
      do entry = 1, size(place)
         if (place(entry) > 0) by_place(place(entry)) = flag(entry)
      end do
   end function moved

   !> Resolve the sets, give the mesh their bits and count their members.
   subroutine adopt_sets(catalogue, n, bits, diagnostics)
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(inout) :: catalogue
      !> nodes or elements in the mesh
      integer, intent(in) :: n
      !> of the mesh, (words, n)
      integer(i1), allocatable, intent(inout) :: bits(:, :)
      !> errors and notes
      type(diagnostics_t), intent(inout) :: diagnostics
      integer(i1), allocatable :: entry_bits(:, :)
      integer(i1) :: rest
      logical, allocatable :: within(:, :)
      integer :: entry, word, bit, set
      call catalogue%sets%close_table(within, diagnostics)
      allocate (entry_bits, source=catalogue%sets%membership(within, catalogue%ids%n))
      if (allocated(bits)) deallocate (bits)
      allocate (bits(size(entry_bits, 1), n), catalogue%n_members(catalogue%sets%n))
      bits = 0_i1
      catalogue%n_members = 0
      do entry = 1, catalogue%ids%n
         if (catalogue%place(entry) == 0) cycle
         bits(:, catalogue%place(entry)) = entry_bits(:, entry)
         do word = 1, size(bits, 1)
            rest = entry_bits(word, entry)
            do while (rest /= 0_i1)
               bit = trailz(rest)
               rest = ibclr(rest, bit)
               set = (word - 1)*sets_in_a_word + bit + 1
               catalogue%n_members(set) = catalogue%n_members(set) + 1
            end do
         end do
      end do
   end subroutine adopt_sets

   !> Notes about nodes on no element and line elements, and about sets that had no other members.
   subroutine note_left_out(nodes, elements, draft, diagnostics)
      !> ids and sets
      type(catalogue_t), intent(in) :: nodes, elements
      !> the mesh so far
      type(draft_t), intent(in) :: draft
      !> errors and notes
      type(diagnostics_t), intent(inout) :: diagnostics
      type(place_t) :: nowhere
      integer, allocatable :: left(:)
      character(len=:), allocatable :: list
      integer :: i
      if (draft%lines > 0) call diagnostics%note(nowhere, counted(draft%lines, 'line element')//' left out'//emptied(elements))
      left = pack(nodes%ids%id(:nodes%ids%n), nodes%place == 0)
      if (size(left) == 0 .or. draft%failed_elements > 0) return
      list = ''
      do i = 1, min(ids_named, size(left))
         list = list//' '//to_text(left(i))
      end do
      if (size(left) > ids_named) list = list//' ...'
      call diagnostics%note(nowhere, counted(size(left), 'node')//' on no element and left out:'//list//emptied(nodes))
   end subroutine note_left_out

   !> '; element sets A, B had no other members', or nothing.
   pure function emptied(catalogue) result(text)
      !> ids and sets, of nodes or elements
      type(catalogue_t), intent(in) :: catalogue
      character(len=:), allocatable :: text
      integer :: set, n
      text = ''
      n = 0
      do set = 1, catalogue%sets%n
         if (catalogue%n_members(set) > 0) cycle
         if (n > 0) text = text//','
         text = text//' '//catalogue%sets%name(set)%s
         n = n + 1
      end do
      if (n == 0) return
      if (n > 1) text = 's'//text
      text = '; '//catalogue%noun()//' set'//text//' had no other members'
   end function emptied
end module rf_mesh_input
