!> The parameters of a keyword line: each is read, checked, recorded and described by one call.
!>
!> Common arguments: `default` is the value if the parameter is not given (without it the parameter is required),
!> `shown` the text that stands for the default in the manual, `unit` and `about` are for the manual.
module rf_deck_options
   use rf_deck_bounds, only: within, bounds_text, harmless
   use rf_deck_cursor, only: cursor_t
   use rf_deck_store, only: request
   use rf_kinds, only: wp
   use rf_number, only: read_real, read_integer, number_ok, number_problem
   use rf_text, only: text_t, did_you_mean, has_word, joined, split, squeezed, to_text, upper
   implicit none
   private
   public :: options_t, choose

   type, extends(cursor_t) :: options_t
   contains
      procedure :: given, get_word, get_name, get_text, get_real, get_integer, get_flag, get_yes_no
      procedure, private :: find, missing, value_of
   end type options_t

contains

   !> Place of a parameter among the deck's; 0 if it is not given. From now on it is known for this keyword.
   integer function find(self, name) result(option)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      call request(self%store, self%kind, name)
      option = 0
      if (self%store%manual) return
      associate (block => self%store%blocks(self%block))
         do option = block%last_option, block%first_option, -1
            if (self%store%options(option)%name == name) exit
         end do
         if (option < block%first_option) option = 0
      end associate
      if (option > 0) self%store%options(option)%used = .true.
   end function find

   !> Whether a parameter is given (then somebody should also get it).
   logical function given(self, name)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      given = self%find(name) > 0
   end function given

   !> The text of a parameter; not found, or a value missing: false.
   logical function value_of(self, name, text) result(found)
      class(options_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: text
      integer :: option
      option = self%find(name)
      found = .false.
      text = ''
      if (option == 0) return
      if (allocated(self%store%options(option)%value)) text = self%store%options(option)%value
      found = len(text) > 0
      if (.not. found) call self%keyword_error('parameter '//name//' needs a value: '//name//'=...')
   end function value_of

   !> A parameter that must be given is not.
   subroutine missing(self, name, what)
      class(options_t), intent(inout) :: self
      character(len=*), intent(in) :: name, what
      if (self%given(name)) return ! then its value was missing, which has been said
      call self%keyword_error('*'//self%keyword()//' needs the parameter '//name//'='//what)
   end subroutine missing

   !> A word, in capitals, of those allowed.
   subroutine get_word(self, name, value, allowed, default, later, about, shown)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> the word
      character(len=:), allocatable, intent(out) :: value
      !> words separated by blanks or commas (not given: any word)
      character(len=*), intent(in), optional :: allowed
      character(len=*), intent(in), optional :: default
      !> words that a later version will know
      character(len=*), intent(in), optional :: later
      character(len=*), intent(in), optional :: about, shown
      character(len=:), allocatable :: text, problem
      if (self%store%manual) call describe_word(self, .false., name, allowed, default, about, shown)
      if (.not. self%value_of(name, text)) then
         value = fallback(allowed, default)
         if (.not. present(default)) call self%missing(name, words_text(allowed))
         if (present(default) .and. .not. self%store%manual) call self%record(name, value, .false., .true.)
         return
      end if
      call choose(upper(squeezed(text)), allowed, later, value, problem)
      call self%record(name, value, .false., .false.)
      if (len(problem) == 0) return
      call self%keyword_error(name//'='//text//' '//problem)
      value = fallback(allowed, default)
   end subroutine get_word

   !> Look a word up in the list of those allowed.
   subroutine choose(word, allowed, later, value, problem)
      !> squeezed, in capitals
      character(len=*), intent(in) :: word
      !> as in get_word
      character(len=*), intent(in), optional :: allowed, later
      !> the word
      character(len=:), allocatable, intent(out) :: value
      !> empty if it is allowed
      character(len=:), allocatable, intent(out) :: problem
      type(text_t), allocatable :: words(:)
      value = word
      problem = ''
      if (.not. present(allowed)) return
      if (has_word(allowed, word)) return
      call split(allowed, words)
      problem = 'is not known; allowed: '//joined(words, ', ')//did_you_mean(word, words)
      if (.not. present(later)) return
      if (has_word(later, word)) problem = 'is not available in this version; allowed: '//joined(words, ', ')
   end subroutine choose

   !> 'CPE3 or CPS3'
   function words_text(allowed) result(text)
      character(len=*), intent(in), optional :: allowed
      character(len=:), allocatable :: text
      type(text_t), allocatable :: words(:)
      text = 'word'
      if (.not. present(allowed)) return
      call split(allowed, words)
      text = joined(words, ' or ')
   end function words_text

   !> The default, else the first word allowed.
   function fallback(allowed, default) result(value)
      character(len=*), intent(in), optional :: allowed, default
      character(len=:), allocatable :: value
      type(text_t), allocatable :: words(:)
      value = ''
      if (present(default)) then
         value = default
      else if (present(allowed)) then
         call split(allowed, words)
         if (size(words) > 0) value = words(1)%s
      end if
   end function fallback

   !> Row of the manual for a word.
   subroutine describe_word(self, is_field, name, allowed, default, about, shown)
      class(cursor_t), intent(in) :: self
      logical, intent(in) :: is_field
      character(len=*), intent(in) :: name
      character(len=*), intent(in), optional :: allowed, default, about, shown
      character(len=:), allocatable :: text
      type(text_t), allocatable :: words(:)
      text = 'word'
      if (present(allowed)) then
         call split(allowed, words)
         text = joined(words, ', ')
      end if
      call self%describe_item(is_field, name, text, default_text(default, shown), about=about)
   end subroutine describe_word

   !> What the manual shows as default.
   function default_text(default, shown) result(text)
      character(len=*), intent(in), optional :: default, shown
      character(len=:), allocatable :: text
      text = ''
      if (present(default)) text = default
      if (present(default) .and. len(text) == 0) text = 'none'
      if (present(shown)) text = shown
   end function default_text

   !> A name of a set, material, ..., in capitals, its blanks squeezed.
   subroutine get_name(self, name, value, default, about, shown)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> the name
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default
      character(len=*), intent(in), optional :: about, shown
      character(len=:), allocatable :: text
      call read_text(self, name, 'name', text, default, about, shown)
      value = upper(squeezed(text))
   end subroutine get_name

   !> A text whose case is kept (file names).
   subroutine get_text(self, name, value, default, about, shown)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> the text
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default
      character(len=*), intent(in), optional :: about, shown
      call read_text(self, name, 'text', value, default, about, shown)
   end subroutine get_text

   !> What get_name and get_text share.
   subroutine read_text(self, name, what, value, default, about, shown)
      class(options_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> 'name' or 'text'
      character(len=*), intent(in) :: what
      character(len=:), allocatable, intent(out) :: value
      character(len=*), intent(in), optional :: default, about, shown
      if (self%store%manual) call self%describe_item(.false., name, what, default_text(default, shown), about=about)
      if (self%value_of(name, value)) then
         call self%record(name, value, .false., .false.)
      else
         value = ''
         if (present(default)) value = default
         if (.not. present(default)) call self%missing(name, what)
         if (present(default) .and. .not. self%store%manual) call self%record(name, default_text(default, shown), .false., .true.)
      end if
   end subroutine read_text

   !> A real number within bounds.
   subroutine get_real(self, name, value, default, above, below, at_least, at_most, unit, about, shown)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> the number
      real(wp), intent(out) :: value
      real(wp), intent(in), optional :: default
      !> bounds that it must be beyond, or may also be equal to
      real(wp), intent(in), optional :: above, below, at_least, at_most
      character(len=*), intent(in), optional :: unit, about, shown
      character(len=:), allocatable :: text, standard
      integer :: status
      value = harmless(above, below, at_least, at_most)
      standard = ''
      if (present(default)) then
         value = default
         standard = to_text(default)
      end if
      if (present(shown)) standard = shown
      if (self%store%manual) call self%describe_item(.false., name, &
         'number '//bounds_text(above, below, at_least, at_most), standard, unit, about)
      if (.not. self%value_of(name, text)) then
         if (.not. present(default)) call self%missing(name, 'number')
         if (present(default) .and. .not. self%store%manual) call self%record(name, standard, .false., .true.)
         return
      end if
      call self%record(name, text, .false., .false.)
      block
         real(wp) :: number
         call read_real(text, number, status)
         if (status /= number_ok) then
            call self%keyword_error(name//'='//text//' '//number_problem(status, .false.))
         else if (.not. within(number, above, below, at_least, at_most)) then
            call self%keyword_error(name//'='//text//' must be '//bounds_text(above, below, at_least, at_most))
         else
            value = number
         end if
      end block
   end subroutine get_real

   !> A whole number within bounds.
   subroutine get_integer(self, name, value, default, at_least, at_most, about, shown)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> the number
      integer, intent(out) :: value
      integer, intent(in), optional :: default
      !> bounds that it may be equal to
      integer, intent(in), optional :: at_least, at_most
      character(len=*), intent(in), optional :: about, shown
      character(len=:), allocatable :: text, standard
      integer :: status, number
      value = 1
      if (present(at_least)) value = max(value, at_least)
      if (present(at_most)) value = min(value, at_most)
      standard = ''
      if (present(default)) then
         value = default
         standard = to_text(default)
      end if
      if (present(shown)) standard = shown
      if (self%store%manual) call self%describe_item(.false., name, &
         'whole number '//whole_bounds(at_least, at_most), standard, about=about)
      if (.not. self%value_of(name, text)) then
         if (.not. present(default)) call self%missing(name, 'whole number')
         if (present(default) .and. .not. self%store%manual) call self%record(name, standard, .false., .true.)
         return
      end if
      call self%record(name, text, .false., .false.)
      call read_integer(text, number, status)
      if (status /= number_ok) then
         call self%keyword_error(name//'='//text//' '//number_problem(status, .true.))
      else if (.not. within(real(number, wp), at_least=bound(at_least, -huge(1)), at_most=bound(at_most, huge(1)))) then
         call self%keyword_error(name//'='//text//' must be '//whole_bounds(at_least, at_most))
      else
         value = number
      end if
   end subroutine get_integer

   !> A bound, or what bounds nothing.
   pure real(wp) function bound(given_bound, none)
      integer, intent(in), optional :: given_bound
      integer, intent(in) :: none
      bound = real(none, wp)
      if (present(given_bound)) bound = real(given_bound, wp)
   end function bound

   !> 'at least 1 and at most 5'
   pure function whole_bounds(at_least, at_most) result(text)
      integer, intent(in), optional :: at_least, at_most
      character(len=:), allocatable :: text
      text = ''
      if (present(at_least)) text = 'at least '//to_text(at_least)
      if (present(at_least) .and. present(at_most)) text = text//' and '
      if (present(at_most)) text = text//'at most '//to_text(at_most)
   end function whole_bounds

   !> A parameter without a value: given or not.
   subroutine get_flag(self, name, value, about)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> it is given
      logical, intent(out) :: value
      character(len=*), intent(in), optional :: about
      integer :: option
      if (self%store%manual) call self%describe_item(.false., name, '(no value)', 'not set', about=about)
      option = self%find(name)
      value = option > 0
      if (self%store%manual) return
      call self%record(name, trim(merge('set    ', 'not set', value)), .false., .not. value)
      if (.not. value) return
      if (allocated(self%store%options(option)%value)) call self%keyword_error('parameter '//name//' takes no value, but has '// &
         name//'='//self%store%options(option)%value)
   end subroutine get_flag

   !> YES or NO.
   subroutine get_yes_no(self, name, value, default, about)
      class(options_t), intent(inout) :: self
      !> the parameter
      character(len=*), intent(in) :: name
      !> YES
      logical, intent(out) :: value
      logical, intent(in), optional :: default
      character(len=*), intent(in), optional :: about
      character(len=:), allocatable :: word
      if (present(default)) then
         call self%get_word(name, word, 'YES NO', trim(merge('YES', 'NO ', default)), about=about)
      else
         call self%get_word(name, word, 'YES NO', about=about)
      end if
      value = word == 'YES'
   end subroutine get_yes_no

end module rf_deck_options
