!> The fields of a data line: each is read, checked, recorded and described by one call, in their order on the line.
!>
!> Common arguments as in rf_deck_options. An empty field is one that is not given.
module rf_deck_card
   use rf_deck_bounds, only: within, bounds_text, harmless
   use rf_deck_options, only: options_t, choose
   use rf_kinds, only: wp
   use rf_number, only: read_real, read_integer, number_ok, number_overflow, number_problem
   use rf_text, only: joined, split, squeezed, text_t, to_text, upper
   implicit none
   private
   public :: card_t

   !> one block of a keyword: what readers work with
   type, extends(options_t) :: card_t
   contains
      procedure :: field_real, field_integer, field_name, field_text, field_word, field_skip, next_is_integer, next_is_empty
      procedure, private :: field_error, empty_field
   end type card_t

contains

   !> A real number within bounds.
   subroutine field_real(self, name, value, default, above, below, at_least, at_most, unit, about, shown)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      !> the number
      real(wp), intent(out) :: value
      real(wp), intent(in), optional :: default
      !> bounds that it must be beyond, or may also be equal to
      real(wp), intent(in), optional :: above, below, at_least, at_most
      character(len=*), intent(in), optional :: unit, about, shown
      integer :: first, last, status
      call self%take(name, first, last)
      if (first > last) then
         value = harmless(above, below, at_least, at_most)
         if (present(default)) value = default
         call self%empty_field(name, 'number '//bounds_text(above, below, at_least, at_most), real_default(default, shown), unit, &
            about)
         return
      end if
      call read_real(self%store%pool(first:last), value, status)
      if (.not. self%bulk) call self%record(name, self%store%pool(first:last), .true., .false.)
      if (status /= number_ok) then
         call self%field_error(name, first, last, number_problem(status, .false.))
      else if (within(value, above, below, at_least, at_most)) then
         return
      else
         call self%field_error(name, first, last, 'must be '//bounds_text(above, below, at_least, at_most))
      end if
      value = harmless(above, below, at_least, at_most)
      if (present(default)) value = default
   end subroutine field_real

   !> What stands for the default of a number; empty if there is none.
   pure function real_default(default, shown) result(text)
      real(wp), intent(in), optional :: default
      character(len=*), intent(in), optional :: shown
      character(len=:), allocatable :: text
      text = ''
      if (present(default)) text = to_text(default)
      if (present(default) .and. present(shown)) text = shown
   end function real_default

   !> A whole number within bounds.
   subroutine field_integer(self, name, value, default, at_least, at_most, about, shown)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      !> the number
      integer, intent(out) :: value
      integer, intent(in), optional :: default
      !> bounds that it may be equal to
      integer, intent(in), optional :: at_least, at_most
      character(len=*), intent(in), optional :: about, shown
      integer :: first, last, status, least, most
      character(len=:), allocatable :: standard
      least = -huge(1)
      most = huge(1)
      if (present(at_least)) least = at_least
      if (present(at_most)) most = at_most
      call self%take(name, first, last)
      if (first > last) then
         value = min(max(1, least), most)
         standard = ''
         if (present(default)) then
            value = default
            standard = to_text(default)
            if (present(shown)) standard = shown
         end if
         call self%empty_field(name, 'whole number '//whole_bounds(least, most), standard, about=about)
         return
      end if
      call read_integer(self%store%pool(first:last), value, status)
      if (.not. self%bulk) call self%record(name, self%store%pool(first:last), .true., .false.)
      if (status /= number_ok) then
         call self%field_error(name, first, last, number_problem(status, .true.))
      else if (value >= least .and. value <= most) then
         return
      else
         call self%field_error(name, first, last, 'must be '//whole_bounds(least, most))
      end if
      value = min(max(1, least), most)
      if (present(default)) value = default
   end subroutine field_integer

   !> 'at least 1 and at most 3'
   pure function whole_bounds(least, most) result(text)
      integer, intent(in) :: least, most
      character(len=:), allocatable :: text
      text = ''
      if (least > -huge(1)) text = 'at least '//to_text(least)
      if (least > -huge(1) .and. most < huge(1)) text = text//' and '
      if (most < huge(1)) text = text//'at most '//to_text(most)
   end function whole_bounds

   !> A name of a set, material, ..., in capitals, its blanks squeezed.
   subroutine field_name(self, name, value, default, about, shown)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      !> the name
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default
      character(len=*), intent(in), optional :: about, shown
      call take_text(self, name, 'name', value, default, about, shown)
      value = upper(squeezed(value))
   end subroutine field_name

   !> A text whose case is kept.
   subroutine field_text(self, name, value, default, about, shown)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      !> the text
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default
      character(len=*), intent(in), optional :: about, shown
      call take_text(self, name, 'text', value, default, about, shown)
   end subroutine field_text

   !> A word, in capitals, of those allowed.
   subroutine field_word(self, name, value, allowed, default, later, about, shown)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      !> the word
      character(len=:), allocatable, intent(out) :: value
      !> words separated by blanks or commas
      character(len=*), intent(in) :: allowed
      character(len=*), intent(in), optional :: default
      !> words that a later version will know
      character(len=*), intent(in), optional :: later
      character(len=*), intent(in), optional :: about, shown
      character(len=:), allocatable :: text, problem
      type(text_t), allocatable :: words(:)
      call split(allowed, words)
      call take_text(self, name, joined(words, ', '), text, default, about, shown)
      if (len(text) > 0) then
         call choose(upper(squeezed(text)), allowed, later, value, problem)
         if (len(problem) == 0) return
         if (.not. self%store%manual) call self%error(name//' = '''//text//''' '//problem)
      end if
      value = words(1)%s
      if (present(default)) value = default
   end subroutine field_word

   !> What the fields that are texts share.
   subroutine take_text(self, name, what, value, default, about, shown)
      class(card_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> 'name', 'text' or the words allowed
      character(len=*), intent(in) :: what
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default, about, shown
      character(len=:), allocatable :: standard
      integer :: first, last
      call self%take(name, first, last)
      if (first > last) then
         value = ''
         standard = ''
         if (present(default)) then
            value = default
            standard = default
            if (len(standard) == 0) standard = 'none'
            if (present(shown)) standard = shown
         end if
         call self%empty_field(name, what, standard, about=about)
         return
      end if
      value = self%store%pool(first:last)
      if (.not. self%bulk) call self%record(name, value, .true., .false.)
   end subroutine take_text

   !> A field that is accepted and not used.
   subroutine field_skip(self, name, about)
      class(card_t), intent(inout) :: self
      !> the field
      character(len=*), intent(in) :: name
      character(len=*), intent(in), optional :: about
      integer :: first, last
      call self%take(name, first, last)
      if (self%store%manual) call self%describe_item(.true., name, 'anything', 'not used', about=about)
   end subroutine field_skip

   !> A field without a value: described, recorded as the default, or an error.
   subroutine empty_field(self, name, what, default, unit, about)
      class(card_t), intent(inout) :: self
      !> the field, what it may be, its default (empty: it is required)
      character(len=*), intent(in) :: name, what, default
      character(len=*), intent(in), optional :: unit, about
      if (self%store%manual) then
         call self%describe_item(.true., name, trim(what), default, unit, about)
      else if (len(default) == 0) then
         call self%error('field '//to_text(self%taken)//' of *'//self%keyword()//' ('//name//') is missing: '//trim(what))
      else if (.not. self%bulk) then
         call self%record(name, default, .true., .true.)
      end if
   end subroutine empty_field

   !> A field whose value is wrong.
   subroutine field_error(self, name, first, last, problem)
      class(card_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> its place in the pool
      integer, intent(in) :: first, last
      character(len=*), intent(in) :: problem
      call self%error('field '//to_text(self%taken)//' of *'//self%keyword()//', '//name//' = '''// &
         self%store%pool(first:last)//''', '//problem)
   end subroutine field_error

   !> Whether the next field is a whole number, also one too large to be held (else it is a name, empty or wrong).
   logical function next_is_integer(self)
      class(card_t), intent(in) :: self
      type(card_t) :: copy
      integer :: first, last, number, status
      copy%store => self%store
      copy%at_line = self%at_line
      copy%position = self%position
      copy%finish = self%finish
      call copy%take('', first, last)
      next_is_integer = .false.
      if (first > last) return
      call read_integer(self%store%pool(first:last), number, status)
      next_is_integer = status == number_ok .or. status == number_overflow
   end function next_is_integer

   !> Whether the next field is empty or not there.
   logical function next_is_empty(self)
      class(card_t), intent(in) :: self
      type(card_t) :: copy
      integer :: first, last
      copy%store => self%store
      copy%at_line = self%at_line
      copy%position = self%position
      copy%finish = self%finish
      call copy%take('', first, last)
      next_is_empty = first > last
   end function next_is_empty

end module rf_deck_card
