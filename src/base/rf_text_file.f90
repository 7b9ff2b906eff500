!> A text file that is being written: buffered, with every failure kept as an error text, and able to delete itself, or what of
!> it was not finished when a write failed.
!>
!> It writes through C's stdio (rf_stream) because gfortran's FLUSH and CLOSE keep quiet about a full disk (libgfortran 12 drops
!> what the system says). After the first failure further output is dropped; `flush` and `close` hand the error back.
module rf_text_file
   use rf_kinds, only: i8
   use rf_archive, only: archive_t
   use rf_checksum, only: checksum_t, checksum_of_file
   use rf_system, only: refuse_large_files, remove_file, path_exists
   use rf_stream, only: stream_t, last_error, last_reason, would_block
   use rf_text, only: to_text
   implicit none
   private

   !> characters collected before they go to the file
   integer, parameter :: buffer_size = 65536

   type, public :: text_file_t
      !> where it is
      character(len=:), allocatable :: path
      type(stream_t), private :: stream
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
      procedure :: claim, create, append
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

contains

   !> Take a file for this process alone before it, or what lies beside it, is replaced, and change nothing in it; where there is
   !> none an empty one is made. The error says that another run is writing it. A file that cannot be opened is not taken: making
   !> it anew says why. (A file system without locks tells nothing of others.)
   subroutine claim(this, path, error)
      class(text_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      this%path = path
      if (path_exists(path)) then
         this%opened = this%stream%open(path, 'r+')
         if (.not. this%opened) this%opened = this%stream%open(path, 'r')
      else
         this%opened = this%stream%open(path, 'a')
         this%made_here = this%opened
      end if
      if (this%opened) call lock_alone(this)
      if (allocated(this%failure)) error = this%failure
   end subroutine claim

   !> Make the file; an existing one is replaced, unless another run is writing it.
   subroutine create(this, path, error)
      class(text_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      type(text_file_t) :: there
      call refuse_large_files()
      if (path_exists(path)) call there%claim(path, error)
      call there%discard(keep=.true.)
      if (allocated(error)) return
      this%path = path
      allocate (character(len=buffer_size) :: this%buffer)
      this%opened = this%stream%open(path, 'w')
      call this%note(this%opened, 'create')
      this%made_here = this%opened
      if (this%opened) call lock_alone(this)
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
      this%opened = this%stream%open(path, 'a')
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
         if (this%opened .and. .not. allocated(error)) call this%note(this%stream%sync(), 'write to')
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
      call this%note(this%stream%cut(this%kept), 'write to')
      call this%note(this%stream%go_to_end(), 'write to')
      this%written = this%kept
      this%finished = this%kept
      this%used = 0
      if (allocated(this%failure)) error = this%failure
   end subroutine go_on

   !> Open a file that is there, which nobody else may be writing.
   subroutine open_alone(this, path)
      type(text_file_t), intent(inout) :: this
      character(len=*), intent(in) :: path
      call refuse_large_files()
      this%path = path
      if (.not. allocated(this%buffer)) allocate (character(len=buffer_size) :: this%buffer)
      this%opened = this%stream%open(path, 'r+')
      call this%note(this%opened, 'write to')
      if (this%opened) call lock_alone(this)
   end subroutine open_alone

   !> Keep other runs from an open file until it is closed, or leave it to the one that has it. (A file system without locks tells
   !> nothing of others.)
   subroutine lock_alone(this)
      type(text_file_t), intent(inout) :: this
      if (this%stream%lock()) return
      if (last_error() /= would_block) return
      this%failure = this%path//': is being written by another run, which has to end first'
      call this%stream%give_up()
      this%opened = .false.
      this%made_here = .false.
   end subroutine lock_alone

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
      if (this%used > 0 .and. .not. allocated(this%failure)) then
         call this%note(this%stream%write(this%buffer(:this%used)), 'write to')
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
      call this%empty_buffer()
      this%sum_holds = .false.
      if (.not. this%opened .or. allocated(this%failure)) return
      call this%note(this%stream%go_to(place), 'write to')
      if (allocated(this%failure)) return
      call this%note(this%stream%write(text), 'write to')
      call this%note(this%stream%go_to_end(), 'write to')
   end subroutine overwrite

   !> Hand all that was put to the operating system.
   subroutine flush_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      call this%empty_buffer()
      if (this%opened .and. .not. allocated(this%failure)) call this%note(this%stream%flush(), 'write to')
      if (.not. allocated(this%failure)) this%finished = this%written
      if (allocated(this%failure)) error = this%failure
   end subroutine flush_file

   !> Write the rest and close. Nothing to do for a closed file.
   subroutine close_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      if (.not. this%opened) return
      call this%flush(error)
      call this%note(this%stream%close(), 'finish')
      this%opened = .false.
      if (allocated(this%failure)) error = this%failure
   end subroutine close_file

   !> Close and delete the file, if this run made it; errors do not matter any more. What is kept ends with what the last
   !> successful `flush` has handed on, whatever the closing itself still writes.
   subroutine discard(this, keep)
      class(text_file_t), intent(inout) :: this
      !> leave what is finished instead of deleting the file (default: no)
      logical, intent(in), optional :: keep
      logical :: kept, gone
      if (.not. this%opened) return
      this%opened = .false.
      kept = .not. this%made_here
      if (present(keep)) kept = kept .or. keep
      if (kept .and. allocated(this%failure)) then
         call this%stream%give_up(this%finished)
      else
         call this%stream%give_up()
      end if
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
