!> Errors, warnings and notes about what the user wrote: collected, so that one run shows them all; nothing here stops.
module rf_diagnostics
   use, intrinsic :: iso_fortran_env, only: error_unit
   use rf_grow, only: grown_capacity
   use rf_text, only: to_text, same_text
   implicit none
   private
   public :: place_t, new_place, diagnostics_t, message_t, is_error, is_warning, is_note, max_errors

   integer, parameter :: is_error = 1, is_warning = 2, is_note = 3
   !> errors kept; what comes after them is only counted (warnings and notes: the same number each)
   integer, parameter :: max_errors = 20
   !> longest piece of a line that a message shows [characters]
   integer, parameter :: shown_length = 120

   !> where in the user's text something stands. Build one with new_place: gfortran 12 writes beyond the end of texts
   !> of deferred length that a structure constructor sets.
   type :: place_t
      !> name of the file as the user knows it (not allocated: the matter has no place)
      character(len=:), allocatable :: file
      !> line in the file (0: the file as a whole)
      integer :: line = 0
      !> the line's text as the user wrote it
      character(len=:), allocatable :: text
   contains
      procedure :: label => place_label
   end type place_t

   !> one message
   type :: message_t
      !> is_error, is_warning or is_note
      integer :: kind = is_error
      type(place_t) :: place
      character(len=:), allocatable :: text
   contains
      procedure :: line => message_line
   end type message_t

   !> the messages so far
   type :: diagnostics_t
      !> how many of each there were (more errors than are kept: the rest is only counted)
      integer :: n_errors = 0, n_warnings = 0, n_notes = 0
      !> a file could not be read to its end (exit status 3 instead of 2)
      logical :: reading_failed = .false.
      !> messages kept, in the order in which they came
      integer :: n_messages = 0
      type(message_t), allocatable :: messages(:)
   contains
      procedure :: error => add_error
      procedure :: warning => add_warning
      procedure :: note => add_note
      procedure :: take_from
      procedure :: print => print_messages
      procedure :: contains_text
      procedure :: exit_status
      procedure, private :: add, by_place
   end type diagnostics_t

contains

   !> A place from its parts.
   pure function new_place(file, line, text) result(place)
      !> name of the file, as messages show it
      character(len=*), intent(in) :: file
      !> line in the file (0: the file as a whole)
      integer, intent(in) :: line
      !> the line's text
      character(len=*), intent(in), optional :: text
      type(place_t) :: place
      place%file = file
      place%line = line
      if (present(text)) place%text = text
   end function new_place

   !> 'case.inp:17', 'case.inp' or nothing.
   pure function place_label(self) result(label)
      class(place_t), intent(in) :: self
      character(len=:), allocatable :: label
      label = ''
      if (.not. allocated(self%file)) return
      label = self%file
      if (self%line > 0) label = label//':'//to_text(self%line)
   end function place_label

   !> The message as it is printed, without the line's text.
   pure function message_line(self) result(line)
      class(message_t), intent(in) :: self
      character(len=:), allocatable :: line
      character(len=*), parameter :: name(3) = ['error  ', 'warning', 'note   ']
      line = self%place%label()
      if (len(line) > 0) line = line//': '
      line = 'rfem: '//trim(name(self%kind))//': '//line//self%text
   end function message_line

   !> Something is wrong; the run will not start.
   subroutine add_error(self, place, text)
      class(diagnostics_t), intent(inout) :: self
      !> where (a default place_t: nowhere in particular)
      type(place_t), intent(in) :: place
      !> what is wrong and what is allowed
      character(len=*), intent(in) :: text
      self%n_errors = self%n_errors + 1
      if (self%n_errors <= max_errors) call self%add(is_error, place, text)
   end subroutine add_error

   !> Something is doubtful, but the run goes on.
   subroutine add_warning(self, place, text)
      class(diagnostics_t), intent(inout) :: self
      !> where
      type(place_t), intent(in) :: place
      !> what is doubtful
      character(len=*), intent(in) :: text
      self%n_warnings = self%n_warnings + 1
      if (self%n_warnings <= max_errors) call self%add(is_warning, place, text)
   end subroutine add_warning

   !> Something the user may like to know (skipped lines, turned triangles).
   subroutine add_note(self, place, text)
      class(diagnostics_t), intent(inout) :: self
      !> where
      type(place_t), intent(in) :: place
      !> what was done
      character(len=*), intent(in) :: text
      self%n_notes = self%n_notes + 1
      if (self%n_notes <= max_errors) call self%add(is_note, place, text)
   end subroutine add_note

   subroutine add(self, kind, place, text)
      class(diagnostics_t), intent(inout) :: self
      integer, intent(in) :: kind
      type(place_t), intent(in) :: place
      character(len=*), intent(in) :: text
      type(message_t), allocatable :: larger(:)
      integer :: n
      n = self%n_messages
      if (.not. allocated(self%messages)) allocate (self%messages(8))
      if (n == size(self%messages)) then
         allocate (larger(grown_capacity(n, n + 1)))
         larger(:n) = self%messages(:n)
         call move_alloc(larger, self%messages)
      end if
      n = n + 1
      self%messages(n)%kind = kind
      self%messages(n)%place = place
      self%messages(n)%text = text
      self%n_messages = n
   end subroutine add

   !> Take over all that another collection holds, which is empty afterwards.
   subroutine take_from(self, other)
      class(diagnostics_t), intent(inout) :: self
      !> where the messages come from
      type(diagnostics_t), intent(inout) :: other
      type(diagnostics_t) :: empty
      integer :: i, before
      before = self%n_errors
      do i = 1, other%n_messages
         associate (message => other%messages(i))
            if (message%kind == is_error) call self%error(message%place, message%text)
            if (message%kind == is_warning) call self%warning(message%place, message%text)
            if (message%kind == is_note) call self%note(message%place, message%text)
         end associate
      end do
      self%n_errors = before + other%n_errors
      self%reading_failed = self%reading_failed .or. other%reading_failed
      other = empty
   end subroutine take_from

   !> Print everything, in the order of the user's lines: the message and, under it, the line it is about.
   subroutine print_messages(self, unit)
      class(diagnostics_t), intent(in) :: self
      !> where to (default: the standard error)
      integer, intent(in), optional :: unit
      integer, allocatable :: order(:)
      integer :: i, to
      to = error_unit
      if (present(unit)) to = unit
      call self%by_place(order)
      do i = 1, size(order)
         associate (message => self%messages(order(i)))
            write (to, '(a)') message%line()
            if (allocated(message%place%text)) then
               if (len_trim(message%place%text) > 0) write (to, '(a)') '    '//cut_short(message%place%text)
            end if
         end associate
      end do
      if (self%n_errors > max_errors) &
         write (to, '(a)') 'rfem: error: '//to_text(self%n_errors - max_errors)//' more errors are not shown'
      flush (to)
   end subroutine print_messages

   !> Messages ordered by file (as the files first appear) and line; those of one line stay in the order they came in. What has no
   !> place mostly follows from what has one, and comes last.
   pure subroutine by_place(self, order)
      class(diagnostics_t), intent(in) :: self
      !> numbers of the messages
      integer, allocatable, intent(out) :: order(:)
      integer, parameter :: nowhere = huge(1)
      integer :: file(self%n_messages), i, j
      allocate (order(self%n_messages))
      do i = 1, self%n_messages
         associate (this => self%messages(i)%place)
            file(i) = nowhere
            if (.not. allocated(this%file)) cycle
            do j = 1, i - 1
               if (file(j) == nowhere) cycle ! .and. may look at both sides
               if (same_text(self%messages(file(j))%place%file, this%file)) exit
            end do
            file(i) = i
            if (j < i) file(i) = file(j)
         end associate
      end do
      do i = 1, self%n_messages ! insertion sort: there are few
         do j = i, 2, -1
            if (.not. comes_before(i, order(j - 1))) exit
            order(j) = order(j - 1)
         end do
         order(j) = i
      end do

   contains

      !> Whether message a stands further up than b.
      pure logical function comes_before(a, b)
         integer, intent(in) :: a, b
         comes_before = file(a) < file(b)
         if (file(a) == file(b)) comes_before = self%messages(a)%place%line < self%messages(b)%place%line
      end function comes_before
   end subroutine by_place

   !> A line's beginning, printable in any terminal: what is neither ASCII nor a tab is shown as it is only from 128 on.
   pure function cut_short(text) result(shown)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: shown
      integer :: i, code
      shown = text
      if (len(text) > shown_length) shown = text(:shown_length)//' ...'
      do i = 1, len(shown)
         code = iachar(shown(i:i))
         if (code == 127 .or. (code >= 0 .and. code < 32)) shown(i:i) = merge(' ', '?', code == 9)
      end do
   end function cut_short

   !> Whether a message of a kind holds a piece of text (tests ask this).
   pure logical function contains_text(self, piece, kind)
      class(diagnostics_t), intent(in) :: self
      !> looked for in the printed message
      character(len=*), intent(in) :: piece
      !> is_error (default), is_warning or is_note
      integer, intent(in), optional :: kind
      integer :: i, wanted
      wanted = is_error
      if (present(kind)) wanted = kind
      contains_text = .false.
      do i = 1, self%n_messages
         if (self%messages(i)%kind /= wanted) cycle
         if (index(self%messages(i)%line(), piece) > 0) contains_text = .true.
      end do
   end function contains_text

   !> Exit status that the errors call for: 0 none, 2 the deck is wrong, 3 reading failed.
   pure integer function exit_status(self)
      class(diagnostics_t), intent(in) :: self
      exit_status = merge(2, 0, self%n_errors > 0)
      if (self%reading_failed) exit_status = 3
   end function exit_status

end module rf_diagnostics
