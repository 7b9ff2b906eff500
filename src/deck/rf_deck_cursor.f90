!> Going through the blocks of one keyword and through their data lines; where a message belongs.
module rf_deck_cursor
   use rf_deck_store, only: store_t, item_t, setting_t, add_item, add_setting, block_place, line_place, no_line, in_model, &
      before_steps, inside_step
   use rf_diagnostics, only: place_t
   use rf_text, only: to_text, is_blank
   implicit none
   private
   public :: cursor_t

   !> names of fields kept for the message about a field too many
   integer, parameter :: names_kept = 8, name_length = 24
   !> data lines of a block whose values --explain shows
   integer, parameter :: lines_shown = 100

   !> one block of a keyword (readers have it as card_t)
   type :: cursor_t
      !> ordinal of the step the block stands in (0: before the first); ordinal of the block among those of its keyword
      integer :: step = 0, number = 0
      !> the deck; which keyword and block of it; where the blocks looked for stand
      type(store_t), pointer :: store => null()
      integer :: kind = 0, block = 0, where = 0
      !> its data lines are too many to be shown as settings
      logical :: bulk = .false.
      !> present data line (0: none yet), it is being read, where its next field begins, where it ends
      integer :: data_line = 0
      logical :: at_line = .false.
      integer :: position = 1, finish = 0
      !> fields taken from it, their names, an error was found in it
      integer :: taken = 0
      character(len=name_length) :: taken_names(names_kept) = ''
      logical :: line_failed = .false.
      !> manual mode: block and line have been shown; form of data line that the next fields belong to
      logical :: shown = .false., line_shown = .false.
      character(len=:), allocatable :: form_name
   contains
      procedure :: begin, advance, line, needs_line, fields, form, skip_line, skip_lines, describing, failed, keyword
      procedure :: place, keyword_place, error, warning, note
      procedure :: take, keyword_error, record, describe_item
      procedure, private :: leave_line
   end type cursor_t

contains

   !> Start before the first block of a keyword (deck%open calls this).
   subroutine begin(self, store, kind, where, bulk)
      class(cursor_t), intent(inout) :: self
      !> the deck
      type(store_t), pointer, intent(in) :: store
      !> the keyword
      integer, intent(in) :: kind
      !> in_model, in_step or in_both
      integer, intent(in) :: where
      !> no settings from its data lines
      logical, intent(in) :: bulk
      self%store => store
      self%kind = kind
      self%where = where
      self%bulk = bulk
      self%step = 0
      self%number = 0
      self%block = 0
      self%data_line = 0
      self%at_line = .false.
      self%shown = .false.
      self%line_shown = .false.
      self%form_name = ''
   end subroutine begin

   !> Go to the next block that stands where it may; false when there is none.
   logical function advance(self) result(found)
      class(cursor_t), intent(inout) :: self
      call self%leave_line()
      self%data_line = 0
      if (self%store%manual) then
         found = .not. self%shown
         self%shown = .true.
         self%number = 1
         self%step = merge(0, 1, self%where == in_model)
         return
      end if
      associate (kind => self%store%kinds(self%kind))
         found = .false.
         do while (self%number < kind%n_blocks .and. .not. found)
            self%number = self%number + 1
            self%block = kind%blocks(self%number)
            found = iand(self%store%blocks(self%block)%region, self%where) /= 0
         end do
      end associate
      if (.not. found) return
      self%store%blocks(self%block)%opened = .true.
      self%step = self%store%blocks(self%block)%step
   end function advance

   !> Go to the next data line; false when there is none. Fields left over in the line before are an error.
   logical function line(self)
      class(cursor_t), intent(inout) :: self
      call self%leave_line()
      if (self%store%manual) then
         self%line_shown = .not. self%line_shown
         line = self%line_shown
         return
      end if
      associate (block => self%store%blocks(self%block))
         self%data_line = max(self%data_line + 1, block%first_line)
         line = self%data_line <= block%last_line
         if (.not. line) then
            self%data_line = block%last_line
            return
         end if
         block%lines_read = max(block%lines_read, self%data_line - block%first_line + 1)
      end associate
      self%at_line = .true.
      self%line_failed = .false.
      self%taken = 0
      self%position = self%store%line_start(self%data_line)
      self%finish = self%store%line_finish(self%data_line)
      if (self%store%pool(self%finish:self%finish) == ',') self%finish = self%finish - 1
   end function line

   !> As line, but that there is none is an error.
   logical function needs_line(self, what)
      class(cursor_t), intent(inout) :: self
      !> the fields that it has: 'E, nu'
      character(len=*), intent(in) :: what
      self%line_shown = .false.
      needs_line = self%line()
      if (.not. needs_line) call self%keyword_error('*'//self%keyword()//' needs a data line: '//what)
   end function needs_line

   !> Leave the present data line.
   subroutine leave_line(self)
      class(cursor_t), intent(inout) :: self
      character(len=:), allocatable :: names
      integer :: n, i
      if (.not. self%at_line) return
      if (self%position <= self%finish + 1 .and. .not. self%line_failed) then
         n = self%fields()
         names = ''
         do i = 1, min(self%taken, names_kept)
            names = names//merge(': ', ', ', i == 1)//trim(self%taken_names(i))
         end do
         call self%error('the line has '//to_text(n)//trim(merge(' field ', ' fields', n == 1))//', *'//self%keyword()// &
            ' takes at most '//to_text(self%taken)//names)
      end if
      self%at_line = .false.
   end subroutine leave_line

   !> Number of fields of the present data line (in manual mode 1).
   pure integer function fields(self)
      class(cursor_t), intent(in) :: self
      integer :: i
      fields = 1
      if (self%store%manual .or. .not. self%at_line) return
      do i = self%store%line_start(self%data_line), self%finish
         if (self%store%pool(i:i) == ',') fields = fields + 1
      end do
   end function fields

   !> Name the form of the data lines whose fields are read next (for the manual; a keyword with one form needs none).
   subroutine form(self, name)
      class(cursor_t), intent(inout) :: self
      !> as the manual shows it: 'with GENERATE'
      character(len=*), intent(in) :: name
      if (self%store%manual) self%form_name = name
   end subroutine form

   !> Accept the rest of the present data line unread.
   subroutine skip_line(self)
      class(cursor_t), intent(inout) :: self
      self%position = self%finish + 2
   end subroutine skip_line

   !> Accept the rest of the block's data lines unread.
   subroutine skip_lines(self)
      class(cursor_t), intent(inout) :: self
      self%at_line = .false.
      if (self%store%manual) return
      associate (block => self%store%blocks(self%block))
         block%lines_read = block%last_line - block%first_line + 1
         self%data_line = block%last_line
      end associate
   end subroutine skip_lines

   !> Whether the deck is being described, not read.
   pure logical function describing(self)
      class(cursor_t), intent(in) :: self
      describing = self%store%manual
   end function describing

   !> Whether an error was found in this block.
   pure logical function failed(self)
      class(cursor_t), intent(in) :: self
      failed = .false.
      if (self%block > 0) failed = self%store%blocks(self%block)%failed
   end function failed

   !> The keyword's name.
   pure function keyword(self) result(name)
      class(cursor_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = self%store%kinds(self%kind)%name
   end function keyword

   !> The present data line, else the keyword line.
   pure function place(self)
      class(cursor_t), intent(in) :: self
      type(place_t) :: place
      if (self%store%manual .or. self%block == 0) return
      if (self%at_line) then
         place = line_place(self%store, self%data_line)
      else
         place = block_place(self%store, self%block)
      end if
   end function place

   !> The keyword line.
   pure function keyword_place(self) result(place)
      class(cursor_t), intent(in) :: self
      type(place_t) :: place
      if (self%store%manual .or. self%block == 0) return
      place = block_place(self%store, self%block)
   end function keyword_place

   !> An error at the present data line, else at the keyword line.
   subroutine error(self, text)
      class(cursor_t), intent(inout) :: self
      !> what is wrong and what is allowed
      character(len=*), intent(in) :: text
      if (self%store%manual) return
      self%line_failed = .true.
      if (self%block > 0) self%store%blocks(self%block)%failed = .true.
      call self%store%diagnostics%error(self%place(), text)
   end subroutine error

   !> A warning at the present data line, else at the keyword line.
   subroutine warning(self, text)
      class(cursor_t), intent(inout) :: self
      !> what is doubtful
      character(len=*), intent(in) :: text
      if (.not. self%store%manual) call self%store%diagnostics%warning(self%place(), text)
   end subroutine warning

   !> A note at the present data line, else at the keyword line.
   subroutine note(self, text)
      class(cursor_t), intent(inout) :: self
      !> what was done
      character(len=*), intent(in) :: text
      if (.not. self%store%manual) call self%store%diagnostics%note(self%place(), text)
   end subroutine note

   !> An error at the keyword line.
   subroutine keyword_error(self, text)
      class(cursor_t), intent(inout) :: self
      !> what is wrong and what is allowed
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: hint
      if (self%store%manual) return
      hint = ''
      if (self%store%blocks(self%block)%continued) hint = ' (the keyword line ends with a comma, so the next line belongs to it)'
      self%store%blocks(self%block)%failed = .true.
      call self%store%diagnostics%error(self%keyword_place(), text//hint)
   end subroutine keyword_error

   !> The next field of the data line, without blanks round it; first > last if it is empty or missing.
   subroutine take(self, name, first, last)
      class(cursor_t), intent(inout) :: self
      !> what messages call it
      character(len=*), intent(in) :: name
      !> its place in the pool
      integer, intent(out) :: first, last
      first = self%position
      self%taken = self%taken + 1
      if (self%taken <= names_kept) self%taken_names(self%taken) = name
      last = first - 1
      if (.not. self%at_line .or. first > self%finish + 1) return
      associate (pool => self%store%pool)
         do last = first, self%finish
            if (pool(last:last) == ',') exit
         end do
         self%position = last + 1
         last = last - 1
         do while (first <= last)
            if (.not. is_blank(pool(first:first))) exit
            first = first + 1
         end do
         do while (last >= first)
            if (.not. is_blank(pool(last:last))) exit
            last = last - 1
         end do
      end associate
   end subroutine take

   !> Remember a value for --explain.
   subroutine record(self, name, value, is_field, is_default)
      class(cursor_t), intent(in) :: self
      !> parameter or field, its value as text
      character(len=*), intent(in) :: name, value
      !> it stands on a data line; it was not given
      logical, intent(in) :: is_field, is_default
      type(setting_t) :: setting
      if (is_field) then
         if (self%data_line - self%store%blocks(self%block)%first_line >= lines_shown) return
      end if
      setting%block = self%block
      setting%data_line = merge(self%data_line, no_line, is_field)
      setting%is_default = is_default
      setting%name = name
      setting%value = value
      call add_setting(self%store, setting)
   end subroutine record

   !> A row of the manual.
   subroutine describe_item(self, is_field, name, values, default, unit, about)
      class(cursor_t), intent(in) :: self
      !> a field of a data line, not a parameter
      logical, intent(in) :: is_field
      !> its name, what it may be, its default (empty: none)
      character(len=*), intent(in) :: name, values, default
      !> unit and meaning
      character(len=*), intent(in), optional :: unit, about
      type(item_t) :: item
      item%kind = self%kind
      item%is_field = is_field
      item%form = ''
      if (is_field .and. allocated(self%form_name)) item%form = self%form_name
      item%name = name
      item%values = values
      item%default = default
      item%unit = ''
      item%about = ''
      if (present(unit)) item%unit = unit
      if (present(about)) item%about = about
      call add_item(self%store, item)
   end subroutine describe_item

end module rf_deck_cursor
