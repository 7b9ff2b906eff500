!> A digest of results: 64 bits that change with any bit of what was added and with its order. Two runs with the same
!> digest computed the same numbers, bit for bit.
!>
!> Source: FNV-1a, 64 bits (G. Fowler, L. C. Noll, K.-P. Vo; IETF draft-eastlake-fnv). Numbers enter with their lowest byte first,
!> so that the digest is the same on any machine. The product by the prime 2^40 + 435 is formed from 32-bit halves,
!> since a Fortran integer must not overflow.
module rf_digest
   use rf_kinds, only: wp, i8
   implicit none
   private
   public :: digest_t

   !> the 32 bits of a half
   integer(i8), parameter :: mask = int(z'FFFFFFFF', i8)
   !> FNV's offset basis, in halves
   integer(i8), parameter :: basis_high = int(z'CBF29CE4', i8), basis_low = int(z'84222325', i8)
   !> FNV's prime is 2^40 + prime_low: 2^40 is a shift of the low half by 8 into the high half
   integer(i8), parameter :: prime_low = 435_i8
   integer, parameter :: prime_shift = 8

   type :: digest_t
      private
      integer(i8) :: high = basis_high, low = basis_low
   contains
      generic :: add => add_reals, add_real_pairs, add_integers, add_integer_pairs, add_text
      procedure :: hex
      procedure, private :: add_reals, add_real_pairs, add_integers, add_integer_pairs, add_text
   end type digest_t

contains

   !> Add real numbers in their order.
   pure subroutine add_reals(self, values)
      class(digest_t), intent(inout) :: self
      !> what to add; -0 and 0 differ
      real(wp), intent(in) :: values(:)
      integer :: i
      do i = 1, size(values)
         call add_word(self%high, self%low, transfer(values(i), 0_i8), 8)
      end do
   end subroutine add_reals

   !> Add a real array of (component, entity), in memory order.
   pure subroutine add_real_pairs(self, values)
      class(digest_t), intent(inout) :: self
      !> what to add; -0 and 0 differ
      real(wp), intent(in) :: values(:, :)
      integer :: i
      do i = 1, size(values, 2)
         call self%add_reals(values(:, i))
      end do
   end subroutine add_real_pairs

   !> Add integers in their order.
   pure subroutine add_integers(self, values)
      class(digest_t), intent(inout) :: self
      !> what to add
      integer, intent(in) :: values(:)
      integer :: i
      do i = 1, size(values)
         call add_word(self%high, self%low, int(values(i), i8), 4)
      end do
   end subroutine add_integers

   !> Add an integer array of (component, entity), in memory order.
   pure subroutine add_integer_pairs(self, values)
      class(digest_t), intent(inout) :: self
      !> what to add
      integer, intent(in) :: values(:, :)
      integer :: i
      do i = 1, size(values, 2)
         call self%add_integers(values(:, i))
      end do
   end subroutine add_integer_pairs

   !> Add the characters of a text.
   pure subroutine add_text(self, text)
      class(digest_t), intent(inout) :: self
      !> what to add, trailing blanks included
      character(len=*), intent(in) :: text
      integer :: i
      do i = 1, len(text)
         call add_word(self%high, self%low, int(ichar(text(i:i)), i8), 1)
      end do
   end subroutine add_text

   !> The digest so far, 16 hexadecimal digits.
   pure function hex(self) result(digits)
      class(digest_t), intent(in) :: self
      character(len=16) :: digits
      write (digits, '(2z8.8)') self%high, self%low
   end function hex

   !> Add the lowest bytes of a word to a hash.
   pure subroutine add_word(high, low, word, bytes)
      !> halves of the hash
      integer(i8), intent(inout) :: high, low
      !> what to add
      integer(i8), intent(in) :: word
      !> how many of its bytes, from the lowest
      integer, intent(in) :: bytes
      integer(i8) :: product_low
      integer :: k
      do k = 0, bytes - 1
         low = ieor(low, ibits(word, 8*k, 8))
         product_low = low*prime_low
         high = iand(high*prime_low + shiftr(product_low, 32) + shiftl(low, prime_shift), mask)
         low = iand(product_low, mask)
      end do
   end subroutine add_word
end module rf_digest
