!> Prints the tables of docs/deck.md: what the readers would read.
program rfem_manual
   use, intrinsic :: iso_fortran_env, only: output_unit
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_case, only: read_case
   use rf_simulation, only: simulation_t
   use rf_output_input, only: output_requests_t
   implicit none
   type(deck_t) :: deck
   type(simulation_t), allocatable :: simulation
   type(output_requests_t) :: requests
   type(diagnostics_t) :: diagnostics
   character(len=:), allocatable :: job
   allocate (simulation)
   call deck%describe()
   call read_case(deck, simulation, requests, job, diagnostics)
   call deck%write_manual(output_unit)
end program rfem_manual
