!> A text file that is being written: buffered, with every failure kept as an error text, and able to delete itself, or what of
!> it was not finished when a write failed.
!>
!> It writes through C's stdio because gfortran's FLUSH and CLOSE keep quiet about a full disk (libgfortran 12 drops what the system
!> says). After the first failure further output is dropped; `flush` and `close` hand the error back.
module rf_text_file
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_int, c_long, c_null_char, c_null_ptr, c_ptr, &
      c_size_t
   use rf_kinds, only: i8
   use rf_archive, only: archive_t
   use rf_checksum, only: checksum_t, checksum_of_file
   use rf_system, only: refuse_large_files, remove_file, path_exists, last_error, last_reason, would_block
   use rf_text, only: to_text
   implicit none
   private

   !> characters collected before they go to the file
   integer, parameter :: buffer_size = 65536
   !> whence of fseek: from the beginning, from the end (stdio.h)
   integer(c_int), parameter :: from_beginning = 0_c_int, from_end = 2_c_int
   !> flock: alone, without waiting (sys/file.h)
   integer(c_int), parameter :: lock_alone = 6_c_int

   type, public :: text_file_t
      !> where it is
      character(len=:), allocatable :: path
      type(c_ptr), private :: stream = c_null_ptr
      logical, private :: opened = .false.
      !> this run made it, so `discard` may delete it
      logical, private :: made_here = .false.
      character(len=:), allocatable, private :: buffer
      !> characters in the buffer
      integer, private :: used = 0
      !> characters in the file; of those, the ones that a `flush` has handed on
      integer(i8), private :: written = 0, finished = 0
      !> the first error
      character(len=:), allocatable, private :: failure
      !> length that a checkpoint knows [characters]
      integer(i8), private :: kept = 0
      !> of all characters that went to the file, unless some of them have been overwritten since
      type(checksum_t), private :: sum
      logical, private :: sum_holds = .true.
   contains
      procedure :: create, append
      procedure :: exchange
      procedure :: go_on
      procedure :: put
      procedure :: put_line
      procedure :: position
      procedure :: overwrite
      procedure :: flush => flush_file
      procedure :: close => close_file
      procedure :: discard
      procedure :: is_open, is_empty
      procedure, private :: empty_buffer, note
   end type text_file_t

   interface
      function c_fopen(path, mode) bind(c, name='fopen') result(stream)
         import :: c_ptr, c_char
         character(kind=c_char), intent(in) :: path(*), mode(*)
         type(c_ptr) :: stream
      end function c_fopen
      function c_fwrite(text, size, number, stream) bind(c, name='fwrite') result(done)
         import :: c_ptr, c_char, c_size_t
         character(kind=c_char), intent(in) :: text(*)
         integer(c_size_t), value :: size, number
         type(c_ptr), value :: stream
         integer(c_size_t) :: done
      end function c_fwrite
      function c_fflush(stream) bind(c, name='fflush') result(status)
         import :: c_ptr, c_int
         type(c_ptr), value :: stream
         integer(c_int) :: status
      end function c_fflush
      function c_fseek(stream, offset, whence) bind(c, name='fseek') result(status)
         import :: c_ptr, c_int, c_long
         type(c_ptr), value :: stream
         integer(c_long), value :: offset
         integer(c_int), value :: whence
         integer(c_int) :: status
      end function c_fseek
      function c_fileno(stream) bind(c, name='fileno') result(descriptor)
         import :: c_ptr, c_int
         type(c_ptr), value :: stream
         integer(c_int) :: descriptor
      end function c_fileno
      function c_ftruncate(descriptor, length) bind(c, name='ftruncate') result(status)
         import :: c_int, c_long
         integer(c_int), value :: descriptor
         integer(c_long), value :: length
         integer(c_int) :: status
      end function c_ftruncate
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
      function c_fclose(stream) bind(c, name='fclose') result(status)
         import :: c_ptr, c_int
         type(c_ptr), value :: stream
         integer(c_int) :: status
      end function c_fclose
   end interface

contains

   !> Make the file; an existing one is replaced.
   subroutine create(this, path, error)
      class(text_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      integer(c_int) :: status
      call refuse_large_files()
      this%path = path
      allocate (character(len=buffer_size) :: this%buffer)
      this%stream = c_fopen(path//c_null_char, 'w'//c_null_char)
      this%opened = c_associated(this%stream)
      call this%note(this%opened, 'create')
      this%made_here = this%opened
      if (this%opened) status = c_flock(c_fileno(this%stream), lock_alone) ! so that no other run goes on with it
      if (allocated(this%failure)) error = this%failure
   end subroutine create

   !> Open an existing file to add to its end.
   subroutine append(this, path, error)
      class(text_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      call refuse_large_files()
      this%path = path
      allocate (character(len=buffer_size) :: this%buffer)
      this%stream = c_fopen(path//c_null_char, 'a'//c_null_char)
      this%opened = c_associated(this%stream)
      call this%note(this%opened, 'write to')
      if (allocated(this%failure)) error = this%failure
   end subroutine append

   !> To or from a checkpoint: how long the file is, and what is in it. (Derived: path, stream, opened, made_here, buffer, used,
   !> failure belong to the process; written, finished are kept.) What the checkpoint knows has to be on the disk before it.
   subroutine exchange(this, archive)
      class(text_file_t), intent(inout) :: this
      class(archive_t), intent(inout) :: archive
      character(len=:), allocatable :: error
      if (.not. archive%reading) then
         call this%flush(error)
         if (this%opened .and. .not. allocated(error)) call this%note(c_fsync(c_fileno(this%stream)) == 0, 'write to')
         if (allocated(this%failure)) call archive%fail(this%failure)
         this%kept = this%position()
      end if
      call archive%exchange('length', this%kept)
      call archive%exchange('sum_holds', this%sum_holds)
      call archive%enter('sum')
      call this%sum%exchange(archive)
      call archive%leave()
   end subroutine exchange

   !> Go on with the file of a checkpoint. To look only: it becomes this process's alone, and stays so, and nothing is changed. Then
   !> what was written after the checkpoint is cut off.
   subroutine go_on(this, path, look_only, error)
      class(text_file_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      !> only say whether it can be done
      logical, intent(in) :: look_only
      character(len=:), allocatable, intent(out) :: error
      integer(i8) :: length
      if (.not. path_exists(path)) then
         error = path//': is missing; the run cannot go on without it'
         return
      end if
      if (.not. this%opened) call open_alone(this, path)
      if (allocated(this%failure)) then
         error = this%failure
         return
      end if
      inquire (file=path, size=length)
      if (length < this%kept) then
         error = path//': has '//to_text(length)//' bytes, the checkpoint knows '//to_text(this%kept)// &
                 '; the run cannot go on with it'
         return
      end if
      if (look_only) then
         if (.not. this%sum_holds) return
         if (was_changed(this, path)) error = path//': the '//to_text(this%kept)//' bytes that the checkpoint knows '// &
                                              'were changed since; the run cannot go on with it'
         return
      end if
      call this%note(c_ftruncate(c_fileno(this%stream), int(this%kept, c_long)) == 0, 'write to')
      call this%note(c_fseek(this%stream, 0_c_long, from_end) == 0, 'write to')
      this%written = this%kept
      this%finished = this%kept
      this%used = 0
      if (allocated(this%failure)) error = this%failure
   end subroutine go_on

   !> Open a file that is there, which nobody else may be writing. (A file system without locks tells nothing of others.)
   subroutine open_alone(this, path)
      type(text_file_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      integer(c_int) :: status
      call refuse_large_files()
      this%path = path
      if (.not. allocated(this%buffer)) allocate (character(len=buffer_size) :: this%buffer)
      this%stream = c_fopen(path//c_null_char, 'r+'//c_null_char)
      this%opened = c_associated(this%stream)
      call this%note(this%opened, 'write to')
      if (.not. this%opened) return
      if (c_flock(c_fileno(this%stream), lock_alone) == 0) return
      if (last_error() /= would_block) return
      this%failure = this%path//': is being written by another run'
      status = c_fclose(this%stream)
      this%opened = .false.
   end subroutine open_alone

   !> Whether the file does not begin with what the checkpoint knows of it.
   logical function was_changed(this, path)
      type(text_file_t), intent(in) :: this
      character(len=*), intent(in) :: path
      type(checksum_t) :: found, known
      logical :: good
      known = this%sum
      call checksum_of_file(path, this%kept, found, good)
      was_changed = .not. good .or. found%hex() /= known%hex()
   end function was_changed

   !> Keep the first error. Call it right after the failing call.
   subroutine note(this, good, what)
      class(text_file_t), intent(inout) :: this
      !> the call went well
      logical, intent(in) :: good
      !> what was tried with the file: create, write to, finish
      character(len=*), intent(in) :: what
      if (good .or. allocated(this%failure)) return
      this%failure = this%path//': cannot '//what//' this file: '//last_reason()
   end subroutine note

   !> Add text at the end.
   subroutine put(this, text)
      class(text_file_t), intent(inout) :: this
      character(len=*), intent(in) :: text
      integer :: done, n
      if (.not. this%opened) return
      done = 0
      do while (done < len(text))
         if (this%used == buffer_size) call this%empty_buffer()
         n = min(len(text) - done, buffer_size - this%used)
         this%buffer(this%used + 1:this%used + n) = text(done + 1:done + n)
         this%used = this%used + n
         done = done + n
      end do
   end subroutine put

   !> Add text and an end of line.
   subroutine put_line(this, text)
      class(text_file_t), intent(inout) :: this
      character(len=*), intent(in) :: text
      call this%put(text)
      call this%put(new_line('a'))
   end subroutine put_line

   subroutine empty_buffer(this)
      class(text_file_t), intent(inout) :: this
      integer(c_size_t) :: done
      if (this%used > 0 .and. .not. allocated(this%failure)) then
         done = c_fwrite(this%buffer, 1_c_size_t, int(this%used, c_size_t), this%stream)
         call this%note(done == this%used, 'write to')
         this%written = this%written + this%used
         if (this%sum_holds) call this%sum%add(this%buffer(:this%used))
      end if
      this%used = 0
   end subroutine empty_buffer

   !> Where the next text goes [characters from 0]: for `overwrite`.
   pure integer(i8) function position(this)
      class(text_file_t), intent(in) :: this
      position = this%written + this%used
   end function position

   !> Replace characters that were written before.
   subroutine overwrite(this, place, text)
      class(text_file_t), intent(inout) :: this
      !> a former `position`
      integer(i8), intent(in) :: place
      character(len=*), intent(in) :: text
      integer(c_size_t) :: done
      call this%empty_buffer()
      this%sum_holds = .false.
      if (.not. this%opened .or. allocated(this%failure)) return
      call this%note(c_fseek(this%stream, int(place, c_long), from_beginning) == 0, 'write to')
      if (allocated(this%failure)) return
      done = c_fwrite(text, 1_c_size_t, len(text, c_size_t), this%stream)
      call this%note(done == len(text), 'write to')
      call this%note(c_fseek(this%stream, 0_c_long, from_end) == 0, 'write to')
   end subroutine overwrite

   !> Hand all that was put to the operating system.
   subroutine flush_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%empty_buffer()
      if (this%opened .and. .not. allocated(this%failure)) call this%note(c_fflush(this%stream) == 0, 'write to')
      if (.not. allocated(this%failure)) this%finished = this%written
      if (allocated(this%failure)) error = this%failure
   end subroutine flush_file

   !> Write the rest and close. Nothing to do for a closed file.
   subroutine close_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      if (.not. this%opened) return
      call this%flush(error)
      call this%note(c_fclose(this%stream) == 0, 'finish')
      this%opened = .false.
      if (allocated(this%failure)) error = this%failure
   end subroutine close_file

   !> Close and delete the file, if this run made it; errors do not matter any more. What is kept ends with what the last
   !> successful `flush` has handed on, whatever the closing itself still writes.
   subroutine discard(this, keep)
      class(text_file_t), intent(inout) :: this
      !> leave what is finished instead of deleting the file (default: no)
      logical, intent(in), optional :: keep
      integer(c_int) :: second, status
      logical :: kept, gone
      if (.not. this%opened) return
      second = c_dup(c_fileno(this%stream))
      status = c_fclose(this%stream)
      this%opened = .false.
      kept = .not. this%made_here
      if (present(keep)) kept = kept .or. keep
      if (kept .and. allocated(this%failure)) status = c_ftruncate(second, int(this%finished, c_long))
      status = c_close(second)
      if (.not. kept) gone = remove_file(this%path)
   end subroutine discard

   pure logical function is_open(this)
      class(text_file_t), intent(in) :: this
      is_open = this%opened
   end function is_open

   !> Whether nothing is finished in it.
   pure logical function is_empty(this)
      class(text_file_t), intent(in) :: this
      is_empty = this%finished == 0
   end function is_empty
end module rf_text_file
