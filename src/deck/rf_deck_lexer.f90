!> From the bytes of a deck to its blocks: lines, comments, keyword lines, *INCLUDE, *PARAMETER, steps.
!>
!> The rules are those of docs/deck.md. Every byte is looked at once; data lines are only found here, their fields are
!> taken apart when a reader asks for them.
module rf_deck_lexer
   use rf_deck_characters, only: take_line, character_problem, first_refused, letters, has_zero, has_angle
   use rf_deck_files, only: add_file, enter_file, refuse_loop
   use rf_deck_parameters, only: take_overrides, check_overrides, define_parameter, substitute
   use rf_deck_store, only: store_t, block_t, edit_t, add_block, add_edit, add_line, add_option, kind_index, pool_append, &
      index_blocks, before_steps, inside_step, after_steps
   use rf_diagnostics, only: place_t, new_place
   use rf_grow, only: grow
   use rf_text, only: add_text, file_folder, first_filled, last_filled, same_text, squeezed, to_text, upper
   implicit none
   private
   public :: lex_file, lex_text, standard_input

   !> name of a deck that comes from the standard input
   character(len=*), parameter :: standard_input = '<stdin>'
   !> longest line [characters]
   integer, parameter :: longest_line = 2000
   !> longest keyword line together with the lines that continue it [characters]
   integer, parameter :: longest_keyword = 20*longest_line
   !> most different keywords: a deck with more is no deck
   integer, parameter :: most_keywords = 500

   !> UTF-8 byte order mark
   character(len=*), parameter :: byte_order_mark = char(239)//char(187)//char(191)

   !> the kinds of blocks that the lexer itself reads
   integer, parameter :: block_none = 0, block_data = 1, block_heading = 2, block_parameter = 3, block_stray = 4

   !> where the lexer is
   type :: lexer_t
      integer :: file = 0, line = 0
      !> a keyword line, so far: its text, its line number and place in the pool; it goes on
      character(len=:), allocatable :: keyword
      integer :: keyword_line = 0, keyword_start = 1, keyword_finish = 0
      logical :: continues = .false., continued = .false.
      !> the open block
      integer :: block = block_none
      !> in a step; ordinal of the last one; its keyword line
      logical :: in_step = .false.
      integer :: step = 0
      type(place_t) :: step_place
   end type lexer_t

contains

   !> Read a deck from a file.
   subroutine lex_file(store, path, overrides)
      type(store_t), intent(inout) :: store
      !> the file; empty: the standard input
      character(len=*), intent(in) :: path
      !> NAME=VALUE, each replaces the value of a *PARAMETER
      character(len=*), intent(in) :: overrides(:)
      type(lexer_t) :: lexer
      character(len=:), allocatable :: name
      logical :: done
      name = path
      if (len(path) == 0) name = standard_input
      call take_overrides(store, overrides)
      call add_file(store, path, name, 0, done)
      if (done) call lex_all(store, lexer)
   end subroutine lex_file

   !> Read a deck from a text (a checkpoint, a test).
   subroutine lex_text(store, text, name, overrides)
      type(store_t), intent(inout) :: store
      !> the deck
      character(len=*), intent(in) :: text
      !> what messages call it
      character(len=*), intent(in) :: name
      !> NAME=VALUE, each replaces the value of a *PARAMETER
      character(len=*), intent(in) :: overrides(:)
      type(lexer_t) :: lexer
      character(len=:), allocatable :: bytes
      call take_overrides(store, overrides)
      bytes = text
      call enter_file(store, bytes, name, name, 0)
      call lex_all(store, lexer)
   end subroutine lex_text

   !> The whole deck, from its first file on.
   subroutine lex_all(store, lexer)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      call lex_lines(store, lexer, 1)
      if (lexer%in_step) call store%diagnostics%error(lexer%step_place, '*STEP has no *END STEP')
      store%n_steps = lexer%step
      call index_blocks(store)
      call check_overrides(store)
   end subroutine lex_all

   !> All lines of one file.
   recursive subroutine lex_lines(store, lexer, file)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      !> which file
      integer, intent(in) :: file
      integer :: place, last, start, finish, special, include_file, include_line
      logical :: stopped
      place = store%files(file)%first
      last = store%files(file)%last
      if (last - place >= 2) then
         if (store%pool(place:place + 2) == byte_order_mark) place = place + 3
         store%files(file)%first = place
      end if
      lexer%file = file
      lexer%line = 0
      stopped = .false.
      do while (place <= last .and. .not. stopped)
         call take_line(store%pool, last, place, start, finish, special)
         lexer%line = lexer%line + 1
         if (start > finish) cycle
         if (special /= 0 .or. finish - start >= longest_line) call check_line(store, lexer, start, finish, special, stopped)
         if (stopped) exit
         if (start > finish) cycle
         include_file = 0
         call lex_line(store, lexer, start, finish, iand(special, has_angle) /= 0, include_file)
         if (include_file == 0) cycle
         include_line = lexer%line
         call lex_lines(store, lexer, include_file)
         lexer%file = file
         lexer%line = include_line
      end do
      if (lexer%continues) then
         call store%diagnostics%error(keyword_place(store, lexer), 'the line ends with a comma, but the file ends after it')
         lexer%continues = .false.
         lexer%block = block_stray
      end if
   end subroutine lex_lines

   !> A line with something special: is that allowed where it stands?
   subroutine check_line(store, lexer, start, finish, special, stopped)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      integer, intent(in) :: start
      !> made smaller than start if the line is to be passed over
      integer, intent(inout) :: finish
      integer, intent(in) :: special
      !> the file is no text
      logical, intent(out) :: stopped
      logical :: free
      type(place_t) :: place
      integer :: i
      stopped = iand(special, has_zero) /= 0
      if (stopped) then
         place = new_place(store%files(lexer%file)%name, lexer%line)
         call store%diagnostics%error(place, 'a zero byte: this is no text file (binary, or UTF-16 instead of UTF-8)')
         return
      end if
      place = line_here(store, lexer, start, finish)
      if (finish - start >= longest_line) then
         if (letters(store%pool(start:finish)) > longest_line) then
            call store%diagnostics%error(place, 'the line has '//to_text(letters(store%pool(start:finish)))// &
               ' characters, at most '//to_text(longest_line)//' are allowed')
            call spoil(store, lexer, finish, start)
            return
         end if
      end if
      free = index(store%pool(start:finish), '**') == 1
      free = free .or. (lexer%block == block_heading .and. .not. lexer%continues .and. store%pool(start:start) /= '*')
      if (free) return
      i = first_refused(store%pool(start:finish))
      if (i == 0) return
      call store%diagnostics%error(place, character_problem(store%pool(start + i - 1:start + i - 1), i))
      call spoil(store, lexer, finish, start)
   end subroutine check_line

   !> Pass over a line that cannot be read, and do not let that cause further errors.
   subroutine spoil(store, lexer, finish, start)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      integer, intent(inout) :: finish
      integer, intent(in) :: start
      if (store%pool(start:start) == '*') then
         lexer%block = block_stray
      else if (store%n_blocks > 0) then
         store%blocks(store%n_blocks)%failed = .true.
      end if
      finish = start - 1
   end subroutine spoil

   !> One line that is not empty.
   subroutine lex_line(store, lexer, start, finish, angle, include_file)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      !> its first and last character
      integer, intent(in) :: start, finish
      !> it has a '<'
      logical, intent(in) :: angle
      !> file that it includes (0: none)
      integer, intent(inout) :: include_file
      if (store%pool(start:start) == '*') then
         if (finish > start) then
            if (store%pool(start + 1:start + 1) == '*') return ! a comment
         end if
         if (lexer%continues) call store%diagnostics%error(keyword_place(store, lexer), &
            'the line ends with a comma, but a keyword comes next')
         lexer%keyword = store%pool(start:finish)
         lexer%keyword_line = lexer%line
         lexer%keyword_start = start
         lexer%keyword_finish = finish
         lexer%continued = .false.
         call end_keyword_line(store, lexer, finish, include_file)
      else if (lexer%continues) then
         lexer%continued = .true.
         lexer%keyword = lexer%keyword//' '//store%pool(start:finish)
         call end_keyword_line(store, lexer, finish, include_file)
      else
         select case (lexer%block)
         case (block_data)
            if (angle) then
               call add_changed_line(store, lexer, start, finish)
            else
               call add_line(store, start, finish, lexer%line)
            end if
         case (block_heading)
            call add_text(store%heading, store%n_heading, store%pool(start:finish))
         case (block_parameter)
            call define_parameter(store, line_here(store, lexer, start, finish), lexer%file, start, finish)
         case (block_none)
            call store%diagnostics%error(line_here(store, lexer, start, finish), &
               'a data line before the first keyword; keywords begin with *, comments with **')
            lexer%block = block_stray
         case default ! block_stray: its keyword is wrong, which has been said
            continue
         end select
      end if
   end subroutine lex_line

   !> A keyword line, or a part of it, has been read: it goes on, or is complete.
   subroutine end_keyword_line(store, lexer, finish, include_file)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      !> last character of the line
      integer, intent(in) :: finish
      integer, intent(inout) :: include_file
      character(len=:), allocatable :: text
      integer :: n
      n = len(lexer%keyword)
      lexer%continues = lexer%keyword(n:n) == ',' .and. n <= longest_keyword
      if (lexer%continues) return
      if (n > longest_keyword) then
         call store%diagnostics%error(keyword_place(store, lexer), &
            'the keyword line with those that continue it has more than '//to_text(longest_keyword)//' characters')
         lexer%block = block_stray
         return
      end if
      text = lexer%keyword
      if (index(text, '<') > 0) call substitute(store, keyword_place(store, lexer), text)
      call take_keyword(store, lexer, text, finish, include_file)
   end subroutine end_keyword_line

   !> A complete keyword line: its block and its parameters.
   subroutine take_keyword(store, lexer, text, finish, include_file)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      character(len=*), intent(in) :: text
      !> last character of its last line
      integer, intent(in) :: finish
      integer, intent(inout) :: include_file
      type(block_t) :: block
      character(len=:), allocatable :: name
      integer :: cut, open_block
      call next_cut(text, 2, cut)
      name = upper(squeezed(text(2:cut - 1)))
      open_block = lexer%block
      lexer%block = block_stray
      if (len(name) == 0) then
         call store%diagnostics%error(keyword_place(store, lexer), 'a keyword must follow the *')
         return
      end if
      if (store%n_kinds >= most_keywords) then
         call store%diagnostics%error(keyword_place(store, lexer), 'more than '//to_text(most_keywords)//' different keywords')
         return
      end if
      block%first_option = store%n_options + 1
      call take_options(store, lexer, name, text, cut)
      block%last_option = store%n_options
      if (name == 'INCLUDE') then
         call include(store, lexer, block, finish, include_file)
         lexer%block = open_block ! the file's data lines belong to the keyword before
         return
      end if
      if (name == 'STEP') call begin_step(store, lexer)
      block%file = lexer%file
      block%line = lexer%keyword_line
      block%start = lexer%keyword_start
      block%finish = lexer%keyword_finish
      block%continued = lexer%continued
      block%first_line = store%n_lines + 1
      block%last_line = store%n_lines
      block%region = region(lexer)
      if (lexer%in_step) block%step = lexer%step
      call kind_index(store, name, block%kind)
      call add_block(store, block)
      lexer%block = block_data
      if (name == 'HEADING') lexer%block = block_heading
      if (name == 'PARAMETER') lexer%block = block_parameter
      if (name == 'END STEP') call end_step(store, lexer)
   end subroutine take_keyword

   !> Where the lexer is: before the steps, in one, or behind one.
   pure integer function region(lexer)
      type(lexer_t), intent(in) :: lexer
      region = before_steps
      if (lexer%step > 0) region = merge(inside_step, after_steps, lexer%in_step)
   end function region

   subroutine begin_step(store, lexer)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      if (lexer%in_step) call store%diagnostics%error(keyword_place(store, lexer), &
         '*STEP inside a step: the *END STEP of the *STEP at '//lexer%step_place%label()//' is missing')
      lexer%in_step = .true.
      lexer%step = lexer%step + 1
      lexer%step_place = keyword_place(store, lexer)
   end subroutine begin_step

   subroutine end_step(store, lexer)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      if (.not. lexer%in_step) call store%diagnostics%error(keyword_place(store, lexer), '*END STEP without a *STEP before it')
      lexer%in_step = .false.
   end subroutine end_step

   !> The parameters behind a keyword: NAME=VALUE or NAME, separated by commas.
   subroutine take_options(store, lexer, keyword, text, first_cut)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(in) :: lexer
      character(len=*), intent(in) :: keyword, text
      !> where the keyword ends
      integer, intent(in) :: first_cut
      character(len=:), allocatable :: name
      integer :: start, cut, equals, first, i
      name = ''
      first = store%n_options + 1
      start = first_cut + 1
      do while (start <= len(text))
         call next_cut(text, start, cut)
         equals = index(text(start:cut - 1), '=')
         if (equals == 0) equals = cut - start + 1
         name = upper(squeezed(text(start:start + equals - 2)))
         if (len(name) == 0) then
            if (equals <= cut - start .or. cut < len(text)) call store%diagnostics%error(keyword_place(store, lexer), &
               'a parameter of *'//keyword//' has no name: NAME=VALUE or NAME must stand between commas')
         else
            do i = first, store%n_options
               if (same_text(store%options(i)%name, name)) exit
            end do
            if (i <= store%n_options) then
               call store%diagnostics%error(keyword_place(store, lexer), 'parameter '//name//' is given twice')
            else
               call add_option(store, name)
               if (equals <= cut - start) store%options(store%n_options)%value = unquoted(text(start + equals:cut - 1))
            end if
         end if
         start = cut + 1
      end do
   end subroutine take_options

   !> Place of the next comma that is not within double quotes; behind the end if there is none.
   pure subroutine next_cut(text, start, cut)
      character(len=*), intent(in) :: text
      !> where to begin
      integer, intent(in) :: start
      integer, intent(out) :: cut
      logical :: quoted
      quoted = .false.
      do cut = start, len(text)
         if (text(cut:cut) == '"') quoted = .not. quoted
         if (text(cut:cut) == ',' .and. .not. quoted) return
      end do
      if (.not. quoted) return
      cut = start - 1 + index(text(start:), ',') ! quotes that never close are plain characters
      if (cut < start) cut = len(text) + 1
   end subroutine next_cut

   !> Without blanks and double quotes round it.
   pure function unquoted(text) result(value)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: value
      value = text(first_filled(text):last_filled(text))
      if (len(value) < 2) return
      if (value(1:1) == '"' .and. value(len(value):) == '"') value = value(2:len(value) - 1)
   end function unquoted

   !> *INCLUDE: read the file, tell the caller to go on in it.
   subroutine include(store, lexer, block, finish, include_file)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(inout) :: lexer
      !> has the parameters
      type(block_t), intent(in) :: block
      !> last character of the keyword line
      integer, intent(in) :: finish
      integer, intent(inout) :: include_file
      type(place_t) :: place
      character(len=:), allocatable :: path
      type(edit_t) :: edit
      logical :: done, wrong
      integer :: i
      wrong = .false.
      place = keyword_place(store, lexer)
      path = ''
      do i = block%first_option, block%last_option
         if (store%options(i)%name /= 'INPUT') then
            call store%diagnostics%error(place, '*INCLUDE has no parameter '//store%options(i)%name//'; it has INPUT')
            wrong = .true.
         else if (allocated(store%options(i)%value)) then
            path = store%options(i)%value
         end if
      end do
      store%n_options = block%first_option - 1
      if (wrong) return
      if (len(path) == 0) then
         call store%diagnostics%error(place, '*INCLUDE needs INPUT=file')
         return
      end if
      if (path(1:1) /= '/') path = file_folder(store%files(lexer%file)%name)//path
      call refuse_loop(store, place, lexer%file, path, done)
      if (.not. done) return
      call add_file(store, path, path, lexer%file, done, place)
      if (.not. done) return
      include_file = store%n_files
      edit%file = lexer%file
      edit%first = lexer%keyword_start
      edit%last = finish
      edit%included = include_file
      call add_edit(store, edit)
   end subroutine include

   !> A data line with a <NAME>: what stands for it goes to the end of the pool.
   subroutine add_changed_line(store, lexer, start, finish)
      type(store_t), intent(inout) :: store
      type(lexer_t), intent(in) :: lexer
      integer, intent(in) :: start, finish
      character(len=:), allocatable :: text
      integer :: n, new_start, new_finish
      text = store%pool(start:finish)
      call substitute(store, line_here(store, lexer, start, finish), text)
      call pool_append(store, text, new_start, new_finish)
      call add_line(store, new_start, new_finish, lexer%line)
      n = store%n_changed + 1
      call grow(store%changed_line, n)
      call grow(store%changed_start, n)
      call grow(store%changed_finish, n)
      store%n_changed = n
      store%changed_line(n) = store%n_lines
      store%changed_start(n) = start
      store%changed_finish(n) = finish
   end subroutine add_changed_line

   !> The keyword line as a place for a message.
   pure function keyword_place(store, lexer) result(place)
      type(store_t), intent(in) :: store
      type(lexer_t), intent(in) :: lexer
      type(place_t) :: place
      place = new_place(store%files(lexer%file)%name, lexer%keyword_line, store%pool(lexer%keyword_start:lexer%keyword_finish))
   end function keyword_place

   !> The present line as a place for a message.
   pure function line_here(store, lexer, start, finish) result(place)
      type(store_t), intent(in) :: store
      type(lexer_t), intent(in) :: lexer
      integer, intent(in) :: start, finish
      type(place_t) :: place
      place = new_place(store%files(lexer%file)%name, lexer%line, store%pool(start:finish))
   end function line_here

end module rf_deck_lexer
