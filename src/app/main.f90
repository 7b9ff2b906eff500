!> rfem: finite elements for the failure of rock.
program rfem
   use rf_program, only: run_program
   use rf_system, only: exit_program
   implicit none
   call exit_program(run_program())
end program rfem
