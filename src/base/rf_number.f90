!> Numbers from text, rounded correctly, in any Fortran or C form: 27.4E9, 27.4d9, .5, 1., -3+2 (Fortran: -300), 0x1p-3.
!>
!> A number of at most 2**53 with a power of ten of at most 22 is exact in two operations (W. Clinger, How to read
!> floating point numbers accurately, 1990); what is longer goes to C's strtod. NaN, infinity, overflow and anything
!> that follows the number are refused. No arithmetic here overflows, whatever the text.
module rf_number
   use, intrinsic :: iso_c_binding, only: c_char, c_double, c_null_char, c_null_ptr, c_ptr
   use rf_kinds, only: wp, i8
   use rf_text, only: upper
   implicit none
   private
   public :: read_real, read_integer, number_problem, number_ok, number_empty, number_junk, number_overflow, number_not_finite

   integer, parameter :: number_ok = 0, number_empty = 1, number_junk = 2, number_overflow = 3, number_not_finite = 4

   !> largest whole number up to which all are exact
   integer(i8), parameter :: exact_limit = 2_i8**53
   !> largest power of ten that is exact, and the table of them
   integer, parameter :: exact_power = 22
   real(wp), parameter :: power_of_ten(0:exact_power) = [1e0_wp, 1e1_wp, 1e2_wp, 1e3_wp, 1e4_wp, 1e5_wp, 1e6_wp, 1e7_wp, &
      1e8_wp, 1e9_wp, 1e10_wp, 1e11_wp, 1e12_wp, 1e13_wp, 1e14_wp, 1e15_wp, 1e16_wp, 1e17_wp, 1e18_wp, 1e19_wp, 1e20_wp, &
      1e21_wp, 1e22_wp]
   !> digits that fit a 64-bit whole number without a check
   integer, parameter :: digits_held = 18
   !> exponents beyond this are as good as infinite
   integer, parameter :: exponent_limit = 100000
   !> decimal exponent of the largest number, and the digits from which on it overflows (half a unit above huge)
   integer, parameter :: largest_exponent = 308
   character(len=*), parameter :: overflow_digits = '1797693134862315807937'

   !> what the first look at a number finds
   type :: decimal_t
      !> the digits as a whole number, the power of ten to multiply it with
      integer(i8) :: mantissa = 0
      integer :: power = 0
      !> exponent of the first digit that is not zero; place of it in the text; where the digits end (0: none)
      integer :: leading = 0, first = 0, last = 0
      logical :: negative = .false., all_held = .true.
   end type decimal_t

   interface
      function c_strtod(text, end) bind(c, name='strtod') result(value)
         import :: c_char, c_double, c_ptr
         character(kind=c_char), intent(in) :: text(*)
         type(c_ptr), value :: end
         real(c_double) :: value
      end function c_strtod
   end interface

contains

   !> Read a text without blanks round it as a real number.
   subroutine read_real(text, value, status)
      !> the number, no blanks
      character(len=*), intent(in) :: text
      !> its value, 0 if the status is not number_ok
      real(wp), intent(out) :: value
      !> number_ok, number_empty, number_junk, number_overflow or number_not_finite
      integer, intent(out) :: status
      type(decimal_t) :: number
      value = 0
      call take_apart(text, number, status)
      if (status /= number_ok) then
         if (status == number_junk) call read_rare(text, value, status)
         return
      end if
      if (number%first == 0) then
         if (number%negative) value = -value
      else if (number%all_held .and. number%mantissa <= exact_limit .and. abs(number%power) <= exact_power) then
         value = real(number%mantissa, wp)
         if (number%power >= 0) value = value*power_of_ten(number%power)
         if (number%power < 0) value = value/power_of_ten(-number%power)
         if (number%negative) value = -value
      else if (overflows(text, number)) then
         status = number_overflow
      else
         call read_long(text, value)
      end if
   end subroutine read_real

   !> One pass over sign, digits, point and exponent.
   subroutine take_apart(text, number, status)
      character(len=*), intent(in) :: text
      type(decimal_t), intent(out) :: number
      integer, intent(out) :: status
      integer :: i, digit, held, behind_point, n_digits
      logical :: point
      status = number_empty
      if (len(text) == 0) return
      status = number_junk
      i = 1
      if (text(1:1) == '-' .or. text(1:1) == '+') i = 2
      number%negative = text(1:1) == '-'
      point = .false.
      held = 0; behind_point = 0; n_digits = 0
      do i = i, len(text)
         digit = iachar(text(i:i)) - iachar('0')
         if (digit >= 0 .and. digit <= 9) then
            n_digits = n_digits + 1
            if (point) behind_point = behind_point + 1
            if (number%first == 0 .and. digit == 0) cycle
            if (number%first == 0) then
               number%first = i
               number%leading = -behind_point
            end if
            if (.not. point) number%leading = number%leading + 1
            if (held < digits_held) then
               number%mantissa = 10_i8*number%mantissa + int(digit, i8)
               held = held + 1
               number%power = -behind_point
            else if (digit /= 0) then
               number%all_held = .false.
            else if (.not. point) then
               number%power = number%power + 1
            end if
         else if (text(i:i) == '.' .and. .not. point) then
            point = .true.
         else
            exit
         end if
      end do
      if (n_digits == 0) return
      number%last = i - 1
      if (number%first > 0 .and. number%leading > 0) number%leading = number%leading - 1
      if (i <= len(text)) then
         call add_exponent(text(i:), number, status)
      else
         status = number_ok
      end if
   end subroutine take_apart

   !> The exponent: a letter E, D or Q and a whole number, or, as Fortran has it, a signed whole number.
   subroutine add_exponent(text, number, status)
      character(len=*), intent(in) :: text
      type(decimal_t), intent(inout) :: number
      integer, intent(inout) :: status
      integer :: i, first, exponent, digit
      i = 1
      if (scan(text(1:1), 'eEdDqQ') == 1) i = 2
      if (i > len(text)) return
      first = i
      if (text(i:i) == '+' .or. text(i:i) == '-') first = i + 1
      if (first > len(text) .or. (i == 1 .and. first == 1)) return
      exponent = 0
      do i = first, len(text)
         digit = iachar(text(i:i)) - iachar('0')
         if (digit < 0 .or. digit > 9) return
         exponent = min(10*exponent + digit, exponent_limit)
      end do
      if (text(first - 1:first - 1) == '-') exponent = -exponent
      number%power = number%power + exponent
      number%leading = number%leading + exponent
      status = number_ok
   end subroutine add_exponent

   !> Whether a number rounds to infinity; looks at the digits alone, so that nothing traps.
   pure logical function overflows(text, number)
      character(len=*), intent(in) :: text
      type(decimal_t), intent(in) :: number
      character(len=len(overflow_digits)) :: digits
      integer :: i, n
      overflows = number%leading > largest_exponent
      if (number%leading /= largest_exponent) return
      digits = repeat('0', len(digits))
      n = 0
      do i = number%first, number%last
         if (n == len(digits)) exit
         if (text(i:i) == '.') cycle
         n = n + 1
         digits(n:n) = text(i:i)
      end do
      overflows = digits >= overflow_digits
   end function overflows

   !> A number too long for the fast way, by C: written as C knows it, every digit kept.
   subroutine read_long(text, value)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      character(kind=c_char, len=len(text) + 2) :: buffer
      integer :: i, n
      n = 0
      do i = 1, len(text)
         if (i > 1 .and. (text(i:i) == '+' .or. text(i:i) == '-')) then
            if (scan(text(i - 1:i - 1), 'eEdDqQ') == 0) call put('e')
         end if
         call put(merge('e', text(i:i), scan(text(i:i), 'dDqQE') == 1))
      end do
      call put(c_null_char)
      value = real(c_strtod(buffer, c_null_ptr), wp)

   contains

      subroutine put(letter)
         character(len=1), intent(in) :: letter
         n = n + 1
         buffer(n:n) = letter
      end subroutine put
   end subroutine read_long

   !> What the decimal form does not cover: C's 0x1.8p3, and the words for what is no finite number.
   subroutine read_rare(text, value, status)
      character(len=*), intent(in) :: text
      real(wp), intent(inout) :: value
      integer, intent(inout) :: status
      character(len=:), allocatable :: word
      integer :: first, mark, exponent, digits
      word = upper(text)
      first = 1
      if (scan(word(1:1), '+-') == 1) first = 2
      word = word(first:)
      if (index(word, 'NAN') == 1 .or. word == 'INF' .or. word == 'INFINITY') status = number_not_finite
      if (index(word, '0X') /= 1) return
      mark = index(word, 'P')
      if (mark == 0) mark = len(word) + 1
      digits = verify(word(3:mark - 1), '0123456789ABCDEF.')
      if (digits /= 0 .or. scan(word(3:mark - 1), '0123456789ABCDEF') == 0 .or. mark > 60) return
      if (index(word, '.') /= index(word, '.', back=.true.)) return
      exponent = 0
      if (mark <= len(word)) then
         if (mark == len(word) .or. len(word) - mark > 8) return
         call read_integer(word(mark + 1:), exponent, digits)
         if (digits /= number_ok) return
      end if
      status = number_overflow
      if (exponent + 4*mark > largest_exponent) return
      status = number_ok
      call c_number(text, value)
   end subroutine read_rare

   !> As C reads it.
   subroutine c_number(text, value)
      character(len=*), intent(in) :: text
      real(wp), intent(out) :: value
      character(kind=c_char, len=len(text) + 1) :: buffer
      buffer = text//c_null_char
      value = real(c_strtod(buffer, c_null_ptr), wp)
   end subroutine c_number

   !> Read a text without blanks round it as a whole number.
   pure subroutine read_integer(text, value, status)
      !> the number, no blanks
      character(len=*), intent(in) :: text
      !> its value, 0 if the status is not number_ok
      integer, intent(out) :: value
      !> number_ok, number_empty, number_junk or number_overflow
      integer, intent(out) :: status
      integer(i8) :: sum
      integer :: i, first, digit
      value = 0
      status = number_empty
      if (len(text) == 0) return
      status = number_junk
      first = 1
      if (text(1:1) == '-' .or. text(1:1) == '+') first = 2
      if (first > len(text)) return
      sum = 0
      do i = first, len(text)
         digit = iachar(text(i:i)) - iachar('0')
         if (digit < 0 .or. digit > 9) return
         sum = min(10_i8*sum + int(digit, i8), int(huge(value), i8) + 1_i8)
      end do
      status = number_overflow
      if (sum > int(huge(value), i8)) return
      status = number_ok
      value = int(sum)
      if (text(1:1) == '-') value = -value
   end subroutine read_integer

   !> What is wrong with a text that did not read as a number: 'is no number', ...
   pure function number_problem(status, whole) result(problem)
      !> of read_real or read_integer
      integer, intent(in) :: status
      !> a whole number was asked for
      logical, intent(in) :: whole
      character(len=:), allocatable :: problem
      select case (status)
      case (number_ok)
         problem = ''
      case (number_empty)
         problem = 'is empty'
      case (number_overflow)
         problem = 'is too large to be held'
      case (number_not_finite)
         problem = 'is no finite number'
      case default
         problem = 'is no number'
         if (whole) problem = 'is no whole number'
      end select
   end function number_problem

end module rf_number
