!> What the program does, from the command line to the exit status.
module rf_program
   use, intrinsic :: iso_fortran_env, only: error_unit
   use omp_lib, only: omp_set_num_threads, omp_get_max_threads
   use rf_kinds, only: wp, i8
   use rf_command_line, only: options_t, read_command_line, usage_text, action_check, action_explain, action_help, &
      action_version
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_case, only: read_case
   use rf_interruption, only: interruption_t
   use rf_simulation, only: simulation_t, exit_done, exit_not_written
   use rf_run, only: run_t
   use rf_output_input, only: output_requests_t
   use rf_checkpoint, only: checkpoint_t
   use rf_log, only: log_t
   use rf_summary, only: summarise_model
   use rf_memory, only: memory_problem, bytes_to_run
   use rf_clock, only: monotonic_time
   use rf_system, only: is_terminal, is_pipe, catch_save_signal
   use rf_text, only: text_t, to_text
   use rf_version, only: version, commit, compiler, flags
   implicit none
   private
   public :: run_program

   integer, parameter :: exit_wrong_input = 2
   !> descriptor of standard input
   integer, parameter :: input_descriptor = 0
   !> the pipes of a shell's <(..), to which somebody writes for sure
   character(len=*), parameter :: shells_pipes = '/dev/fd/'

contains

   !> Do what the command line asks for.
   integer function run_program(first, interruption) result(status)
      !> the first argument that is meant (default: 1)
      integer, intent(in), optional :: first
      !> what the run asks whether it is to be left: as it is at the start, and at the end
      type(interruption_t), intent(inout), optional :: interruption
      type(options_t) :: options
      type(interruption_t) :: asked
      type(run_t), allocatable :: run
      integer :: i
      i = 1
      if (present(first)) i = first
      if (present(interruption)) asked = interruption
      allocate (run)
      call run%simulation%log%begin()
      call read_command_line(options, i)
      status = exit_done
      if (allocated(options%error)) then
         write (error_unit, '(a)') 'rfem: error: '//options%error
         status = exit_wrong_input
      else if (options%action == action_help) then
         call run%simulation%log%line(usage_text)
      else if (options%action == action_version) then
         call run%simulation%log%line('rfem '//version//' ('//commit//'), '//compiler)
         call run%simulation%log%line('flags: '//flags)
      else if (len(options%restart) > 0) then
         status = restart(run, options, asked)
      else if (len(options%deck) == 0 .and. is_terminal(input_descriptor)) then
         call run%simulation%log%line(usage_text)
      else
         status = run_deck(run, options, asked)
      end if
      if (run%simulation%log%lost .and. status == exit_done) status = exit_not_written
      if (present(interruption)) interruption = asked
   end function run_program

   !> Read the deck, and run it unless only a check or an explanation is wanted.
   integer function run_deck(run, options, interruption) result(status)
      type(run_t), intent(inout) :: run
      type(options_t), intent(in) :: options
      !> as run_program
      type(interruption_t), intent(inout) :: interruption
      type(diagnostics_t) :: diagnostics
      character(len=:), allocatable :: problem
      call prepare(run, options, interruption)
      if (is_pipe(options%deck) .and. index(options%deck, shells_pipes) /= 1) &
         write (error_unit, '(a)') 'rfem: note: '//options%deck//' is a pipe: the deck is what is written to it'
      call run%deck%read_file(options%deck, padded(options%overrides), diagnostics)
      if (len(run%deck%full_text()) > 0 .or. diagnostics%n_errors == 0) & ! else it is not there, and that is all to be said
         call read_case(run%deck, run%simulation, run%requests, run%job, diagnostics)
      call diagnostics%print(error_unit)
      status = diagnostics%exit_status()
      if (status /= exit_done) return
      if (len(run%job) == 0) run%job = run%deck%default_job()
      if (len(options%job) > 0) run%job = options%job
      run%folder = options%output
      if (options%action == action_explain) then
         call explain(run)
         return
      end if
      call say_hello(run)
      if (options%action /= action_check) call list_settings(run)
      run%simulation%reading_time = monotonic_time() - run%start
      call summarise_model(run%simulation, run%simulation%reading_time)
      if (options%action == action_check) then
         call run%simulation%log%line('checked: '//run%deck%name()//' is a good deck')
         return
      end if
      call memory_problem(int(run%simulation%model%mesh%n_elements, i8), bytes_to_run, 'to be run', problem)
      if (allocated(problem)) then
         status = exit_wrong_input
         write (error_unit, '(a)') 'rfem: error: '//problem
         return
      end if
      status = run%begin()
      interruption = run%simulation%interruption
   end function run_deck

   !> Go on from a checkpoint.
   integer function restart(run, options, interruption) result(status)
      type(run_t), intent(inout) :: run
      type(options_t), intent(in) :: options
      !> as run_program
      type(interruption_t), intent(inout) :: interruption
      type(checkpoint_t) :: checkpoint
      type(diagnostics_t) :: diagnostics
      character(len=:), allocatable :: ignored, problem
      call prepare(run, options, interruption)
      status = exit_done
      call run%open(options%restart, checkpoint)
      if (.not. allocated(checkpoint%error)) then
         call run%deck%read_text(checkpoint%origin%deck, checkpoint%origin%deck_name, [character(len=1) ::], diagnostics)
         call read_case(run%deck, run%simulation, run%requests, ignored, diagnostics)
         if (diagnostics%exit_status() /= exit_done) then
            call diagnostics%print(error_unit)
            call checkpoint%fail(options%restart//': this version of rfem refuses the deck in it')
         end if
      end if
      if (allocated(checkpoint%error)) then
         status = merge(exit_wrong_input, exit_not_written, checkpoint%mistaken)
         write (error_unit, '(a)') 'rfem: error: '//checkpoint%error
         return
      end if
      if (options%action == action_explain) then
         call explain(run)
         return
      end if
      call memory_problem(int(run%n_elements, i8), bytes_to_run, 'to be run', problem)
      if (allocated(problem)) then
         call checkpoint%abandon()
         status = exit_wrong_input
         write (error_unit, '(a)') 'rfem: error: '//options%restart//': '//problem
         return
      end if
      call say_hello(run)
      run%simulation%reading_time = monotonic_time() - run%start
      status = run%go_on(checkpoint)
      interruption = run%simulation%interruption
   end function restart

   !> What a run knows before its deck is read.
   subroutine prepare(run, options, interruption)
      type(run_t), intent(inout) :: run
      type(options_t), intent(in) :: options
      type(interruption_t), intent(in) :: interruption
      run%start = monotonic_time()
      call catch_save_signal()
      if (options%threads > 0) call omp_set_num_threads(options%threads)
      run%simulation%log%quiet = options%quiet
      run%simulation%interruption = interruption
      call describe(run%manual)
   end subroutine prepare

   !> The first line of the log.
   subroutine say_hello(run)
      type(run_t), intent(inout) :: run
      call run%simulation%log%line('rfem '//version//' ('//commit//'), '//to_text(omp_get_max_threads())//' threads, job '// &
                                   run%job)
   end subroutine say_hello

   !> What --explain asks for.
   subroutine explain(run)
      type(run_t), intent(inout) :: run
      type(text_t), allocatable :: lines(:)
      integer :: i
      call run%deck%explain(run%manual, lines)
      do i = 1, size(lines)
         call run%simulation%log%line(lines(i)%s)
      end do
   end subroutine explain

   !> A deck that describes itself, for the defaults of what the user's deck leaves out.
   subroutine describe(manual)
      type(deck_t), intent(inout) :: manual
      type(simulation_t), allocatable :: simulation
      type(output_requests_t) :: requests
      type(diagnostics_t) :: diagnostics
      character(len=:), allocatable :: job
      allocate (simulation)
      call manual%describe()
      call read_case(manual, simulation, requests, job, diagnostics)
   end subroutine describe

   pure function padded(texts) result(list)
      type(text_t), intent(in) :: texts(:)
      character(len=:), allocatable :: list(:)
      integer :: i, longest
      longest = 1
      do i = 1, size(texts)
         longest = max(longest, len(texts(i)%s))
      end do
      allocate (character(len=longest) :: list(size(texts)))
      do i = 1, size(texts)
         list(i) = texts(i)%s
      end do
   end function padded

   !> The settings of the run, in the log.
   subroutine list_settings(run)
      type(run_t), intent(inout) :: run
      type(text_t), allocatable :: names(:), values(:), origins(:)
      integer :: i
      call run%deck%settings(names, values, origins, run%manual)
      call run%simulation%log%line('settings:')
      do i = 1, size(names)
         call run%simulation%log%line('  '//names(i)%s//' = '//values(i)%s//'  ('//origins(i)%s//')')
      end do
   end subroutine list_settings

end module rf_program
