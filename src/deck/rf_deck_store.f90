!> What a deck is in memory: one pool of text, and the places in it of files, data lines and keyword blocks.
!>
!> The pool holds the deck's file, then each included file, then lines that differ from the file's text because a
!> <NAME> was replaced. Data lines are places in it, not texts, so that a mesh of a million lines costs no allocation
!> per line. A deck_t and its card_t share one store through a pointer (a card must see the deck's later errors);
!> this is the only pointer of the deck layer.
module rf_deck_store
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_grow, only: grow
   use rf_text, only: text_t, same_text
   implicit none
   private
   public :: store_t, file_t, block_t, option_t, kind_t, item_t, setting_t, edit_t, parameter_t
   public :: add_line, add_block, add_option, add_edit, add_setting, add_parameter, add_item, pool_append, find_kind, &
      kind_index, file_of, line_place, block_place, index_blocks, request
   public :: in_model, in_step, in_both, before_steps, inside_step, after_steps, no_line

   !> where a keyword may stand; sums of them: the regions that it is read from
   integer, parameter :: in_model = 1, in_step = 2, in_both = 3
   !> where a block does stand
   integer, parameter :: before_steps = 1, inside_step = 2, after_steps = 4
   !> a setting that comes from no line: it is the default
   integer, parameter :: no_line = 0

   !> one file of the deck
   type :: file_t
      !> as messages name it; absolute path, to see loops
      character(len=:), allocatable :: name, real_path
      !> its bytes in the pool
      integer :: first = 1, last = 0
      !> file that includes it (0: the deck itself)
      integer :: parent = 0
   end type file_t

   !> one parameter of a keyword line
   type :: option_t
      !> NAME squeezed in capitals, value as written (not allocated: a flag)
      character(len=:), allocatable :: name, value
      !> somebody asked for it
      logical :: used = .false.
   end type option_t

   !> one keyword line with its data lines
   type :: block_t
      !> which keyword; how many of it came before, this one included
      integer :: kind = 0, number = 0
      !> its file and line; the place of that line in the pool
      integer :: file = 0, line = 0, start = 1, finish = 0
      !> the keyword line goes on over more lines
      logical :: continued = .false.
      !> its parameters and data lines
      integer :: first_option = 1, last_option = 0, first_line = 1, last_line = 0
      !> ordinal of its step (0: before the steps), region
      integer :: step = 0, region = before_steps
      !> data lines that somebody has read; an error was found in it; somebody has had it
      integer :: lines_read = 0
      logical :: failed = .false., opened = .false.
   end type block_t

   !> one keyword, as the deck has it and as the readers know it
   type :: kind_t
      character(len=:), allocatable :: name
      !> where it may stand (sum of in_model, in_step; 0: no reader knows it)
      integer :: where = 0
      !> said to come later or to be skipped: what for
      character(len=:), allocatable :: later
      logical :: skipped = .false.
      !> for the manual
      character(len=:), allocatable :: about
      integer :: order = 0
      logical :: standing = .false.
      !> names of the parameters that readers asked for
      type(text_t), allocatable :: known(:)
      integer :: n_known = 0
      !> its blocks, in order
      integer, allocatable :: blocks(:)
      integer :: n_blocks = 0
   end type kind_t

   !> one row of the manual: a parameter or a field of a data line
   type :: item_t
      integer :: kind = 0
      logical :: is_field = .false.
      !> form of the data line that the field belongs to (empty: there is one form only)
      character(len=:), allocatable :: form
      !> name, what it may be, default ('' none: required), unit, meaning
      character(len=:), allocatable :: name, values, default, unit, about
   end type item_t

   !> one value that was read, for --explain and the provenance
   type :: setting_t
      integer :: block = 0
      !> pool place of the data line it stands on (no_line: keyword line or default)
      integer :: data_line = no_line
      logical :: is_default = .false.
      character(len=:), allocatable :: name, value
   end type setting_t

   !> a piece of a file that the full text shows otherwise: *INCLUDE, or a parameter that --set replaced
   type :: edit_t
      integer :: file = 0, first = 1, last = 0
      !> included file (0: none), else the line that stands for it
      integer :: included = 0
      character(len=:), allocatable :: replacement
   end type edit_t

   !> one *PARAMETER
   type :: parameter_t
      character(len=:), allocatable :: name, value
      type(place_t) :: place
      logical :: overridden = .false.
   end type parameter_t

   !> one --set
   type :: override_t
      character(len=:), allocatable :: name, value
      logical :: used = .false.
   end type override_t

   !> the deck
   type :: store_t
      !> being described, not read
      logical :: manual = .false.
      !> what nobody has read has been reported
      logical :: checked = .false.
      !> messages of reading; deck%finish hands them on
      type(diagnostics_t) :: diagnostics
      character(len=:), allocatable :: pool
      integer :: pool_used = 0
      type(file_t), allocatable :: files(:)
      integer :: n_files = 0
      !> data lines: first and last character in the pool, number in their file
      integer, allocatable :: line_start(:), line_finish(:), line_number(:)
      integer :: n_lines = 0
      !> data lines with a <NAME>: which, and where they stand in their file
      integer, allocatable :: changed_line(:), changed_start(:), changed_finish(:)
      integer :: n_changed = 0
      type(block_t), allocatable :: blocks(:)
      integer :: n_blocks = 0
      type(option_t), allocatable :: options(:)
      integer :: n_options = 0
      type(kind_t), allocatable :: kinds(:)
      integer :: n_kinds = 0
      type(parameter_t), allocatable :: parameters(:)
      integer :: n_parameters = 0
      type(override_t), allocatable :: overrides(:)
      type(edit_t), allocatable :: edits(:)
      integer :: n_edits = 0
      type(setting_t), allocatable :: settings(:)
      integer :: n_settings = 0
      type(item_t), allocatable :: items(:)
      integer :: n_items = 0
      integer :: n_steps = 0
      !> the lines of *HEADING
      type(text_t), allocatable :: heading(:)
      integer :: n_heading = 0
   end type store_t

contains

   !> Room for n more characters in the pool.
   subroutine pool_room(store, n)
      type(store_t), intent(inout) :: store
      !> characters to come
      integer, intent(in) :: n
      character(len=:), allocatable :: larger
      if (.not. allocated(store%pool)) allocate (character(len=n) :: store%pool)
      if (store%pool_used + n <= len(store%pool)) return
      allocate (character(len=store%pool_used + max(n, store%pool_used/8)) :: larger)
      larger(:store%pool_used) = store%pool(:store%pool_used)
      call move_alloc(larger, store%pool)
   end subroutine pool_room

   !> Append a text to the pool.
   subroutine pool_append(store, text, start, finish)
      type(store_t), intent(inout) :: store
      character(len=*), intent(in) :: text
      !> its first and last place
      integer, intent(out) :: start, finish
      call pool_room(store, len(text))
      start = store%pool_used + 1
      finish = store%pool_used + len(text)
      store%pool(start:finish) = text
      store%pool_used = finish
   end subroutine pool_append

   !> Add a data line to the last block.
   subroutine add_line(store, start, finish, number)
      type(store_t), intent(inout) :: store
      !> first and last character in the pool, line in its file
      integer, intent(in) :: start, finish, number
      integer :: n
      n = store%n_lines + 1
      if (.not. allocated(store%line_start)) then
         allocate (store%line_start(64), store%line_finish(64), store%line_number(64))
      else if (n > size(store%line_start)) then
         call grow(store%line_start, n)
         call grow(store%line_finish, n)
         call grow(store%line_number, n)
      end if
      store%n_lines = n
      store%line_start(n) = start
      store%line_finish(n) = finish
      store%line_number(n) = number
      store%blocks(store%n_blocks)%last_line = n
   end subroutine add_line

   !> Add a block; the caller fills in the rest.
   subroutine add_block(store, block)
      type(store_t), intent(inout) :: store
      type(block_t), intent(in) :: block
      type(block_t), allocatable :: larger(:)
      if (.not. allocated(store%blocks)) allocate (store%blocks(32))
      if (store%n_blocks == size(store%blocks)) then
         allocate (larger(2*store%n_blocks))
         larger(:store%n_blocks) = store%blocks
         call move_alloc(larger, store%blocks)
      end if
      store%n_blocks = store%n_blocks + 1
      store%blocks(store%n_blocks) = block
   end subroutine add_block

   !> Add a parameter of a keyword line.
   subroutine add_option(store, name)
      type(store_t), intent(inout) :: store
      character(len=*), intent(in) :: name
      type(option_t), allocatable :: larger(:)
      integer :: i
      if (.not. allocated(store%options)) allocate (store%options(32))
      if (store%n_options == size(store%options)) then
         allocate (larger(2*store%n_options))
         do i = 1, store%n_options
            call move_alloc(store%options(i)%name, larger(i)%name)
            call move_alloc(store%options(i)%value, larger(i)%value)
         end do
         call move_alloc(larger, store%options)
      end if
      store%n_options = store%n_options + 1
      store%options(store%n_options)%name = name
      ! that of an *INCLUDE may stand there, whose parameters are done with
      if (allocated(store%options(store%n_options)%value)) deallocate (store%options(store%n_options)%value)
   end subroutine add_option

   !> Note a piece of a file that the full text shows otherwise.
   subroutine add_edit(store, edit)
      type(store_t), intent(inout) :: store
      type(edit_t), intent(in) :: edit
      type(edit_t), allocatable :: larger(:)
      if (.not. allocated(store%edits)) allocate (store%edits(8))
      if (store%n_edits == size(store%edits)) then
         allocate (larger(2*store%n_edits))
         larger(:store%n_edits) = store%edits
         call move_alloc(larger, store%edits)
      end if
      store%n_edits = store%n_edits + 1
      store%edits(store%n_edits) = edit
   end subroutine add_edit

   !> Note a *PARAMETER.
   subroutine add_parameter(store, parameter)
      type(store_t), intent(inout) :: store
      type(parameter_t), intent(in) :: parameter
      type(parameter_t), allocatable :: larger(:)
      if (.not. allocated(store%parameters)) allocate (store%parameters(8))
      if (store%n_parameters == size(store%parameters)) then
         allocate (larger(2*store%n_parameters))
         larger(:store%n_parameters) = store%parameters
         call move_alloc(larger, store%parameters)
      end if
      store%n_parameters = store%n_parameters + 1
      store%parameters(store%n_parameters) = parameter
   end subroutine add_parameter

   !> Note a value that was read.
   subroutine add_setting(store, setting)
      type(store_t), intent(inout) :: store
      type(setting_t), intent(in) :: setting
      type(setting_t), allocatable :: larger(:)
      integer :: i
      if (.not. allocated(store%settings)) allocate (store%settings(64))
      if (store%n_settings == size(store%settings)) then
         allocate (larger(2*store%n_settings))
         do i = 1, store%n_settings
            larger(i)%block = store%settings(i)%block
            larger(i)%data_line = store%settings(i)%data_line
            larger(i)%is_default = store%settings(i)%is_default
            call move_alloc(store%settings(i)%name, larger(i)%name)
            call move_alloc(store%settings(i)%value, larger(i)%value)
         end do
         call move_alloc(larger, store%settings)
      end if
      store%n_settings = store%n_settings + 1
      store%settings(store%n_settings) = setting
   end subroutine add_setting

   !> Note a row of the manual; a second one of the same name says nothing new and is left out.
   subroutine add_item(store, item)
      type(store_t), intent(inout) :: store
      type(item_t), intent(in) :: item
      type(item_t), allocatable :: larger(:)
      integer :: i
      if (.not. allocated(store%items)) allocate (store%items(64))
      do i = 1, store%n_items
         associate (old => store%items(i))
            if (old%kind == item%kind .and. (old%is_field .eqv. item%is_field) .and. same_text(old%name, item%name) &
               .and. same_text(old%form, item%form)) return
         end associate
      end do
      if (store%n_items == size(store%items)) then
         allocate (larger(2*store%n_items))
         larger(:store%n_items) = store%items
         call move_alloc(larger, store%items)
      end if
      store%n_items = store%n_items + 1
      store%items(store%n_items) = item
   end subroutine add_item

   !> Number of a keyword; 0 if neither the deck nor a reader has named it.
   pure integer function find_kind(store, name) result(kind)
      type(store_t), intent(in) :: store
      !> squeezed, in capitals
      character(len=*), intent(in) :: name
      do kind = store%n_kinds, 1, -1
         if (same_text(store%kinds(kind)%name, name)) return
      end do
   end function find_kind

   !> Number of a keyword, which is added if it is new.
   subroutine kind_index(store, name, kind)
      type(store_t), intent(inout) :: store
      !> squeezed, in capitals
      character(len=*), intent(in) :: name
      integer, intent(out) :: kind
      type(kind_t), allocatable :: larger(:)
      kind = find_kind(store, name)
      if (kind > 0) return
      if (.not. allocated(store%kinds)) allocate (store%kinds(64))
      if (store%n_kinds == size(store%kinds)) then
         allocate (larger(2*store%n_kinds))
         larger(:store%n_kinds) = store%kinds
         call move_alloc(larger, store%kinds)
      end if
      store%n_kinds = store%n_kinds + 1
      kind = store%n_kinds
      store%kinds(kind)%name = name
   end subroutine kind_index

   !> Give each keyword the list of its blocks.
   subroutine index_blocks(store)
      type(store_t), intent(inout) :: store
      integer :: i
      do i = 1, store%n_blocks
         associate (kind => store%kinds(store%blocks(i)%kind))
            call grow(kind%blocks, kind%n_blocks + 1)
            kind%n_blocks = kind%n_blocks + 1
            kind%blocks(kind%n_blocks) = i
            store%blocks(i)%number = kind%n_blocks
         end associate
      end do
   end subroutine index_blocks

   !> Somebody asks for a parameter: it is known from now on.
   subroutine request(store, kind, name)
      type(store_t), intent(inout) :: store
      !> the keyword
      integer, intent(in) :: kind
      !> the parameter
      character(len=*), intent(in) :: name
      type(text_t), allocatable :: larger(:)
      integer :: i
      associate (this => store%kinds(kind))
         if (.not. allocated(this%known)) allocate (this%known(8))
         do i = 1, this%n_known
            if (same_text(this%known(i)%s, name)) return
         end do
         if (this%n_known == size(this%known)) then
            allocate (larger(2*this%n_known))
            larger(:this%n_known) = this%known
            call move_alloc(larger, this%known)
         end if
         this%n_known = this%n_known + 1
         this%known(this%n_known)%s = name
      end associate
   end subroutine request

   !> File in which a place of the pool lies; 0 for a line with a <NAME> replaced.
   pure integer function file_of(store, start) result(file)
      type(store_t), intent(in) :: store
      !> a place in the pool
      integer, intent(in) :: start
      do file = store%n_files, 1, -1
         if (start >= store%files(file)%first .and. start <= store%files(file)%last) return
      end do
   end function file_of

   !> Where a data line stands.
   pure function line_place(store, line) result(place)
      type(store_t), intent(in) :: store
      !> which data line
      integer, intent(in) :: line
      type(place_t) :: place
      integer :: start, finish, low, high, middle
      start = store%line_start(line)
      finish = store%line_finish(line)
      low = 1
      high = store%n_changed
      do while (low <= high)
         middle = (low + high)/2
         if (store%changed_line(middle) == line) then
            start = store%changed_start(middle)
            finish = store%changed_finish(middle)
            exit
         else if (store%changed_line(middle) < line) then
            low = middle + 1
         else
            high = middle - 1
         end if
      end do
      place%file = store%files(max(1, file_of(store, start)))%name
      place%line = store%line_number(line)
      place%text = store%pool(start:finish)
   end function line_place

   !> Where a keyword line stands.
   pure function block_place(store, block) result(place)
      type(store_t), intent(in) :: store
      !> which block
      integer, intent(in) :: block
      type(place_t) :: place
      associate (this => store%blocks(block))
         place%file = store%files(this%file)%name
         place%line = this%line
         place%text = store%pool(this%start:this%finish)
      end associate
   end function block_place

end module rf_deck_store
