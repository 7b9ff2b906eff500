!> A text file that is being written: buffered, with every failure kept as an error text, and able to delete itself.
!>
!> After the first failure further output is dropped; `flush` and `close` hand the error back.
module rf_text_file
   use rf_kinds, only: i8
   implicit none
   private

   !> bytes collected before they go to the file
   integer, parameter :: buffer_size = 65536

   type, public :: text_file_t
      !> where it is
      character(len=:), allocatable :: path
      integer, private :: unit = 0
      logical, private :: opened = .false.
      character(len=:), allocatable, private :: buffer
      !> characters in the buffer
      integer, private :: used = 0
      !> characters in the file
      integer(i8), private :: written = 0
      !> the last write was not at the end
      logical, private :: moved = .false.
      !> the first error
      character(len=:), allocatable, private :: failure
   contains
      procedure :: create
      procedure :: put
      procedure :: put_line
      procedure :: position
      procedure :: overwrite
      procedure :: flush => flush_file
      procedure :: close => close_file
      procedure :: discard
      procedure :: is_open
      procedure, private :: empty_buffer, note
   end type text_file_t

contains

   !> Make the file; an existing one is replaced.
   subroutine create(this, path, error)
      class(text_file_t), intent(out) :: this
      character(len=*), intent(in) :: path
      character(len=:), allocatable, intent(out) :: error
      character(len=256) :: message
      integer :: status
      this%path = path
      allocate (character(len=buffer_size) :: this%buffer)
      message = ''
      open (newunit=this%unit, file=path, access='stream', form='unformatted', status='replace', action='write', &
            iostat=status, iomsg=message)
      this%opened = status == 0
      call this%note('create this file', status, message)
      if (allocated(this%failure)) error = this%failure
   end subroutine create

   !> Keep the first error.
   subroutine note(this, what, status, message)
      class(text_file_t), intent(inout) :: this
      !> what was tried
      character(len=*), intent(in) :: what
      !> iostat= of it
      integer, intent(in) :: status
      !> iomsg= of it, which may name the file once more: the system's reason stands behind the last colon
      character(len=*), intent(in) :: message
      if (status == 0 .or. allocated(this%failure)) return
      this%failure = this%path//': cannot '//what//': '//trim(adjustl(message(index(message, ':', back=.true.) + 1:)))
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
      character(len=256) :: message
      integer :: status
      status = 0
      message = ''
      if (this%used > 0 .and. .not. allocated(this%failure)) then
         if (this%moved) then
            write (this%unit, pos=this%written + 1, iostat=status, iomsg=message) this%buffer(:this%used)
         else
            write (this%unit, iostat=status, iomsg=message) this%buffer(:this%used)
         end if
         call this%note('write to this file', status, message)
         this%moved = .false.
         this%written = this%written + this%used
      end if
      this%used = 0
   end subroutine empty_buffer

   !> Where the next text goes [characters from 1]: for `overwrite`.
   pure integer(i8) function position(this)
      class(text_file_t), intent(in) :: this
      position = this%written + this%used + 1
   end function position

   !> Replace characters that were written before.
   subroutine overwrite(this, place, text)
      class(text_file_t), intent(inout) :: this
      !> a former `position`
      integer(i8), intent(in) :: place
      character(len=*), intent(in) :: text
      character(len=256) :: message
      integer :: status
      call this%empty_buffer()
      if (.not. this%opened .or. allocated(this%failure)) return
      message = ''
      write (this%unit, pos=place, iostat=status, iomsg=message) text
      call this%note('write to this file', status, message)
      this%moved = .true.
   end subroutine overwrite

   !> Hand all that was put to the operating system.
   subroutine flush_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      character(len=256) :: message
      integer :: status
      call this%empty_buffer()
      if (this%opened .and. .not. allocated(this%failure)) then
         message = ''
         flush (this%unit, iostat=status, iomsg=message)
         call this%note('write to this file', status, message)
      end if
      if (allocated(this%failure)) error = this%failure
   end subroutine flush_file

   !> Write the rest and close. Nothing to do for a closed file.
   subroutine close_file(this, error)
      class(text_file_t), intent(inout) :: this
      character(len=:), allocatable, intent(out) :: error
      character(len=256) :: message
      integer :: status
      if (.not. this%opened) return
      call this%flush(error)
      message = ''
      close (this%unit, iostat=status, iomsg=message)
      call this%note('finish this file', status, message)
      this%opened = .false.
      if (allocated(this%failure)) error = this%failure
   end subroutine close_file

   !> Close and delete the file, if this run made it; errors do not matter any more.
   subroutine discard(this)
      class(text_file_t), intent(inout) :: this
      integer :: status
      if (.not. this%opened) return
      close (this%unit, status='delete', iostat=status)
      this%opened = .false.
   end subroutine discard

   pure logical function is_open(this)
      class(text_file_t), intent(in) :: this
      is_open = this%opened
   end function is_open
end module rf_text_file
