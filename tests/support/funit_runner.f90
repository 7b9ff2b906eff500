!> Runs tests one after the other and reports (part of the pFUnit subset). The generated suites call it.
module funit_runner
   use, intrinsic :: iso_fortran_env, only: output_unit
   use funit_exceptions, only: anyExceptions, exceptions_as_text, forget_exceptions
   implicit none
   private
   public :: start_tests, begin_test, end_test, skip_test, finish_tests

   integer :: n_run = 0, n_failed = 0, n_disabled = 0
   character(len=:), allocatable :: filter, failures
   character(len=200) :: present_test = ''

contains

   !> Read the command line: `-f TEXT` runs only the tests whose name contains TEXT.
   subroutine start_tests()
      character(len=200) :: argument
      integer :: i
      failures = ''
      filter = ''
      do i = 1, command_argument_count()
         call get_command_argument(i, argument)
         if (argument /= '-f' .and. argument /= '--filter') cycle
         call get_command_argument(i + 1, argument)
         filter = trim(argument)
      end do
   end subroutine start_tests

   !> Whether this test is to run; its name is shown first, so that a crash tells where it was.
   logical function begin_test(name)
      !> suite.test[parameter]
      character(len=*), intent(in) :: name
      begin_test = index(name, filter) > 0
      if (.not. begin_test) return
      present_test = name
      n_run = n_run + 1
      call forget_exceptions()
      write (output_unit, '(2a)') ' Start: ', name
      flush (output_unit)
   end function begin_test

   !> Book the result of the running test.
   subroutine end_test()
      if (anyExceptions()) then
         n_failed = n_failed + 1
         failures = failures//'Failure in: '//trim(present_test)//new_line('a')//exceptions_as_text()
      end if
      call forget_exceptions()
   end subroutine end_test

   !> Book a test that is disabled.
   subroutine skip_test(name)
      !> suite.test
      character(len=*), intent(in) :: name
      if (index(name, filter) == 0) return
      n_disabled = n_disabled + 1
      write (output_unit, '(2a)') ' Disabled: ', name
   end subroutine skip_test

   !> Report all failures; a failure ends the program with exit code 2.
   subroutine finish_tests()
      write (output_unit, '(/, a)') failures
      if (n_failed == 0) then
         write (output_unit, '(a, i0, a, i0, a)') ' OK (', n_run, ' tests, ', n_disabled, ' disabled)'
         return
      end if
      write (output_unit, '(a, /, 3(a, i0))') ' FAILURES!!!', 'Tests run: ', n_run, ', Failures: ', n_failed, &
         ', Disabled: ', n_disabled
      write (output_unit, '(a)') '*** Encountered 1 or more failures/errors during testing ***'
      flush (output_unit)
      stop 2
   end subroutine finish_tests
end module funit_runner
