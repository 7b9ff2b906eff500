!> *PARAMETER, --set, and the <NAME>s that stand for their values.
module rf_deck_parameters
   use rf_deck_store, only: store_t, edit_t, parameter_t, add_edit, add_parameter
   use rf_diagnostics, only: place_t, max_errors
   use rf_kinds, only: wp
   use rf_number, only: read_real, number_ok, number_problem
   use rf_text, only: text_t, did_you_mean, same_text, squeezed, to_text, upper
   implicit none
   private
   public :: take_overrides, check_overrides, define_parameter, substitute

   !> longest line with the values in place [characters]
   integer, parameter :: longest_line = 2000
   !> longest name and value of a --set, which must fit a line [characters]
   integer, parameter :: longest_setting = 1900

contains

   !> Take the --set arguments apart.
   subroutine take_overrides(store, overrides)
      type(store_t), intent(inout) :: store
      character(len=*), intent(in) :: overrides(:)
      character(len=:), allocatable :: name, value
      integer :: i, cut
      name = ''
      allocate (store%overrides(size(overrides)))
      do i = 1, size(overrides)
         cut = index(overrides(i), '=')
         name = upper(squeezed(overrides(i)(:cut - 1)))
         value = squeezed(overrides(i)(cut + 1:))
         store%overrides(i)%name = name
         store%overrides(i)%value = value
         if (cut == 0) then
            call store%diagnostics%error(place_t(), '--set '//trim(overrides(i))//': must be NAME=VALUE')
            store%overrides(i)%used = .true.
         else if (len(name) + len(value) > longest_setting) then
            call store%diagnostics%error(place_t(), '--set '//name(:min(len(name), 60))//': more than '// &
               to_text(longest_setting)//' characters')
         else
            call check_parameter(store, place_t(), '--set '//name, value)
         end if
      end do
   end subroutine take_overrides

   !> Each --set must have found its *PARAMETER.
   subroutine check_overrides(store)
      type(store_t), intent(inout) :: store
      type(text_t), allocatable :: names(:)
      integer :: i
      call parameter_names(store, names)
      do i = 1, size(store%overrides)
         if (store%overrides(i)%used .or. store%diagnostics%reading_failed) cycle
         call store%diagnostics%error(place_t(), '--set '//store%overrides(i)%name//': the deck has no *PARAMETER of that name' &
            //did_you_mean(store%overrides(i)%name, names))
      end do
   end subroutine check_overrides

   !> A data line of *PARAMETER: NAME = number.
   subroutine define_parameter(store, place, file, start, finish)
      type(store_t), intent(inout) :: store
      !> the line
      type(place_t), intent(in) :: place
      !> its file, its first and last character in the pool
      integer, intent(in) :: file, start, finish
      type(parameter_t) :: parameter
      character(len=:), allocatable :: text
      integer :: cut, i
      parameter%place = place
      text = store%pool(start:finish)
      if (text(len(text):) == ',') text = text(:len(text) - 1)
      if (index(text, '<') > 0) call substitute(store, parameter%place, text)
      cut = index(text, '=')
      parameter%name = upper(squeezed(text(:cut - 1)))
      if (.not. is_name(parameter%name)) then
         call store%diagnostics%error(parameter%place, 'a line of *PARAMETER is NAME = number; a NAME has letters, digits and _')
         return
      end if
      do i = 1, store%n_parameters
         if (.not. same_text(store%parameters(i)%name, parameter%name)) cycle
         call store%diagnostics%error(parameter%place, 'parameter '//parameter%name//' is already defined at '// &
            store%parameters(i)%place%label())
         return
      end do
      parameter%value = squeezed(text(cut + 1:))
      call check_parameter(store, parameter%place, parameter%name, parameter%value)
      call override(store, file, start, finish, parameter)
      call add_parameter(store, parameter)
   end subroutine define_parameter

   !> The value of a --set takes the place of the deck's.
   subroutine override(store, file, start, finish, parameter)
      type(store_t), intent(inout) :: store
      !> the line: file, first and last character in the pool
      integer, intent(in) :: file, start, finish
      type(parameter_t), intent(inout) :: parameter
      type(edit_t) :: edit
      integer :: i
      do i = 1, size(store%overrides)
         if (.not. same_text(store%overrides(i)%name, parameter%name)) cycle
         store%overrides(i)%used = .true.
         parameter%value = store%overrides(i)%value
         parameter%overridden = .true.
      end do
      if (.not. parameter%overridden) return
      edit%file = file
      edit%first = start
      edit%last = finish
      edit%replacement = parameter%name//' = '//parameter%value
      call add_edit(store, edit)
   end subroutine override

   !> A parameter's value must be a number.
   subroutine check_parameter(store, place, name, value)
      type(store_t), intent(inout) :: store
      type(place_t), intent(in) :: place
      character(len=*), intent(in) :: name
      !> a harmless one on return if it was none
      character(len=:), allocatable, intent(inout) :: value
      real(wp) :: number
      integer :: status
      call read_real(value, number, status)
      if (status == number_ok) return
      call store%diagnostics%error(place, name//' = '''//value//''' '//number_problem(status, .false.))
      value = '1'
   end subroutine check_parameter

   !> Letters, digits and _, at least one.
   pure logical function is_name(text)
      character(len=*), intent(in) :: text
      is_name = len(text) > 0 .and. verify(text, 'ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_') == 0
   end function is_name

   !> Put a parameter's value where its <NAME> stands.
   subroutine substitute(store, place, text)
      type(store_t), intent(inout) :: store
      !> where the text stands
      type(place_t), intent(in) :: place
      character(len=:), allocatable, intent(inout) :: text
      character(len=:), allocatable :: done
      integer :: open, length
      done = ''
      do
         open = index(text, '<')
         if (open == 0) exit
         length = index(text(open:), '>')
         if (length == 0) then
            call store%diagnostics%error(place, 'a < without a >; <NAME> stands for the value of a *PARAMETER')
            text(open:open) = ' '
            exit
         end if
         done = done//text(:open - 1)//parameter_value(store, place, text(open + 1:open + length - 2))
         text = text(open + length:)
         if (len(done) > longest_line) then
            call store%diagnostics%error(place, 'with the values of its parameters the line has more than '// &
               to_text(longest_line)//' characters')
            done = done(:longest_line)
            text = ''
         end if
      end do
      text = done//text
   end subroutine substitute

   !> Value of a parameter; one that is unknown is an error and reads as 1.
   function parameter_value(store, place, written) result(value)
      type(store_t), intent(inout) :: store
      type(place_t), intent(in) :: place
      !> what stands between < and >
      character(len=*), intent(in) :: written
      character(len=:), allocatable :: value
      character(len=:), allocatable :: name
      type(text_t), allocatable :: names(:)
      integer :: i
      name = upper(squeezed(written))
      do i = 1, store%n_parameters
         if (.not. same_text(store%parameters(i)%name, name)) cycle
         value = store%parameters(i)%value
         return
      end do
      value = '1'
      allocate (names(0))
      if (store%diagnostics%n_errors < max_errors) call parameter_names(store, names)
      call store%diagnostics%error(place, '<'//name//'> is no *PARAMETER defined before this line'//did_you_mean(name, names))
   end function parameter_value

   subroutine parameter_names(store, names)
      type(store_t), intent(in) :: store
      type(text_t), allocatable, intent(out) :: names(:)
      integer :: i
      allocate (names(store%n_parameters))
      do i = 1, store%n_parameters
         names(i)%s = store%parameters(i)%name
      end do
   end subroutine parameter_names

end module rf_deck_parameters
