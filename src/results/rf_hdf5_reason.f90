!> Why the last HDF5 call failed, in the system's words: HDF5 keeps the chain of what went wrong, this reads its innermost link.
module rf_hdf5_reason
   use, intrinsic :: iso_c_binding, only: c_int, c_int64_t, c_ptr, c_char, c_funptr, c_funloc, c_loc, c_f_pointer, &
      c_associated, c_null_char
   implicit none
   private
   public :: hdf5_reason

   !> longest reason that is kept [characters]
   integer, parameter :: reason_length = 300
   !> H5E_DEFAULT: the chain of this thread
   integer(c_int64_t), parameter :: default_chain = 0_c_int64_t
   !> H5E_WALK_UPWARD: from the innermost failure outwards
   integer(c_int), parameter :: innermost_first = 0_c_int
   character(len=*), parameter :: message_mark = 'error message = '''

   !> H5E_error2_t of H5Epublic.h
   type, bind(c) :: hdf5_error_t
      integer(c_int64_t) :: class_id
      integer(c_int64_t) :: major
      integer(c_int64_t) :: minor
      integer(c_int) :: line
      type(c_ptr) :: function_name
      type(c_ptr) :: file_name
      type(c_ptr) :: description
   end type hdf5_error_t

   !> what the walk collects
   type, bind(c) :: found_t
      integer(c_int) :: n
      integer(c_int) :: from_system
      character(kind=c_char) :: text(reason_length)
   end type found_t

   interface
      integer(c_int) function c_walk(chain, direction, visit, found) bind(c, name='H5Ewalk2')
         import :: c_int, c_int64_t, c_funptr, c_ptr
         integer(c_int64_t), value :: chain
         integer(c_int), value :: direction
         type(c_funptr), value :: visit
         type(c_ptr), value :: found
      end function c_walk
   end interface

contains

   !> The reason of the HDF5 call that failed last, such as 'No space left on device'.
   function hdf5_reason() result(reason)
      character(len=:), allocatable :: reason
      type(found_t), target :: found
      integer(c_int) :: status
      integer :: i
      found%n = 0
      found%from_system = 0
      status = c_walk(default_chain, innermost_first, c_funloc(visit), c_loc(found))
      reason = repeat(' ', found%n)
      do i = 1, found%n
         reason(i:i) = found%text(i)
      end do
      if (status < 0 .or. reason == '') reason = 'HDF5 gives no reason'
      if (index(reason, 'Resource temporarily unavailable') > 0) reason = 'it is open in another program (or the file '// &
         'system knows no locks: then set HDF5_USE_FILE_LOCKING=FALSE)'
   end function hdf5_reason

   !> Called by HDF5 for each link of the chain: keep the first one, or the first with a message of the operating system.
   integer(c_int) function visit(n, error, found_address) bind(c) result(status)
      !> position in the chain, from 0
      integer(c_int), value :: n
      !> the link
      type(hdf5_error_t), intent(in) :: error
      !> address of a found_t
      type(c_ptr), value :: found_address
      type(found_t), pointer :: found
      character(len=:), allocatable :: text
      integer :: first, last
      status = 0
      call c_f_pointer(found_address, found)
      text = text_at(error%description)
      first = index(text, message_mark)
      if (first > 0 .and. found%from_system == 0) then
         text = text(first + len(message_mark):)
         last = index(text, '''')
         if (last > 1) text = text(:last - 1)
         found%from_system = 1
         call keep(found, text)
      else if (n == 0) then
         call keep(found, text)
      end if
   end function visit

   subroutine keep(found, text)
      type(found_t), intent(inout) :: found
      character(len=*), intent(in) :: text
      integer :: i
      found%n = int(min(len(text), reason_length), c_int)
      do i = 1, found%n
         found%text(i) = text(i:i)
      end do
   end subroutine keep

   !> A C string as Fortran text.
   function text_at(address) result(text)
      type(c_ptr), intent(in) :: address
      character(len=:), allocatable :: text
      character(kind=c_char), pointer :: letters(:)
      integer :: i
      text = ''
      if (.not. c_associated(address)) return
      call c_f_pointer(address, letters, [reason_length*4])
      do i = 1, size(letters)
         if (letters(i) == c_null_char) exit
         text = text//letters(i)
      end do
   end function text_at
end module rf_hdf5_reason
