!> A checksum of bytes, to see whether a file is still what was written: every change within eight neighbouring bytes is found, and
!> of all others all but one in 2^64. Not against forgery; digests of results are rf_digest's.
!>
!> Source: the cyclic redundancy check CRC-64 of the .xz file format (version 1.1.0, section 6), polynomial of ECMA-182 with the
!> lowest bit first: the bytes are a polynomial over the field of two elements, the checksum its remainder. Eight bytes are
!> taken at a time, by tables: M. E. Kounavis, F. L. Berry, Novel table lookup-based algorithms for high-performance CRC generation,
!> IEEE Trans. Computers 57 (2008). Only exclusive or and shifts: no integer overflows.
module rf_checksum
   use rf_kinds, only: i8
   use rf_archive, only: archive_t
   implicit none
   private
   public :: checksum_t, checksum_of_file

   !> bytes read at a time
   integer, parameter :: piece_size = 1048576
   integer, parameter :: longest_reason = 256
   integer(i8), parameter :: byte_mask = 255_i8
   !> x^64 is the sum of these powers; the highest bit is the power 0
   integer(i8), parameter :: polynomial = ior(shiftl(int(z'C96C5795', i8), 32), int(z'D7870F42', i8))
   !> of the array constructor below only: no variable
   integer :: k
   !> one byte after 0 to 8 bits have been shifted out of it
   integer(i8), parameter :: bits_0(0:255) = [(int(k, i8), k=0, 255)]
   integer(i8), parameter :: bits_1(0:255) = ieor(shiftr(bits_0, 1), iand(-iand(bits_0, 1_i8), polynomial))
   integer(i8), parameter :: bits_2(0:255) = ieor(shiftr(bits_1, 1), iand(-iand(bits_1, 1_i8), polynomial))
   integer(i8), parameter :: bits_3(0:255) = ieor(shiftr(bits_2, 1), iand(-iand(bits_2, 1_i8), polynomial))
   integer(i8), parameter :: bits_4(0:255) = ieor(shiftr(bits_3, 1), iand(-iand(bits_3, 1_i8), polynomial))
   integer(i8), parameter :: bits_5(0:255) = ieor(shiftr(bits_4, 1), iand(-iand(bits_4, 1_i8), polynomial))
   integer(i8), parameter :: bits_6(0:255) = ieor(shiftr(bits_5, 1), iand(-iand(bits_5, 1_i8), polynomial))
   integer(i8), parameter :: bits_7(0:255) = ieor(shiftr(bits_6, 1), iand(-iand(bits_6, 1_i8), polynomial))
   !> remainders of one byte with 0 to 7 bytes of 0 behind it
   integer(i8), parameter :: behind_0(0:255) = ieor(shiftr(bits_7, 1), iand(-iand(bits_7, 1_i8), polynomial))
   integer(i8), parameter :: behind_1(0:255) = ieor(shiftr(behind_0, 8), behind_0(iand(behind_0, byte_mask)))
   integer(i8), parameter :: behind_2(0:255) = ieor(shiftr(behind_1, 8), behind_0(iand(behind_1, byte_mask)))
   integer(i8), parameter :: behind_3(0:255) = ieor(shiftr(behind_2, 8), behind_0(iand(behind_2, byte_mask)))
   integer(i8), parameter :: behind_4(0:255) = ieor(shiftr(behind_3, 8), behind_0(iand(behind_3, byte_mask)))
   integer(i8), parameter :: behind_5(0:255) = ieor(shiftr(behind_4, 8), behind_0(iand(behind_4, byte_mask)))
   integer(i8), parameter :: behind_6(0:255) = ieor(shiftr(behind_5, 8), behind_0(iand(behind_5, byte_mask)))
   integer(i8), parameter :: behind_7(0:255) = ieor(shiftr(behind_6, 8), behind_0(iand(behind_6, byte_mask)))

   type :: checksum_t
      private
      !> of the bytes so far; all bits are set before the first, so that leading bytes of 0 count
      integer(i8) :: remainder = not(0_i8)
   contains
      procedure :: add, hex, exchange
   end type checksum_t

contains

   !> Add bytes at the end.
   pure subroutine add(self, text)
      class(checksum_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      integer(i8) :: r
      integer :: i, n
      n = len(text) - mod(len(text), 8)
      r = self%remainder
      do i = 1, n, 8
         r = ieor(r, word(text(i:i + 7)))
         r = ieor(ieor(ieor(behind_7(ibits(r, 0, 8)), behind_6(ibits(r, 8, 8))), &
                       ieor(behind_5(ibits(r, 16, 8)), behind_4(ibits(r, 24, 8)))), &
                  ieor(ieor(behind_3(ibits(r, 32, 8)), behind_2(ibits(r, 40, 8))), &
                       ieor(behind_1(ibits(r, 48, 8)), behind_0(ibits(r, 56, 8)))))
      end do
      do i = n + 1, len(text)
         r = ieor(shiftr(r, 8), behind_0(iand(ieor(r, int(ichar(text(i:i)), i8)), byte_mask)))
      end do
      self%remainder = r
   end subroutine add

   !> Eight bytes, the first one lowest on any machine.
   pure integer(i8) function word(bytes)
      character(len=8), intent(in) :: bytes
      integer :: i
      word = 0
      do i = 1, 8
         word = ior(word, shiftl(int(ichar(bytes(i:i)), i8), 8*(i - 1)))
      end do
   end function word

   !> 16 hexadecimal digits.
   pure function hex(self) result(digits)
      class(checksum_t), intent(in) :: self
      character(len=16) :: digits
      write (digits, '(z16.16)') not(self%remainder)
   end function hex

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(checksum_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('remainder', self%remainder)
   end subroutine exchange

   !> Checksum of the first bytes of a file; `good` is false if it cannot be read so far.
   subroutine checksum_of_file(path, length, sum, good, reason)
      character(len=*), intent(in) :: path
      !> bytes
      integer(i8), intent(in) :: length
      type(checksum_t), intent(out) :: sum
      logical, intent(out) :: good
      !> why not
      character(len=:), allocatable, intent(out), optional :: reason
      character(len=:), allocatable :: piece
      character(len=longest_reason) :: words
      integer(i8) :: done
      integer :: unit, n, status
      words = ''
      open (newunit=unit, file=path, access='stream', form='unformatted', status='old', action='read', &
            iostat=status, iomsg=words)
      good = status == 0
      if (present(reason)) reason = trim(words)
      if (.not. good) return
      allocate (character(len=piece_size) :: piece)
      done = 0
      do while (done < length .and. good)
         n = int(min(int(piece_size, i8), length - done))
         read (unit, iostat=status, iomsg=words) piece(:n)
         good = status == 0
         if (good) call sum%add(piece(:n))
         done = done + n
      end do
      if (present(reason)) reason = trim(words)
      close (unit)
   end subroutine checksum_of_file
end module rf_checksum
