!> What the program does, from the command line to the exit status.
module rf_program
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use omp_lib, only: omp_set_num_threads, omp_get_max_threads
   use rf_kinds, only: wp, i8
   use rf_command_line, only: options_t, read_command_line, usage_text, action_check, action_explain, action_help, &
      action_version
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_case, only: read_case
   use rf_simulation, only: simulation_t, exit_done, exit_not_written
   use rf_output_input, only: output_requests_t
   use rf_summary, only: summarise_model, summarise_run
   use rf_memory, only: memory_problem, bytes_to_run
   use rf_clock, only: monotonic_time, date_text
   use rf_system, only: is_terminal, make_folders, is_folder, path_exists, host_name
   use rf_text, only: text_t, to_text
   use rf_version, only: version, commit, compiler, flags
   implicit none
   private
   public :: run_program

   integer, parameter :: exit_wrong_input = 2
   !> descriptor of standard input
   integer, parameter :: input_descriptor = 0

contains

   !> Do what the command line asks for.
   integer function run_program() result(status)
      type(options_t) :: options
      call read_command_line(options)
      status = exit_done
      if (allocated(options%error)) then
         write (error_unit, '(a)') 'rfem: error: '//options%error
         status = exit_wrong_input
      else if (options%action == action_help) then
         write (output_unit, '(a)') usage_text
      else if (options%action == action_version) then
         write (output_unit, '(a)') 'rfem '//version//' ('//commit//'), '//compiler
         write (output_unit, '(a)') 'flags: '//flags
      else if (len(options%deck) == 0 .and. is_terminal(input_descriptor)) then
         write (output_unit, '(a)') usage_text
      else
         status = run_deck(options)
      end if
   end function run_program

   !> Read the deck, and run it unless only a check or an explanation is wanted.
   integer function run_deck(options) result(status)
      type(options_t), intent(in) :: options
      type(deck_t) :: deck, manual
      type(diagnostics_t) :: diagnostics
      type(simulation_t), allocatable :: simulation
      type(output_requests_t) :: requests
      character(len=:), allocatable :: job, problem
      real(wp) :: start
      start = monotonic_time()
      if (options%threads > 0) call omp_set_num_threads(options%threads)
      allocate (simulation)
      simulation%log%quiet = options%quiet
      call deck%read_file(options%deck, padded(options%overrides), diagnostics)
      if (len(deck%full_text()) > 0 .or. diagnostics%n_errors == 0) & ! else it is not there, and that is all to be said
         call read_case(deck, simulation, requests, job, diagnostics)
      call diagnostics%print(error_unit)
      status = diagnostics%exit_status()
      if (status /= exit_done) return
      if (len(job) == 0) job = deck%default_job()
      if (len(options%job) > 0) job = options%job
      call describe(manual)
      if (options%action == action_explain) then
         call deck%explain(output_unit, manual)
         return
      end if
      write (output_unit, '(a)') 'rfem '//version//' ('//commit//'), '//to_text(omp_get_max_threads())//' threads, job '//job
      if (options%action /= action_check) call list_settings(deck, manual)
      simulation%reading_time = monotonic_time() - start
      call summarise_model(simulation, simulation%reading_time)
      if (options%action == action_check) then
         write (output_unit, '(a)') 'checked: '//deck%name()//' is a good deck'
         return
      end if
      call memory_problem(int(simulation%model%mesh%n_elements, i8), bytes_to_run, 'to be run', problem)
      if (allocated(problem)) then
         status = exit_wrong_input
         write (error_unit, '(a)') 'rfem: error: '//problem
         return
      end if
      status = run_simulation(options, deck, manual, simulation, requests, job, start)
   end function run_deck

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
   subroutine list_settings(deck, manual)
      type(deck_t), intent(in) :: deck, manual
      type(text_t), allocatable :: names(:), values(:), origins(:)
      integer :: i
      call deck%settings(names, values, origins, manual)
      write (output_unit, '(a)') 'settings:'
      do i = 1, size(names)
         write (output_unit, '(a)') '  '//names(i)%s//' = '//values(i)%s//'  ('//origins(i)%s//')'
      end do
   end subroutine list_settings

   !> Open the results, run, close the results, say how it went.
   integer function run_simulation(options, deck, manual, simulation, requests, job, start) result(status)
      type(options_t), intent(in) :: options
      !> the deck, and one that describes itself
      type(deck_t), intent(in) :: deck, manual
      type(simulation_t), intent(inout) :: simulation
      type(output_requests_t), intent(in) :: requests
      character(len=*), intent(in) :: job
      !> monotonic time at the start of the program [s]
      real(wp), intent(in) :: start
      character(len=:), allocatable :: error, prefix, title
      type(text_t), allocatable :: heading(:)
      prefix = job
      if (len(options%output) > 0) then
         if (.not. is_folder(options%output)) then
            if (.not. make_folders(options%output)) error = folder_problem(options%output)
         end if
         prefix = options%output//'/'//job
      end if
      call deck%heading(heading)
      title = job
      if (size(heading) > 0) title = heading(1)%s
      call fill_provenance(deck, manual, simulation)
      if (.not. allocated(error)) call simulation%model%prepare()
      if (.not. allocated(error)) &
         call simulation%recorder%create(prefix, title, requests, any(simulation%fracture%on), simulation%model%dynamics%wanted, &
                                        error)
      if (.not. allocated(error)) then
         call simulation%run()
         if (simulation%status == exit_not_written) then
            error = simulation%message
         else
            call simulation%recorder%finish(simulation%model, simulation%position, monotonic_time() - start, &
                                            simulation%status, error)
         end if
         call simulation%log%end_progress()
         if (allocated(error)) call simulation%recorder%discard()
      end if
      status = simulation%status
      if (allocated(error)) then
         status = exit_not_written
         write (error_unit, '(a)') 'rfem: error: '//error
         return
      end if
      call summarise_run(simulation, monotonic_time() - start)
      if (allocated(simulation%message)) write (error_unit, '(a)') 'rfem: error: '//simulation%message
   end function run_simulation

   !> Why a folder cannot be made.
   function folder_problem(path) result(problem)
      character(len=*), intent(in) :: path
      character(len=:), allocatable :: problem
      integer :: there
      do there = len(path), 1, -1        ! the longest part of the path that is there
         if (there < len(path)) then
            if (path(there + 1:there + 1) /= '/') cycle
         end if
         if (path_exists(path(:there))) exit
      end do
      problem = 'the folder '//path//' cannot be made: '
      if (there == 0) then
         problem = problem//'the working directory cannot be written to'
      else if (is_folder(path(:there))) then
         problem = problem//path(:there)//' cannot be written to'
      else
         problem = problem//path(:there)//' is no folder'
      end if
   end function folder_problem

   subroutine fill_provenance(deck, manual, simulation)
      type(deck_t), intent(in) :: deck, manual
      type(simulation_t), intent(inout) :: simulation
      associate (provenance => simulation%recorder%provenance)
         provenance%deck = deck%full_text()
         provenance%deck_name = deck%name()
         provenance%version = version
         provenance%commit = commit
         provenance%compiler = compiler
         provenance%flags = flags
         provenance%host = host_name()
         provenance%start_time = date_text()
         provenance%threads = omp_get_max_threads()
         call deck%settings(provenance%setting_names, provenance%setting_values, provenance%setting_origins, &
                             manual)
      end associate
   end subroutine fill_provenance

end module rf_program
