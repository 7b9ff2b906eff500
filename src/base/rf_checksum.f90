!> A checksum of bytes, to see whether a file is still what was written: it finds any change of a few bits, and of the rest all
!> but one in 2^64. Not against forgery; digests of results are rf_digest's.
!>
!> Source: J. G. Fletcher, An arithmetic checksum for serial transmissions, IEEE Trans. Comm. 30 (1982), with two sums of bytes
!> modulo a prime as in Adler-32 (RFC 1950), of 32 bits each. Sums over a block are formed without remainders, in any order.
module rf_checksum
   use rf_kinds, only: i8
   use rf_archive, only: archive_t
   implicit none
   private
   public :: checksum_t, checksum_of_file

   !> the largest prime below 2^32
   integer(i8), parameter :: prime = 4294967291_i8
   !> bytes of a block: its weighted sum is far below 2^63
   integer, parameter :: block_size = 65536

   type :: checksum_t
      private
      !> of the bytes; of the first sums
      integer(i8) :: first = 1, second = 0
   contains
      procedure :: add, hex, exchange
   end type checksum_t

contains

   !> Add bytes at the end.
   pure subroutine add(self, text)
      class(checksum_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer(i8) :: total, weighted, byte
      integer :: start, n, i
      do start = 0, len(text) - 1, block_size
         n = min(block_size, len(text) - start)
         total = 0
         weighted = 0
         do i = 1, n
            byte = ichar(text(start + i:start + i))
            total = total + byte
            weighted = weighted + (n - i + 1)*byte
         end do
         self%second = modulo(self%second + n*self%first + weighted, prime)
         self%first = modulo(self%first + total, prime)
      end do
   end subroutine add

   !> 16 hexadecimal digits.
   pure function hex(self) result(digits)
      class(checksum_t), intent(in) :: self
      character(len=16) :: digits
      write (digits, '(2z8.8)') self%second, self%first
   end function hex

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(checksum_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('first', self%first)
      call archive%exchange('second', self%second)
   end subroutine exchange

   !> Checksum of the first bytes of a file; `good` is false if it cannot be read so far.
   subroutine checksum_of_file(path, length, sum, good)
      character(len=*), intent(in) :: path
      !> bytes
      integer(i8), intent(in) :: length
      type(checksum_t), intent(out) :: sum
      logical, intent(out) :: good
      integer, parameter :: piece_size = 16*block_size
      character(len=:), allocatable :: piece
      integer(i8) :: done
      integer :: unit, n, status
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', iostat=status)
      good = status == 0
      if (.not. good) return
      allocate (character(len=piece_size) :: piece)
      done = 0
      do while (done < length .and. good)
         n = int(min(int(piece_size, i8), length - done))
         read (unit, iostat=status) piece(:n)
         good = status == 0
         if (good) call sum%add(piece(:n))
         done = done + n
      end do
      close (unit)
   end subroutine checksum_of_file
end module rf_checksum
