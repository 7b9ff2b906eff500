!> rfem, left at a place that a test chooses:     rfem_cut N [arguments of rfem]
!> A run asks after every iteration and after every stage whether it is to be left; this one is at the N-th time, as if a
!> signal had come just then (0: never). At its end it says how often it has asked: `asked 1234`.
program rfem_cut
   use, intrinsic :: iso_fortran_env, only: output_unit
   use rf_interruption, only: interruption_t
   use rf_number, only: read_integer
   use rf_program, only: run_program
   use rf_system, only: exit_program
   implicit none
   character(len=20) :: word
   integer :: n, status
   type(interruption_t) :: interruption
   call get_command_argument(1, word)
   call read_integer(trim(word), n, status)
   if (status /= 0) error stop 'rfem_cut N [arguments of rfem]'
   if (n > 0) interruption%leave_at = n
   status = run_program(first=2, interruption=interruption)
   write (output_unit, '(a, i0)') 'asked ', interruption%times
   call exit_program(status)
end program rfem_cut
