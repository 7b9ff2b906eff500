!> A run, from its result files to the exit status: a new one, or one that goes on from a checkpoint.
module rf_run
   use, intrinsic :: iso_fortran_env, only: error_unit
   use omp_lib, only: omp_get_max_threads
   use rf_kinds, only: wp, i8
   use rf_clock, only: stopwatch_t, monotonic_time, date_text
   use rf_deck, only: deck_t
   use rf_output_input, only: output_requests_t
   use rf_checkpoint, only: checkpoint_t, checkpoint_path
   use rf_provenance, only: provenance_t
   use rf_simulation, only: simulation_t, exit_done, exit_not_written, exit_interrupted
   use rf_summary, only: summarise_run, tell_that_it_had_ended
   use rf_system, only: make_folders, is_folder, path_exists, real_path, host_name, process_id, catch_leave_signals
   use rf_log, only: short
   use rf_text, only: text_t, to_text
   use rf_version, only: version, commit, compiler, flags
   implicit none
   private
   public :: run_t

   !> *RESTART, WRITE: an increment of many events may take days; so long [s] after a checkpoint there is another one, but not
   !> before this multiple of the time that writing it took
   real(wp), parameter :: long_without = 600.0_wp, worth_it = 20.0_wp

   type :: run_t
      type(simulation_t) :: simulation
      type(output_requests_t) :: requests
      !> the deck, and one that describes itself
      type(deck_t) :: deck, manual
      !> elements of the checkpoint
      integer :: n_elements = 0
      !> what all result files begin with, and the folder they lie in (empty: the working directory)
      character(len=:), allocatable :: job, folder
      !> monotonic time at the start of the program [s]; wall-clock time of the run before that, by earlier processes [s]
      real(wp) :: start = 0
      real(wp), private :: spent = 0
      !> it goes on from JOB.rst.h5 itself: the next checkpoint makes it the previous one
      logical, private :: from_newest = .true.
      !> the time that checkpoints take
      type(stopwatch_t), private :: watch
      !> the result files are open; there is a checkpoint from which the run can go on with them
      logical, private :: opened = .false., resumable = .false.
   contains
      procedure :: begin, open => open_checkpoint, go_on
      procedure, private :: prefix, title, run_to_end, save, finish, tell_how_to_go_on, fill_provenance
   end type run_t

contains

   !> Run from the start: everything has been read and checked.
   integer function begin(self) result(status)
      class(run_t), intent(inout) :: self
      character(len=:), allocatable :: error
      call catch_leave_signals()
      if (len(self%folder) > 0) then
         if (.not. is_folder(self%folder)) then
            if (.not. make_folders(self%folder)) error = folder_problem(self%folder)
         end if
      end if
      call self%fill_provenance()
      associate (simulation => self%simulation)
         if (.not. allocated(error)) call simulation%model%prepare()
         if (.not. allocated(error)) call simulation%recorder%create(self%prefix(), self%title(), self%requests, &
                                         any(simulation%fracture%on), simulation%model%dynamics%wanted, error)
      end associate
      self%opened = .not. allocated(error)
      status = self%run_to_end(error)
   end function begin

   !> Open a checkpoint to go on from; its `error` has the reason if that cannot be.
   subroutine open_checkpoint(self, path, checkpoint)
      class(run_t), intent(inout) :: self
      character(len=*), intent(in) :: path
      type(checkpoint_t), intent(inout) :: checkpoint
      type(provenance_t) :: program
      integer :: n_elements
      call fill_program(program)
      call checkpoint%begin_reading(path, program)
      if (.not. allocated(checkpoint%error)) call checkpoint%exchange('job', self%job)
      if (.not. allocated(checkpoint%error)) call checkpoint%exchange('elements', n_elements)
      self%n_elements = 0
      if (allocated(checkpoint%error)) return
      self%n_elements = n_elements
      self%folder = ''
      if (index(path, '/') > 0) self%folder = path(:max(1, index(path, '/', back=.true.) - 1))
      self%from_newest = real_path(path) == real_path(checkpoint_path(self%prefix()))
   end subroutine open_checkpoint

   !> Go on from a checkpoint; the deck in it has been read.
   integer function go_on(self, checkpoint) result(status)
      class(run_t), intent(inout) :: self
      !> open
      type(checkpoint_t), intent(inout) :: checkpoint
      character(len=:), allocatable :: error
      logical :: complete
      call catch_leave_signals()
      complete = .false.
      call self%fill_provenance()
      associate (simulation => self%simulation, provenance => self%simulation%recorder%provenance)
         call continue_provenance(provenance, checkpoint)
         call simulation%model%prepare()
         call simulation%recorder%take_requests(self%requests)
         call simulation%exchange(checkpoint)
         call checkpoint%finish_reading()
         self%spent = simulation%wall_time
         if (allocated(checkpoint%error)) error = checkpoint%error
         if (.not. allocated(error)) call simulation%recorder%go_on(self%prefix(), simulation%is_over(), complete, error)
         if (complete) then
            call tell_that_it_had_ended(simulation)
            status = exit_done
            return
         end if
         if (.not. allocated(error)) then
            if (len(checkpoint%note) > 0) call simulation%log%line('note: '//checkpoint%note)
            call simulation%log%line('going on at '//simulation%place())
         end if
      end associate
      self%opened = .not. allocated(error)
      self%resumable = .true.
      status = self%run_to_end(error)
   end function go_on

   !> What stays of the beginning of the run, and who goes on with it.
   subroutine continue_provenance(provenance, checkpoint)
      type(provenance_t), intent(inout) :: provenance
      type(checkpoint_t), intent(in) :: checkpoint
      provenance%start_time = checkpoint%origin%start_time
      provenance%run_id = checkpoint%origin%run_id
      provenance%restarts = checkpoint%origin%restarts + 1
      provenance%continued_by = checkpoint%origin%continued_by
      if (len(checkpoint%note) == 0) return
      if (len(provenance%continued_by) > 0) provenance%continued_by = provenance%continued_by//'; '
      provenance%continued_by = provenance%continued_by//'from restart '//to_text(provenance%restarts)//' on: commit '// &
                                provenance%commit//', '//provenance%compiler//', '//provenance%flags
   end subroutine continue_provenance

   !> Run until nothing is left to do or somebody stops it; checkpoints on the way; say how it went.
   integer function run_to_end(self, error) result(status)
      class(run_t), intent(inout) :: self
      !> what went wrong before it began
      character(len=:), allocatable, intent(inout) :: error
      associate (simulation => self%simulation)
         simulation%interruption%deadline = self%start + simulation%restart%wall_time
         if (simulation%restart%write) simulation%interruption%save_at = monotonic_time() + long_without
         do while (.not. allocated(error))
            call simulation%run()
            if (simulation%status /= exit_done) exit
            if (simulation%interruption%save .or. (simulation%interruption%leave .and. .not. simulation%is_over())) &
               call self%save(error)
            if (simulation%is_over() .or. simulation%interruption%leave) exit
         end do
         if (.not. allocated(error)) call self%finish(error)
         call simulation%log%end_progress()
         status = simulation%status
         if (allocated(error)) then
            status = exit_not_written
            if (self%opened) call simulation%recorder%discard(self%resumable)
            write (error_unit, '(a)') 'rfem: error: '//error
            if (self%opened) call tell_what_is_left(self%prefix())
            return
         end if
         if (status == exit_interrupted) then
            call self%tell_how_to_go_on()
         else
            call summarise_run(simulation, monotonic_time() - self%start, self%watch%total)
            if (allocated(simulation%message)) write (error_unit, '(a)') 'rfem: error: '//simulation%message
         end if
      end associate
   end function run_to_end

   !> Write a checkpoint; the run is to be left after it, or goes on.
   subroutine save(self, error)
      class(run_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      type(checkpoint_t) :: checkpoint
      real(wp) :: begun
      begun = monotonic_time()
      call self%watch%start()
      associate (simulation => self%simulation)
         simulation%wall_time = self%spent + (monotonic_time() - self%start)
         checkpoint%keep_newest = self%from_newest
         call checkpoint%begin_writing(self%prefix(), simulation%recorder%provenance)
         call checkpoint%exchange('job', self%job)
         call checkpoint%exchange('elements', simulation%model%mesh%n_elements)
         call simulation%exchange(checkpoint)
         call checkpoint%finish_writing()
         call self%watch%stop()
         if (allocated(checkpoint%error)) then
            error = checkpoint%error
            return
         end if
         self%resumable = .true.
         self%from_newest = .true.
         if (simulation%interruption%leave .and. .not. simulation%is_over()) simulation%status = exit_interrupted
         simulation%interruption%save = .false.
         if (simulation%restart%write) simulation%interruption%save_at = monotonic_time() + &
                                                                  max(long_without, worth_it*(monotonic_time() - begun))
      end associate
   end subroutine save

   !> Close the result files.
   subroutine finish(self, error)
      class(run_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: error
      associate (simulation => self%simulation)
         if (simulation%status == exit_not_written) then
            error = simulation%message
         else
            call simulation%recorder%finish(simulation%model, simulation%position, self%spent + (monotonic_time() - self%start), &
                                            simulation%status, simulation%status == exit_interrupted, error)
         end if
      end associate
   end subroutine finish

   !> A run could not write something: what there is of it.
   subroutine tell_what_is_left(prefix)
      character(len=*), intent(in) :: prefix
      if (path_exists(prefix//'.h5')) &
         write (error_unit, '(a)') 'rfem: note: the results up to there are kept'//last_checkpoint(prefix)
   end subroutine tell_what_is_left

   !> What a run can go on from that could not write something.
   function last_checkpoint(prefix) result(text)
      character(len=*), intent(in) :: prefix
      character(len=:), allocatable :: text
      text = ''
      if (path_exists(checkpoint_path(prefix))) text = '; the last checkpoint is '//checkpoint_path(prefix)
   end function last_checkpoint

   !> The run was interrupted: why, where, and what to do.
   subroutine tell_how_to_go_on(self)
      class(run_t), intent(inout) :: self
      character(len=:), allocatable :: text
      text = 'stopped by '//self%simulation%interruption%reason()//' at '//self%simulation%place()//'; go on with: '// &
             'rfem --restart '//checkpoint_path(self%prefix())
      call self%simulation%log%line(text)
      write (error_unit, '(a)') 'rfem: note: '//text
   end subroutine tell_how_to_go_on

   !> Folder and job name: what the names of all result files begin with.
   pure function prefix(self)
      class(run_t), intent(in) :: self
      character(len=:), allocatable :: prefix
      prefix = self%job
      if (len(self%folder) > 0) prefix = self%folder//'/'//self%job
   end function prefix

   !> First line of the heading, else the job's name.
   function title(self)
      class(run_t), intent(in) :: self
      character(len=:), allocatable :: title
      type(text_t), allocatable :: heading(:)
      call self%deck%heading(heading)
      title = self%job
      if (size(heading) > 0) title = heading(1)%s
   end function title

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

   !> Where the results come from.
   subroutine fill_provenance(self)
      class(run_t), intent(inout) :: self
      associate (provenance => self%simulation%recorder%provenance)
         provenance%deck = self%deck%full_text()
         provenance%deck_name = self%deck%name()
         call fill_program(provenance)
         provenance%host = host_name()
         provenance%start_time = date_text()
         provenance%run_id = provenance%start_time//' '//provenance%host//' '//to_text(process_id())//' '// &
                             to_text(nint(1000*monotonic_time(), i8))
         provenance%continued_by = ''
         provenance%threads = omp_get_max_threads()
         call self%deck%settings(provenance%setting_names, provenance%setting_values, provenance%setting_origins, self%manual)
      end associate
   end subroutine fill_provenance

   !> What this program is.
   subroutine fill_program(provenance)
      type(provenance_t), intent(inout) :: provenance
      provenance%version = version
      provenance%commit = commit
      provenance%compiler = compiler
      provenance%flags = flags
   end subroutine fill_program

end module rf_run
