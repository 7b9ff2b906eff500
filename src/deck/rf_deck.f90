!> The input deck: one mechanism for every keyword.
!>
!> A module that owns a datum opens its keyword, goes through the blocks and gets parameters and fields:
!>
!>     call deck%open(card, 'ELASTIC', in_model, about='isotropic linear elasticity')
!>     do while (deck%next(card))
!>        if (.not. card%needs_line('E, nu')) cycle
!>        call card%field_real('E', e, above=0.0_wp, unit='stress', about='Young''s modulus')
!>        call card%field_real('nu', nu, above=-1.0_wp, below=0.5_wp, about='Poisson''s ratio')
!>     end do
!>
!> The same calls read a deck (read_file, read_text) or, after describe, record what they would read: the tables of
!> docs/deck.md come from that. A wrong value is an error with its line; the getter then returns the default or a value
!> within the bounds, so that reading goes on and one run shows all errors. finish hands the errors on.
module rf_deck
   use rf_deck_card, only: card_t
   use rf_deck_lexer, only: lex_file, lex_text, standard_input
   use rf_deck_report, only: check_all, describe_own, explain_deck, write_reference, text_of_deck, list_settings
   use rf_deck_store, only: store_t, in_model, in_step, in_both, find_kind, kind_index
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_text, only: text_t, file_stem, squeezed, upper
   implicit none
   private
   public :: deck_t, card_t, in_model, in_step, in_both

   !> job name of a deck that has no file name
   character(len=*), parameter :: standard_job = 'rfem'

   !> a deck: read or described
   type :: deck_t
      private
      type(store_t), pointer :: store => null()
   contains
      procedure :: read_file, read_text, describe, release
      procedure :: open => open_card
      procedure :: next, ordinal, last_of, later, skipped, finish
      procedure :: explain, write_manual, full_text, settings, heading
      procedure :: step_count, count_of, has_errors, default_job, name, describing
      final :: finalize
   end type deck_t

contains

   !> Read a deck from a file or the standard input. What is wrong with its lines is reported by finish.
   subroutine read_file(self, path, overrides, diagnostics)
      class(deck_t), intent(inout) :: self
      !> the file; empty: the standard input
      character(len=*), intent(in) :: path
      !> 'NAME=VALUE': replaces the value of that *PARAMETER
      character(len=*), intent(in) :: overrides(:)
      !> gets what is wrong with the file and its lines
      type(diagnostics_t), intent(inout) :: diagnostics
      call self%release()
      allocate (self%store)
      call lex_file(self%store, path, overrides)
      call diagnostics%take_from(self%store%diagnostics)
   end subroutine read_file

   !> Read a deck from a text.
   subroutine read_text(self, text, file_name, overrides, diagnostics)
      class(deck_t), intent(inout) :: self
      !> the deck, lines ended by LF or CRLF
      character(len=*), intent(in) :: text
      !> what messages call it; files it includes are looked for beside it
      character(len=*), intent(in) :: file_name
      !> 'NAME=VALUE': replaces the value of that *PARAMETER
      character(len=*), intent(in) :: overrides(:)
      !> gets what is wrong with the lines
      type(diagnostics_t), intent(inout) :: diagnostics
      call self%release()
      allocate (self%store)
      call lex_text(self%store, text, file_name, overrides)
      call diagnostics%take_from(self%store%diagnostics)
   end subroutine read_text

   !> Read nothing; record what readers would read. Each next and each loop over line yields exactly once.
   subroutine describe(self)
      class(deck_t), intent(inout) :: self
      call self%release()
      allocate (self%store)
      self%store%manual = .true.
      call describe_own(self%store)
   end subroutine describe

   !> Free the memory; cards of this deck must not be used any more.
   subroutine release(self)
      class(deck_t), intent(inout) :: self
      if (associated(self%store)) deallocate (self%store)
      nullify (self%store)
   end subroutine release

   subroutine finalize(self)
      type(deck_t), intent(inout) :: self
      call self%release()
   end subroutine finalize

   !> Start to read the blocks of a keyword.
   subroutine open_card(self, card, keyword, where, about, order, bulk, standing)
      class(deck_t), intent(inout) :: self
      !> goes through the blocks
      type(card_t), intent(inout) :: card
      !> without the star
      character(len=*), intent(in) :: keyword
      !> in_model, in_step or in_both: blocks that stand elsewhere are errors, unless another reader opens them there
      integer, intent(in) :: where
      !> meaning, for the manual
      character(len=*), intent(in), optional :: about
      !> place in the manual (default: the order of opening)
      integer, intent(in), optional :: order
      !> the data lines are too many to be shown as settings
      logical, intent(in), optional :: bulk
      !> the defaults hold even if the keyword is absent; explain then shows them
      logical, intent(in), optional :: standing
      integer :: kind
      logical :: many
      many = .false.
      if (present(bulk)) many = bulk
      call kind_index(self%store, upper(squeezed(keyword)), kind)
      associate (this => self%store%kinds(kind))
         this%where = ior(this%where, where)
         if (present(about)) this%about = about
         if (present(order)) this%order = order
         if (present(standing)) this%standing = standing
      end associate
      call card%begin(self%store, kind, where, many)
   end subroutine open_card

   !> Go to the next block of the card's keyword; false when there is none.
   logical function next(self, card)
      class(deck_t), intent(in) :: self
      !> opened by this deck
      type(card_t), intent(inout) :: card
      next = .false.
      if (associated(self%store)) next = card%advance()
   end function next

   !> How many blocks of a keyword stand before the card's block: the one that it belongs to (0: none).
   integer function ordinal(self, card, keyword) result(n)
      class(deck_t), intent(in) :: self
      !> the card
      type(card_t), intent(in) :: card
      !> without the star
      character(len=*), intent(in) :: keyword
      integer :: kind, low, high, middle
      n = 0
      if (self%store%manual) return
      kind = find_kind(self%store, upper(squeezed(keyword)))
      if (kind == 0) return
      low = 0
      high = self%store%kinds(kind)%n_blocks
      do while (low < high) ! blocks(low) < card <= blocks(high + 1)
         middle = (low + high + 1)/2
         if (self%store%kinds(kind)%blocks(middle) < card%block) then
            low = middle
         else
            high = middle - 1
         end if
      end do
      n = low
   end function ordinal

   !> Where the last block of a keyword before the card's block stands among all blocks (0: there is none): of two keywords
   !> that a block may belong to it belongs to the one of the larger number.
   integer function last_of(self, card, keyword) result(block)
      class(deck_t), intent(in) :: self
      !> the card
      type(card_t), intent(in) :: card
      !> without the star
      character(len=*), intent(in) :: keyword
      integer :: n
      block = 0
      n = self%ordinal(card, keyword)
      if (n > 0) block = self%store%kinds(find_kind(self%store, upper(squeezed(keyword))))%blocks(n)
   end function last_of

   !> A keyword that this version does not run yet: an error that says so.
   subroutine later(self, keyword, what)
      class(deck_t), intent(inout) :: self
      !> without the star
      character(len=*), intent(in) :: keyword
      !> what it is for: 'explicit dynamics'
      character(len=*), intent(in) :: what
      integer :: kind
      call kind_index(self%store, upper(squeezed(keyword)), kind)
      self%store%kinds(kind)%later = what
   end subroutine later

   !> A keyword that other programs know and this one does not use: passed over with a note.
   subroutine skipped(self, keyword)
      class(deck_t), intent(inout) :: self
      !> without the star
      character(len=*), intent(in) :: keyword
      integer :: kind
      call kind_index(self%store, upper(squeezed(keyword)), kind)
      self%store%kinds(kind)%skipped = .true.
   end subroutine skipped

   !> After all readers: keywords, parameters and data lines that nobody has read are errors; all messages are handed on.
   !> Called again, it only hands on the messages that have come since.
   subroutine finish(self, diagnostics)
      class(deck_t), intent(inout) :: self
      !> gets all messages
      type(diagnostics_t), intent(inout) :: diagnostics
      if (.not. associated(self%store)) return
      if (.not. self%store%manual .and. .not. self%store%checked) call check_all(self%store)
      self%store%checked = .true.
      call diagnostics%take_from(self%store%diagnostics)
   end subroutine finish

   !> Whether reading has found an error that finish has not handed on yet.
   pure logical function has_errors(self)
      class(deck_t), intent(in) :: self
      has_errors = self%store%diagnostics%n_errors > 0
   end function has_errors

   !> Every setting with its value and where it came from, to be printed.
   subroutine explain(self, manual, lines)
      class(deck_t), intent(in) :: self
      !> a described deck: the defaults of keywords opened as standing that the deck has not are shown too
      type(deck_t), intent(in) :: manual
      type(text_t), allocatable, intent(out) :: lines(:)
      call explain_deck(self%store, lines, manual%store)
   end subroutine explain

   !> Write the tables of the users' reference (Markdown), from a described deck.
   subroutine write_manual(self, unit)
      class(deck_t), intent(in) :: self
      !> where to
      integer, intent(in) :: unit
      call write_reference(self%store, unit)
   end subroutine write_manual

   !> The deck with its included files and --set values in place: one text that reads as the same deck.
   function full_text(self) result(text)
      class(deck_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = text_of_deck(self%store)
   end function full_text

   !> Every setting that was read.
   subroutine settings(self, names, values, origins, manual)
      class(deck_t), intent(in) :: self
      !> 'STEP 1: *RELAXATION TOLERANCE', '1e-6', 'case.inp:17' or 'default'
      type(text_t), allocatable, intent(out) :: names(:), values(:), origins(:)
      !> a described deck: with it, the defaults of keywords opened as standing that the deck has not are listed too
      type(deck_t), intent(in), optional :: manual
      if (present(manual)) then
         call list_settings(self%store, names, values, origins, manual%store)
      else
         call list_settings(self%store, names, values, origins)
      end if
   end subroutine settings

   !> The lines of *HEADING.
   subroutine heading(self, lines)
      class(deck_t), intent(in) :: self
      !> one text a line
      type(text_t), allocatable, intent(out) :: lines(:)
      integer :: i
      allocate (lines(self%store%n_heading))
      do i = 1, self%store%n_heading
         lines(i)%s = self%store%heading(i)%s
      end do
   end subroutine heading

   !> Number of steps.
   pure integer function step_count(self)
      class(deck_t), intent(in) :: self
      step_count = self%store%n_steps
   end function step_count

   !> How many blocks of a keyword the deck has.
   pure integer function count_of(self, keyword) result(n)
      class(deck_t), intent(in) :: self
      !> without the star
      character(len=*), intent(in) :: keyword
      integer :: kind
      n = 0
      kind = find_kind(self%store, upper(squeezed(keyword)))
      if (kind > 0) n = self%store%kinds(kind)%n_blocks
   end function count_of

   !> The deck's file as messages call it.
   pure function name(self)
      class(deck_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = standard_input
      if (self%store%n_files > 0) name = self%store%files(1)%name
   end function name

   !> The job name if neither the deck nor the command line gives one: the file's name without its ending, else rfem.
   pure function default_job(self) result(job)
      class(deck_t), intent(in) :: self
      character(len=:), allocatable :: job
      job = standard_job
      if (self%store%n_files == 0) return
      if (self%store%files(1)%name /= standard_input) job = file_stem(self%store%files(1)%name)
   end function default_job

   !> Whether the deck is being described, not read.
   pure logical function describing(self)
      class(deck_t), intent(in) :: self
      describing = self%store%manual
   end function describing

end module rf_deck
