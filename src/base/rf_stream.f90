!> A file as a stream of C's library: gfortran's own units keep quiet about a full disk, and know neither locks nor fsync. The
!> procedures return whether it went well; `last_reason` says why not, if it is asked at once. (All else that is called of C's
!> library: rf_system.)
module rf_stream
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_pointer, c_int, c_long, c_null_char, c_null_ptr, c_ptr, c_size_t
   use rf_kinds, only: i8
   implicit none
   private
   public :: stream_t, last_error, last_reason, reason_of

   !> the file is locked by another process: an error of `lock` (EWOULDBLOCK of Linux's errno.h)
   integer, parameter, public :: would_block = 11
   !> whence of fseek: from the beginning, from the end (stdio.h)
   integer(c_int), parameter :: from_beginning = 0_c_int, from_end = 2_c_int
   !> flock: alone, without waiting (sys/file.h)
   integer(c_int), parameter :: lock_alone = 6_c_int
   integer, parameter :: longest_reason = 256

   type :: stream_t
      type(c_ptr), private :: file = c_null_ptr
   contains
      procedure :: open => open_file
      procedure :: open_input, open_output, is_open
      procedure :: read => read_some
      procedure :: is_sound
      procedure :: write => write_text
      procedure :: flush => flush_stream
      procedure :: go_to, go_to_end, cut, sync, lock
      procedure :: close => close_stream
      procedure :: give_up
   end type stream_t

   interface
      function c_fopen(path, mode) bind(c, name='fopen') result(file)
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*), mode(*)
         type(c_ptr) :: file
      end function c_fopen
      function c_fdopen(descriptor, mode) bind(c, name='fdopen') result(file)
         import :: c_ptr, c_char, c_int
         integer(c_int), value :: descriptor
         character(kind=c_char), intent(in) :: mode(*)
         type(c_ptr) :: file
      end function c_fdopen
      function c_fread(buffer, size, number, file) bind(c, name='fread') result(got)
         import :: c_ptr, c_char, c_size_t
         character(kind=c_char), intent(inout) :: buffer(*)
         integer(c_size_t), value :: size, number
         type(c_ptr), value :: file
         integer(c_size_t) :: got
      end function c_fread
      function c_ferror(file) bind(c, name='ferror') result(status)
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_ferror
      function c_fwrite(text, size, number, file) bind(c, name='fwrite') result(done)
         import :: c_ptr, c_char, c_size_t
         character(kind=c_char), intent(in) :: text(*)
         integer(c_size_t), value :: size, number
         type(c_ptr), value :: file
         integer(c_size_t) :: done
      end function c_fwrite
      function c_fflush(file) bind(c, name='fflush') result(status)
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_fflush
      function c_fseek(file, offset, whence) bind(c, name='fseek') result(status)
         import :: c_ptr, c_int, c_long
         type(c_ptr), value :: file
         integer(c_long), value :: offset
         integer(c_int), value :: whence
         integer(c_int) :: status
      end function c_fseek
      function c_fileno(file) bind(c, name='fileno') result(descriptor)
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int) :: descriptor
      end function c_fileno
      function c_ftruncate(descriptor, length) bind(c, name='ftruncate') result(status)
         import :: c_int, c_long
         integer(c_int), value :: descriptor
         integer(c_long), value :: length
         integer(c_int) :: status
      end function c_ftruncate
      function c_fsync(descriptor) bind(c, name='fsync') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_fsync
      function c_flock(descriptor, how) bind(c, name='flock') result(status)
         import :: c_int
         integer(c_int), value :: descriptor, how
         integer(c_int) :: status
      end function c_flock
      function c_dup(descriptor) bind(c, name='dup') result(second)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: second
      end function c_dup
      function c_close(descriptor) bind(c, name='close') result(status)
         import :: c_int
         integer(c_int), value :: descriptor
         integer(c_int) :: status
      end function c_close
      function c_fclose(file) bind(c, name='fclose') result(status)
         import :: c_ptr, c_int
         type(c_ptr), value :: file
         integer(c_int) :: status
      end function c_fclose
      function c_errno_location() bind(c, name='__errno_location') result(place)
         import :: c_ptr
         type(c_ptr) :: place
      end function c_errno_location
      function c_strerror(number, text, length) bind(c, name='__xpg_strerror_r') result(status)
         import :: c_int, c_char, c_size_t
         integer(c_int), value :: number
         character(kind=c_char), intent(inout) :: text(*)
         integer(c_size_t), value :: length
         integer(c_int) :: status
      end function c_strerror
   end interface

contains

   !> Open a file (or, to read, a folder).
   logical function open_file(self, path, mode) result(good)
      class(stream_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      !> of fopen: r, r+, w, a
      character(len=*), intent(in) :: mode
      self%file = c_fopen(path//c_null_char, mode//c_null_char)
      good = c_associated(self%file)
   end function open_file

   !> Open the standard input; it is not to be closed.
   logical function open_input(self) result(good)
      class(stream_t), intent(inout) :: self
      self%file = c_fdopen(0_c_int, 'r'//c_null_char)
      good = c_associated(self%file)
   end function open_input

   !> Open the standard output; it is not to be closed. False also where there is none: then another file gets its number later.
   logical function open_output(self) result(good)
      class(stream_t), intent(inout) :: self
      self%file = c_fdopen(1_c_int, 'w'//c_null_char)
      good = c_associated(self%file)
   end function open_output

   pure logical function is_open(self)
      class(stream_t), intent(in) :: self
      is_open = c_associated(self%file)
   end function is_open

   !> Read as many characters as there are, and as have room: how many, 0 at the end or after an error (`is_sound`).
   integer(i8) function read_some(self, text) result(got)
      class(stream_t), intent(inout) :: self
      character(len=*), intent(inout) :: text
      got = int(c_fread(text, 1_c_size_t, len(text, c_size_t), self%file), i8)
   end function read_some

   !> Whether nothing has gone wrong so far.
   logical function is_sound(self)
      class(stream_t), intent(in) :: self
      is_sound = c_ferror(self%file) == 0
   end function is_sound

   logical function write_text(self, text) result(good)
      class(stream_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      good = c_fwrite(text, 1_c_size_t, len(text, c_size_t), self%file) == len(text, c_size_t)
   end function write_text

   !> Hand all that was written to the operating system.
   logical function flush_stream(self) result(good)
      class(stream_t), intent(inout) :: self
      good = c_fflush(self%file) == 0
   end function flush_stream

   !> Go to a place in the file.
   logical function go_to(self, place) result(good)
      class(stream_t), intent(inout) :: self
      !> characters before it
      integer(i8), intent(in) :: place
      good = c_fseek(self%file, int(place, c_long), from_beginning) == 0
   end function go_to

   logical function go_to_end(self) result(good)
      class(stream_t), intent(inout) :: self
      good = c_fseek(self%file, 0_c_long, from_end) == 0
   end function go_to_end

   !> Cut the file to a length.
   logical function cut(self, length) result(good)
      class(stream_t), intent(inout) :: self
      !> [characters]
      integer(i8), intent(in) :: length
      good = c_ftruncate(c_fileno(self%file), int(length, c_long)) == 0
   end function cut

   !> Wait until what was flushed lies on the disk.
   logical function sync(self) result(good)
      class(stream_t), intent(in) :: self
      good = c_fsync(c_fileno(self%file)) == 0
   end function sync

   !> Take the file for this process alone until it is closed, without waiting for it.
   logical function lock(self) result(good)
      class(stream_t), intent(in) :: self
      good = c_flock(c_fileno(self%file), lock_alone) == 0
   end function lock

   logical function close_stream(self) result(good)
      class(stream_t), intent(inout) :: self
      good = c_fclose(self%file) == 0
      self%file = c_null_ptr
   end function close_stream

   !> Close, whatever goes wrong; then cut the file, whatever the closing itself has still written.
   subroutine give_up(self, length)
      class(stream_t), intent(inout) :: self
      !> to cut it to (default: it is not cut) [characters]
      integer(i8), intent(in), optional :: length
      integer(c_int) :: second, status
      second = c_dup(c_fileno(self%file))
      status = c_fclose(self%file)
      self%file = c_null_ptr
      if (present(length)) status = c_ftruncate(second, int(length, c_long))
      status = c_close(second)
   end subroutine give_up

   !> Number of the error of the call that failed last (errno.h).
   integer function last_error() result(number)
      integer(c_int), pointer :: place
      call c_f_pointer(c_errno_location(), place)
      number = int(place)
   end function last_error

   !> What the system says of the call that failed last.
   function last_reason() result(reason)
      character(len=:), allocatable :: reason
      reason = reason_of(last_error())
   end function last_reason

   !> What the system says of an error.
   function reason_of(number) result(reason)
      !> as `last_error`
      integer, intent(in) :: number
      character(len=:), allocatable :: reason
      character(kind=c_char) :: text(longest_reason)
      integer :: i
      reason = ''
      if (c_strerror(int(number, c_int), text, int(longest_reason, c_size_t)) /= 0) return
      do i = 1, longest_reason
         if (text(i) == c_null_char) exit
         reason = reason//text(i)
      end do
   end function reason_of
end module rf_stream
