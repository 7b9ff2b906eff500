!> What is done with the deck as a whole: what nobody has read, --explain, the manual's tables, the full text.
module rf_deck_report
   use rf_deck_store, only: store_t, setting_t, add_item, block_place, item_t, kind_index, line_place, no_line, in_model, &
      in_step, in_both, before_steps, inside_step
   use rf_diagnostics, only: place_t
   use rf_text, only: text_t, add_text, did_you_mean, joined, same_text, to_text
   implicit none
   private
   public :: check_all, describe_own, explain_deck, write_reference, text_of_deck, list_settings

   !> keywords that the deck mechanism itself reads
   character(len=*), parameter :: own_keywords(3) = [character(len=9) :: 'HEADING', 'PARAMETER', 'END STEP']

   !> what a comment of the full text quotes at most [characters]
   integer, parameter :: longest_comment = 1000

contains

   !> Keywords, parameters and data lines that nobody has read.
   subroutine check_all(store)
      type(store_t), intent(inout) :: store
      type(text_t), allocatable :: known(:)
      integer :: i
      call known_keywords(store, known)
      do i = 1, store%n_blocks
         call check_block(store, i, known)
      end do
   end subroutine check_all

   !> Every keyword that may be written.
   subroutine known_keywords(store, known)
      type(store_t), intent(inout) :: store
      type(text_t), allocatable, intent(out) :: known(:)
      integer :: i, n, kind
      do i = 1, size(own_keywords)
         call kind_index(store, trim(own_keywords(i)), kind)
         store%kinds(kind)%where = ior(in_both, 4)
      end do
      n = 0
      call add_text(known, n, 'INCLUDE')
      do i = 1, store%n_kinds
         if (store%kinds(i)%where == 0 .and. .not. store%kinds(i)%skipped .and. .not. allocated(store%kinds(i)%later)) cycle
         call add_text(known, n, store%kinds(i)%name)
      end do
      do i = n + 1, size(known)
         known(i)%s = '' ! near to no word
      end do
   end subroutine known_keywords

   !> One block: is its keyword known, may it stand here, has everything in it been read?
   subroutine check_block(store, block, known)
      type(store_t), intent(inout) :: store
      integer, intent(in) :: block
      type(text_t), intent(in) :: known(:)
      type(place_t) :: place
      logical :: first
      associate (this => store%blocks(block))
         associate (kind => store%kinds(this%kind))
            place = block_place(store, block)
            first = this%number == 1
            if (any(own_keywords == kind%name)) then
               if (kind%name == 'END STEP' .and. this%last_line >= this%first_line) call store%diagnostics%error(place, &
                  '*END STEP takes no data lines')
               call check_options(store, block, place)
            else if (kind%where > 0) then
               if (iand(kind%where, this%region) == 0) then
                  call store%diagnostics%error(place, wrong_region(kind%name, kind%where, this%region))
               else
                  call check_options(store, block, place)
                  call check_lines(store, block)
               end if
            else if (allocated(kind%later)) then
               if (first) call store%diagnostics%error(place, '*'//kind%name//' ('//kind%later// &
                  ') is not available in this version')
            else if (kind%skipped) then
               if (first) call store%diagnostics%note(place, '*'//kind%name//' is not used and skipped')
            else
               call store%diagnostics%error(place, '*'//kind%name//' is no keyword'//did_you_mean(kind%name, known, '*'))
            end if
         end associate
      end associate
   end subroutine check_block

   !> A keyword that stands where it may not.
   pure function wrong_region(name, where, region) result(text)
      character(len=*), intent(in) :: name
      integer, intent(in) :: where, region
      character(len=:), allocatable :: text
      if (region == before_steps) then
         text = '*'//name//' belongs in a step, between *STEP and *END STEP'
      else if (region == inside_step) then
         text = '*'//name//' belongs to the model, before the first *STEP'
      else if (where == in_model) then
         text = '*'//name//' stands behind a step; it belongs to the model, before the first *STEP'
      else
         text = '*'//name//' stands behind *END STEP; it belongs between *STEP and *END STEP'
      end if
   end function wrong_region

   !> Parameters that nobody asked for.
   subroutine check_options(store, block, place)
      type(store_t), intent(inout) :: store
      integer, intent(in) :: block
      type(place_t), intent(in) :: place
      character(len=:), allocatable :: text
      integer :: i
      associate (this => store%blocks(block), kind => store%kinds(store%blocks(block)%kind))
         do i = this%first_option, this%last_option
            if (store%options(i)%used) cycle
            text = ''
            text = '*'//kind%name//' has no parameter '//store%options(i)%name
            if (kind%n_known > 0) then
               text = text//'; it has '//joined(kind%known(:kind%n_known), ', ')// &
                  did_you_mean(store%options(i)%name, kind%known(:kind%n_known))
            end if
            if (this%continued) text = text//' (the keyword line ends with a comma, so the next line belongs to it)'
            call store%diagnostics%error(place, text)
         end do
      end associate
   end subroutine check_options

   !> Data lines that nobody read.
   subroutine check_lines(store, block)
      type(store_t), intent(inout) :: store
      integer, intent(in) :: block
      integer :: n, most
      associate (this => store%blocks(block), kind => store%kinds(store%blocks(block)%kind))
         n = this%last_line - this%first_line + 1
         most = this%lines_read
         if (n <= most .or. this%failed) return
         if (most == 0) then
            call store%diagnostics%error(line_place(store, this%first_line), '*'//kind%name//' takes no data lines')
         else
            call store%diagnostics%error(line_place(store, this%first_line + most), '*'//kind%name//' takes at most '// &
               to_text(most)//trim(merge(' data line ', ' data lines', most == 1)))
         end if
      end associate
   end subroutine check_lines

   !> Manual rows of the keywords that the mechanism itself reads.
   subroutine describe_own(store)
      type(store_t), intent(inout) :: store
      call own(store, 'HEADING', in_model, 'title of the case', -3)
      call row(store, 'HEADING', .true., 'title', 'free text, one or more lines', 'what the results files are titled with')
      call own(store, 'PARAMETER', in_both, '`<NAME>` stands for the number in any later keyword or data line; '// &
         '`--set NAME=VALUE` overrides it', -2)
      call row(store, 'PARAMETER', .true., 'NAME = number', 'letters, digits and _ = number', 'one a line')
      call own(store, 'INCLUDE', in_both, 'another file takes the place of this line', -1)
      call row(store, 'INCLUDE', .false., 'INPUT', 'text', &
         'file, relative to the deck that includes it, or to the working directory for a deck from the standard input')
   end subroutine describe_own

   subroutine own(store, name, where, about, order)
      type(store_t), intent(inout) :: store
      character(len=*), intent(in) :: name, about
      integer, intent(in) :: where, order
      integer :: kind
      call kind_index(store, name, kind)
      store%kinds(kind)%where = where
      store%kinds(kind)%about = about
      store%kinds(kind)%order = order
   end subroutine own

   subroutine row(store, keyword, is_field, name, values, about)
      type(store_t), intent(inout) :: store
      character(len=*), intent(in) :: keyword, name, values, about
      logical, intent(in) :: is_field
      type(item_t) :: item
      call kind_index(store, keyword, item%kind)
      item%is_field = is_field
      item%form = ''
      item%name = name
      item%values = values
      item%default = ''
      item%unit = ''
      item%about = about
      call add_item(store, item)
   end subroutine row

   !> Every setting with its origin, block by block; then the defaults that hold without their keyword.
   subroutine explain_deck(store, lines, manual)
      type(store_t), intent(in) :: store
      type(text_t), allocatable, intent(out) :: lines(:)
      !> a described deck
      type(store_t), intent(in) :: manual
      character(len=:), allocatable :: from
      integer :: block, i, n
      n = 0
      do i = 1, store%n_parameters
         associate (this => store%parameters(i))
            from = this%place%label()
            if (this%overridden) from = '--set, not '//from
            call add_text(lines, n, '*PARAMETER '//this%name//' = '//this%value//'   '//from)
         end associate
      end do
      call explain_settings(store, lines, n)
      do block = 1, manual%n_kinds
         associate (kind => manual%kinds(block))
            if (.not. kind%standing) cycle
            if (present_in(store, kind%name)) cycle
            call add_text(lines, n, '*'//kind%name//' (not in the deck)')
            do i = 1, manual%n_items
               if (manual%items(i)%kind /= block .or. len(manual%items(i)%default) == 0) cycle
               call add_text(lines, n, '   '//manual%items(i)%name//' = '//manual%items(i)%default//'   default')
            end do
         end associate
      end do
      if (.not. allocated(lines)) allocate (lines(0))
      lines = lines(:n)
   end subroutine explain_deck

   !> Whether the deck has a block of a keyword.
   pure logical function present_in(store, name)
      type(store_t), intent(in) :: store
      character(len=*), intent(in) :: name
      integer :: i
      present_in = .false.
      do i = 1, store%n_kinds
         if (same_text(store%kinds(i)%name, name)) present_in = store%kinds(i)%n_blocks > 0
      end do
   end function present_in

   !> The settings that were read, sorted by block.
   subroutine explain_settings(store, lines, n)
      type(store_t), intent(in) :: store
      type(text_t), allocatable, intent(inout) :: lines(:)
      !> how many there are
      integer, intent(inout) :: n
      integer, allocatable :: order(:)
      type(place_t) :: place
      integer :: i, block
      call settings_order(store, order)
      block = 0
      do i = 1, size(order)
         associate (this => store%settings(order(i)))
            if (this%block /= block) then
               block = this%block
               place = block_place(store, block)
               call add_text(lines, n, step_label(store, block)//'*'//store%kinds(store%blocks(block)%kind)%name//'   '// &
                             place%label())
            end if
            call add_text(lines, n, '   '//this%name//' = '//this%value//'   '//origin(store, this))
         end associate
      end do
   end subroutine explain_settings

   !> 'STEP 2: ' for a block in a step.
   pure function step_label(store, block) result(text)
      type(store_t), intent(in) :: store
      integer, intent(in) :: block
      character(len=:), allocatable :: text
      text = ''
      if (store%blocks(block)%step > 0) text = 'STEP '//to_text(store%blocks(block)%step)//': '
   end function step_label

   !> The deck's line, or 'default'.
   pure function origin(store, setting) result(text)
      type(store_t), intent(in) :: store
      type(setting_t), intent(in) :: setting
      character(len=:), allocatable :: text
      type(place_t) :: place
      text = 'default'
      if (setting%is_default) return
      place = block_place(store, setting%block)
      if (setting%data_line /= no_line) place = line_place(store, setting%data_line)
      text = place%label()
   end function origin

   !> Settings by block, then in the order of reading (counting sort); those read twice once.
   pure subroutine settings_order(store, order)
      type(store_t), intent(in) :: store
      integer, allocatable, intent(out) :: order(:)
      integer, allocatable :: start(:), all_settings(:)
      integer :: i, j, n, block
      allocate (start(store%n_blocks + 1), all_settings(store%n_settings))
      start = 0
      do i = 1, store%n_settings
         start(store%settings(i)%block + 1) = start(store%settings(i)%block + 1) + 1
      end do
      do i = 2, size(start)
         start(i) = start(i) + start(i - 1)
      end do
      do i = 1, store%n_settings
         block = store%settings(i)%block
         start(block) = start(block) + 1
         all_settings(start(block)) = i
      end do
      n = 0
      j = 0
      do i = 1, store%n_settings ! those of the present block are all_settings(j + 1:n); parameters only are read twice
         if (n > 0) then
            if (store%settings(all_settings(n))%block /= store%settings(all_settings(i))%block) j = n
         end if
         if (is_repeated(store, all_settings(j + 1:n), all_settings(i))) cycle
         n = n + 1
         all_settings(n) = all_settings(i)
      end do
      allocate (order(n))
      order(:) = all_settings(:n)
   end subroutine settings_order

   !> Whether a parameter's setting is among those listed.
   pure logical function is_repeated(store, listed, setting)
      type(store_t), intent(in) :: store
      integer, intent(in) :: listed(:), setting
      integer :: i
      is_repeated = .false.
      if (store%settings(setting)%data_line /= no_line) return
      do i = 1, size(listed)
         if (store%settings(listed(i))%data_line /= no_line) cycle
         if (same_text(store%settings(listed(i))%name, store%settings(setting)%name)) is_repeated = .true.
      end do
   end function is_repeated

   !> Every setting as three texts.
   subroutine list_settings(store, names, values, origins, manual)
      type(store_t), intent(in) :: store
      type(text_t), allocatable, intent(out) :: names(:), values(:), origins(:)
      !> a described deck: with it, defaults of keywords that hold without being in the deck are listed too
      type(store_t), intent(in), optional :: manual
      integer, allocatable :: order(:), standing(:)
      integer :: i, n
      call settings_order(store, order)
      allocate (standing(0))
      if (present(manual)) standing = standing_defaults(store, manual)
      n = store%n_parameters
      allocate (names(n + size(order) + size(standing)))
      allocate (values(size(names)), origins(size(names)))
      do i = 1, n
         names(i)%s = '*PARAMETER '//store%parameters(i)%name
         values(i)%s = store%parameters(i)%value
         origins(i)%s = store%parameters(i)%place%label()
         if (store%parameters(i)%overridden) origins(i)%s = '--set'
      end do
      do i = 1, size(order)
         associate (this => store%settings(order(i)))
            names(n + i)%s = step_label(store, this%block)//'*'//store%kinds(store%blocks(this%block)%kind)%name//' '//this%name
            values(n + i)%s = this%value
            origins(n + i)%s = origin(store, this)
         end associate
      end do
      n = n + size(order)
      do i = 1, size(standing)
         names(n + i)%s = '*'//manual%kinds(manual%items(standing(i))%kind)%name//' '//manual%items(standing(i))%name
         values(n + i)%s = manual%items(standing(i))%default
         origins(n + i)%s = 'default'
      end do
   end subroutine list_settings

   !> Items with a default of the keywords that hold without being in the deck, and are not in it.
   pure function standing_defaults(store, manual) result(items)
      type(store_t), intent(in) :: store, manual
      integer, allocatable :: items(:)
      logical :: wanted(manual%n_items)
      integer :: i
      do i = 1, manual%n_items
         wanted(i) = manual%kinds(manual%items(i)%kind)%standing .and. len(manual%items(i)%default) > 0
         if (wanted(i)) wanted(i) = .not. present_in(store, manual%kinds(manual%items(i)%kind)%name)
      end do
      items = pack([(i, i=1, manual%n_items)], wanted)
   end function standing_defaults

   !> The reference tables: model keywords, then step keywords.
   subroutine write_reference(store, unit)
      type(store_t), intent(in) :: store
      integer, intent(in) :: unit
      write (unit, '(a)') '## Model keywords', ''
      call write_group(store, unit, in_model)
      write (unit, '(a)') '## Step keywords', ''
      call write_group(store, unit, in_step)
   end subroutine write_reference

   !> The keywords that stand in the model, or in steps only, by their order numbers.
   subroutine write_group(store, unit, where)
      type(store_t), intent(in) :: store
      integer, intent(in) :: unit, where
      logical :: done(store%n_kinds)
      integer :: kind, i
      do i = 1, store%n_kinds
         done(i) = iand(store%kinds(i)%where, in_both) == 0 .or. ((where == in_model) .neqv. &
            iand(store%kinds(i)%where, in_model) > 0)
      end do
      do while (.not. all(done))
         kind = minloc(store%kinds(:store%n_kinds)%order, dim=1, mask=.not. done)
         done(kind) = .true.
         call write_keyword(store, unit, kind)
      end do
   end subroutine write_group

   !> One keyword: what it is for, its parameters, its data lines form by form.
   subroutine write_keyword(store, unit, kind)
      type(store_t), intent(in) :: store
      integer, intent(in) :: unit, kind
      character(len=:), allocatable :: form
      logical :: open
      integer :: i
      write (unit, '(a)') '### `*'//store%kinds(kind)%name//'`', ''
      if (allocated(store%kinds(kind)%about)) write (unit, '(a)') store%kinds(kind)%about, ''
      if (store%kinds(kind)%where == in_both) write (unit, '(a)') 'In the model and in steps.', ''
      open = .false.
      do i = 1, store%n_items
         if (store%items(i)%kind /= kind .or. store%items(i)%is_field) cycle
         if (.not. open) write (unit, '(a)') '| parameter | values | default | unit | meaning |', '|---|---|---|---|---|'
         open = .true.
         call write_row(unit, store%items(i))
      end do
      if (open) write (unit, '(a)') ''
      form = '(none yet)'
      do i = 1, store%n_items
         if (store%items(i)%kind /= kind .or. .not. store%items(i)%is_field) cycle
         if (.not. same_text(form, store%items(i)%form)) then
            if (form /= '(none yet)') write (unit, '(a)') ''
            form = store%items(i)%form
            if (len(form) > 0) write (unit, '(a)') 'Data lines '//form//':', ''
            write (unit, '(a)') '| field | values | default | unit | meaning |', '|---|---|---|---|---|'
         end if
         call write_row(unit, store%items(i))
      end do
      if (form /= '(none yet)') write (unit, '(a)') ''
   end subroutine write_keyword

   subroutine write_row(unit, item)
      integer, intent(in) :: unit
      type(item_t), intent(in) :: item
      character(len=:), allocatable :: default
      default = item%default
      if (len(default) == 0) default = 'required'
      write (unit, '(a)') '| '//item%name//' | '//trim(item%values)//' | '//default//' | '//item%unit//' | '//item%about//' |'
   end subroutine write_row

   !> The deck as one text.
   function text_of_deck(store) result(text)
      type(store_t), intent(in) :: store
      character(len=:), allocatable :: text
      text = ''
      if (store%n_files > 0) call append_file(store, 1, text)
   end function text_of_deck

   !> Append a file with what it includes; the pieces that are replaced become comments.
   recursive subroutine append_file(store, file, text)
      type(store_t), intent(in) :: store
      integer, intent(in) :: file
      character(len=:), allocatable, intent(inout) :: text
      integer :: i, place
      place = store%files(file)%first
      do i = 1, store%n_edits
         associate (edit => store%edits(i))
            if (edit%file /= file) cycle
            text = text//store%pool(place:edit%first - 1)
            place = edit%last + 1
            if (edit%included > 0) then
               text = text//'** *INCLUDE of '//shortened(store%files(edit%included)%name)//' begins'//new_line('a')
               call append_file(store, edit%included, text)
               if (text(len(text):) /= new_line('a')) text = text//new_line('a')
               text = text//'** *INCLUDE of '//shortened(store%files(edit%included)%name)//' ends'
            else
               text = text//edit%replacement//new_line('a')//'** --set replaced: '//shortened(store%pool(edit%first:edit%last))
            end if
         end associate
      end do
      text = text//store%pool(place:store%files(file)%last)
   end subroutine append_file

   !> At most so much that a comment with it is no line too long.
   pure function shortened(text) result(short)
      character(len=*), intent(in) :: text
      character(len=:), allocatable :: short
      short = text(:min(len(text), longest_comment))
   end function shortened

end module rf_deck_report
