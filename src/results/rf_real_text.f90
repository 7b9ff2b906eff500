!> Real numbers as text: the fewest digits that read back to the same number, as tables want them.
module rf_real_text
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_is_finite
   use rf_kinds, only: wp
   implicit none
   private
   public :: real_text, integer_text

   !> every decimal of so many digits survives being stored in binary; so many are always enough to tell two binary numbers apart
   integer, parameter :: digits_kept = 15, digits_enough = 17
   !> decimal exponents that are written without 'e'
   integer, parameter :: smallest_plain = -5, largest_plain = 15

contains

   !> Shortest text that reads back to the same number: 0.1, 106.2, 1.0, 2.5e-7, nan, -inf.
   function real_text(x) result(text)
      real(wp), intent(in) :: x
      character(len=:), allocatable :: text
      character(len=digits_enough) :: digits
      integer :: n, exponent
      if (ieee_is_nan(x)) then
         text = 'nan'
      else if (.not. ieee_is_finite(x)) then
         text = 'inf'
      else if (abs(x) <= 0.0_wp) then
         text = '0.0'
      else
         call shortest_digits(abs(x), digits, n, exponent)
         text = place_point(digits(:n), exponent)
      end if
      if (.not. ieee_is_nan(x) .and. sign(1.0_wp, x) < 0.0_wp) text = '-'//text
   end function real_text

   !> Integer as text.
   pure function integer_text(i) result(text)
      integer, intent(in) :: i
      character(len=:), allocatable :: text
      character(len=12) :: buffer
      write (buffer, '(i0)') i
      text = trim(buffer)
   end function integer_text

   !> The digits d1 d2 .. dn and exponent e of x = d1.d2..dn * 10^e.
   subroutine shortest_digits(x, digits, n, exponent)
      !> positive and finite
      real(wp), intent(in) :: x
      character(len=digits_enough), intent(out) :: digits
      !> digits that count
      integer, intent(out) :: n
      integer, intent(out) :: exponent
      character(len=32) :: buffer
      character(len=12) :: form
      real(wp) :: back
      integer :: status
      do n = digits_kept, digits_enough
         write (form, '(a, i0, a)') '(es32.', n - 1, 'e3)'
         write (buffer, form) x
         read (buffer, *, iostat=status) back
         if (status == 0 .and. abs(back - x) <= 0.0_wp) exit
      end do
      n = min(n, digits_enough)
      buffer = adjustl(buffer)
      digits = buffer(1:1)//buffer(3:n + 1)
      read (buffer(n + 3:), *) exponent
      do while (n > 1 .and. digits(n:n) == '0')
         n = n - 1
      end do
   end subroutine shortest_digits

   pure function place_point(digits, exponent) result(text)
      !> significant digits, the first not 0
      character(len=*), intent(in) :: digits
      !> of the first digit
      integer, intent(in) :: exponent
      character(len=:), allocatable :: text
      integer :: n
      n = len(digits)
      if (exponent < smallest_plain .or. exponent > largest_plain) then
         text = digits(1:1)
         if (n > 1) text = text//'.'//digits(2:)
         text = text//'e'//integer_text(exponent)
      else if (exponent < 0) then
         text = '0.'//repeat('0', -exponent - 1)//digits
      else if (n <= exponent + 1) then
         text = digits//repeat('0', exponent + 1 - n)//'.0'
      else
         text = digits(:exponent + 1)//'.'//digits(exponent + 2:)
      end if
   end function place_point
end module rf_real_text
