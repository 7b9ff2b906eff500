!> What went wrong in the running test, with the place it went wrong at (part of the pFUnit subset).
module funit_exceptions
   implicit none
   private
   public :: SourceLocation, throw, catch, anyExceptions, exceptions_as_text, forget_exceptions

   !> place in a test file
   type :: SourceLocation
      character(len=200) :: file = '<unknown>'
      integer :: line = 0
   end type SourceLocation

   type :: exception_t
      character(len=:), allocatable :: text
      type(SourceLocation) :: location
   end type exception_t

   !> more failures of one test than this are not told apart
   integer, parameter :: max_exceptions = 50
   type(exception_t) :: raised(max_exceptions)
   integer :: n_raised = 0

contains

   !> Note a failure of the running test.
   subroutine throw(message, location)
      !> what is wrong
      character(len=*), intent(in) :: message
      !> where
      type(SourceLocation), intent(in), optional :: location
      if (n_raised == max_exceptions) return
      n_raised = n_raised + 1
      raised(n_raised)%text = message
      raised(n_raised)%location = SourceLocation()
      if (present(location)) raised(n_raised)%location = location
   end subroutine throw

   !> Whether the running test has failed.
   logical function anyExceptions()
      anyExceptions = n_raised > 0
   end function anyExceptions

   !> Take back the first failure (with this message, if one is given); false if there is none.
   logical function catch(message)
      !> message of the failure to take back
      character(len=*), intent(in), optional :: message
      integer :: i
      catch = .false.
      do i = 1, n_raised
         if (present(message)) then
            if (raised(i)%text /= message) cycle
         end if
         raised(i:n_raised - 1) = raised(i + 1:n_raised)
         n_raised = n_raised - 1
         catch = .true.
         return
      end do
   end function catch

   !> Start afresh for the next test.
   subroutine forget_exceptions()
      n_raised = 0
   end subroutine forget_exceptions

   !> All failures of the running test, each with its place.
   function exceptions_as_text() result(text)
      character(len=:), allocatable :: text
      character(len=12) :: line
      integer :: i
      text = ''
      do i = 1, n_raised
         write (line, '(i0)') raised(i)%location%line
         text = text//'  Location: ['//trim(raised(i)%location%file)//':'//trim(line)//']'//new_line('a') &
            //raised(i)%text//new_line('a')//new_line('a')
      end do
   end function exceptions_as_text
end module funit_exceptions
