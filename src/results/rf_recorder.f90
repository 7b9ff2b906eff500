!> Writes what a run has to say of its states: decides what is due, keeps all result files, and leaves nothing half-written.
module rf_recorder
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_model, only: model_t
   use rf_ray, only: split_t
   use rf_position, only: position_t, frame_start, frame_before_event, frame_after_event, frame_settled, frame_not_converged
   use rf_output_input, only: output_settings_t, output_requests_t
   use rf_history, only: history_t
   use rf_frames, only: frames_t
   use rf_text_file, only: text_file_t
   use rf_print_tables, only: print_tables_t
   use rf_provenance, only: provenance_t
   use rf_checkpoint, only: remove_unfinished
   use rf_hdf5, only: hdf5_file_t
   use rf_digest, only: digest_t
   use rf_clock, only: stopwatch_t
   use rf_system, only: is_folder, path_exists, remove_file
   implicit none
   private
   public :: recorder_t, digests_of

   !> rows and frames of a dynamic step unless the deck says FREQUENCY
   integer, parameter :: rows_in_time = 200, frames_in_time = 20

   type :: recorder_t
      type(history_t) :: history
      type(provenance_t) :: provenance
      !> files written, for the closing summary
      character(len=:), allocatable :: files
      !> time of writing
      type(stopwatch_t) :: watch
      !> per step
      type(output_settings_t), allocatable, private :: output(:)
      type(frames_t), private :: frames
      type(print_tables_t), private :: tables
      type(hdf5_file_t), private :: file
      !> the last state is not yet among the rows, or the frames
      logical, private :: row_owed = .false., frame_owed = .false.
      !> events up to the last state after some
      integer, private :: events = 0
      !> some step looks at the criterion; some step is dynamic: which fields the frames have
      logical, private :: fracture = .false., dynamic = .false.
   contains
      procedure :: take_requests, exchange, go_on
      procedure :: create, state, state_not_converged, complete, before_event, write_events, count_iterations
      procedure :: monitor_reaction, finish, discard, look_at_time
      procedure, private :: name_files, look, reopen, release, write_row, write_frame
   end type recorder_t

contains

   !> Make all result files in place of those of an earlier run; not while that is still going: then nothing is touched. On an error
   !> those that this run made are deleted again.
   subroutine create(self, prefix, title, requests, fracture, dynamic, error)
      class(recorder_t), intent(inout) :: self
      !> folder and job name; first line of the heading
      character(len=*), intent(in) :: prefix, title
      type(output_requests_t), intent(in) :: requests
      !> some step looks at the criterion; some step is dynamic
      logical, intent(in) :: fracture, dynamic
      character(len=:), allocatable, intent(out) :: error
      character(len=14), parameter :: replaced(8) = [character(len=14) :: '.h5', '_events.csv', '.vtkhdf', '_cracks.vtkhdf', &
                                                     '.mac', '.dat', '.rst.h5', '.rst.1.h5']
      type(text_file_t) :: claimed
      call self%take_requests(requests)
      self%fracture = fracture
      self%dynamic = dynamic
      call self%name_files(prefix)
      call claimed%claim(prefix//'_history.csv', error)
      if (allocated(error)) then
         error = error//'; or give this run another name (--job) or folder (--output)'
         return
      end if
      call remove_unfinished(prefix)
      call remove_old(prefix, replaced)
      call self%file%create(prefix//'.h5', error)
      if (.not. allocated(error)) call self%file%add_group('/rfem', error)
      if (.not. allocated(error)) call self%provenance%write_start(self%file, error)
      call remove_old(prefix, ['_history.csv'])       ! at last, and locked until all of this run's are: nobody slips in
      if (.not. allocated(error)) call self%history%create(prefix, self%file, error)
      if (.not. allocated(error)) call self%file%start_swmr(error)
      if (.not. allocated(error)) call self%history%start(self%file, error)
      if (.not. allocated(error)) call self%frames%create(prefix, title, fracture, dynamic, error)
      if (.not. allocated(error)) call self%tables%create(prefix, error)
      if (allocated(error)) call self%discard(.false.)
      call claimed%discard(keep=.true.)
   end subroutine create

   !> The files of this run, for the closing summary.
   subroutine name_files(self, prefix)
      class(recorder_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      self%files = prefix//'.h5 '//prefix//'_history.csv '//prefix//'_events.csv'
      if (self%frames%vtkhdf) self%files = self%files//' '//prefix//'.vtkhdf '//prefix//'_cracks.vtkhdf'
      if (self%frames%apdl) self%files = self%files//' '//prefix//'.mac'
      if (size(self%tables%nodes) + size(self%tables%elements) > 0) self%files = self%files//' '//prefix//'.dat'
   end subroutine name_files

   !> To or from a checkpoint: what the result files hold. (Derived: provenance is the checkpoint's origin; files, output follow
   !> from the deck; file, watch are of one process.)
   subroutine exchange(self, archive)
      class(recorder_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      character(len=:), allocatable :: error
      if (.not. archive%reading .and. self%file%is_open()) then
         call self%file%sync(error)
         if (allocated(error)) call archive%fail(error)
      end if
      call archive%enter('history')
      call self%history%exchange(archive)
      call archive%leave()
      call archive%enter('frames')
      call self%frames%exchange(archive)
      call archive%leave()
      call archive%enter('tables')
      call self%tables%exchange(archive)
      call archive%leave()
      call archive%exchange('row_owed', self%row_owed)
      call archive%exchange('frame_owed', self%frame_owed)
      call archive%exchange('events', self%events)
      call archive%exchange('fracture', self%fracture)
      call archive%exchange('dynamic', self%dynamic)
   end subroutine exchange

   !> Go on with the files of a checkpoint, after take_requests and exchange. First all of them are looked at, so that none is
   !> changed where one is missing or too short; then what was written after the checkpoint is cut off. Complete files of a run
   !> that has nothing left to do stay as they are, closed.
   subroutine go_on(self, prefix, over, complete, error)
      class(recorder_t), intent(inout) :: self
      !> folder and job name
      character(len=*), intent(in) :: prefix
      !> the run has nothing left to do
      logical, intent(in) :: over
      !> neither have its files
      logical, intent(out) :: complete
      character(len=:), allocatable, intent(out) :: error
      call self%name_files(prefix)
      call self%look(prefix, complete, error)
      complete = complete .and. over
      if (allocated(error) .or. complete) then
         call self%release()
         return
      end if
      call remove_unfinished(prefix)
      call self%reopen(prefix, error)
      if (.not. allocated(error)) call self%file%start_swmr(error)
      if (.not. allocated(error)) call self%history%start(self%file, error)
      if (allocated(error)) call self%discard(.true.)
   end subroutine go_on

   !> Look at all files of a checkpoint and change none. The text files first: as long as they are locked nobody else writes to any
   !> file of this run.
   subroutine look(self, prefix, ended, error)
      class(recorder_t), intent(inout) :: self
      character(len=*), intent(in) :: prefix
      !> they tell of the end of the run
      logical, intent(out) :: ended
      character(len=:), allocatable, intent(out) :: error
      character(len=:), allocatable :: problem
      ended = .false.
      call self%history%look_at_text(prefix, error)
      if (.not. allocated(error)) call self%frames%look_at_text(prefix, error)
      if (.not. allocated(error)) call self%tables%go_on(prefix, .true., error)
      if (.not. allocated(error)) call self%file%reopen(prefix//'.h5', error, look_only=.true.)
      if (.not. allocated(error)) call self%provenance%check_run(self%file, error)
      if (.not. allocated(error)) ended = self%provenance%tells_of_end(self%file)
      if (.not. allocated(error)) call self%history%go_on(prefix, self%file, .true., error)
      if (self%file%is_open()) call self%file%close(problem)
      if (.not. allocated(error) .and. allocated(problem)) error = problem
      if (.not. allocated(error)) call self%frames%go_on(prefix, self%fracture, self%dynamic, .true., error)
   end subroutine look

   !> Open all files of a checkpoint, and cut off what was written after it.
   subroutine reopen(self, prefix, error)
      class(recorder_t), intent(inout) :: self
      character(len=*), intent(in) :: prefix
      character(len=:), allocatable, intent(out) :: error
      call self%file%reopen(prefix//'.h5', error)
      if (.not. allocated(error)) call self%provenance%write_restart(self%file, error)
      if (.not. allocated(error)) call self%history%go_on(prefix, self%file, .false., error)
      if (.not. allocated(error)) call self%frames%go_on(prefix, self%fracture, self%dynamic, .false., error)
      if (.not. allocated(error)) call self%tables%go_on(prefix, .false., error)
   end subroutine reopen

   !> Give back files that were looked at, as they are.
   subroutine release(self)
      class(recorder_t), intent(inout) :: self
      call self%history%discard(keep=.true.)
      call self%frames%release()
      call self%tables%discard(.true.)
   end subroutine release

   !> Delete files of an earlier result set of this name: what the new run does not write must not stay beside what it writes.
   subroutine remove_old(prefix, endings)
      character(len=*), intent(in) :: prefix
      !> trailing blanks do not count
      character(len=*), intent(in) :: endings(:)
      integer :: i
      do i = 1, size(endings)
         if (.not. path_exists(prefix//trim(endings(i))) .or. is_folder(prefix//trim(endings(i)))) cycle
         if (.not. remove_file(prefix//trim(endings(i)))) return     ! creating it anew says why
      end do
   end subroutine remove_old

   subroutine take_requests(self, requests)
      class(recorder_t), intent(inout) :: self
      type(output_requests_t), intent(in) :: requests
      integer :: i
      self%output = requests%output
      allocate (self%history%monitors(size(requests%monitor)), self%history%lines(size(requests%section)))
      do i = 1, size(requests%monitor)
         self%history%monitors(i)%name = requests%monitor(i)%name
         self%history%monitors(i)%set = requests%monitor(i)%set
      end do
      do i = 1, size(requests%section)
         self%history%lines(i)%name = requests%section(i)%name
         self%history%lines(i)%point = requests%section(i)%point
         self%history%lines(i)%normal = requests%section(i)%normal
      end do
      allocate (self%tables%nodes(size(requests%node_print)), self%tables%elements(size(requests%element_print)))
      self%tables%nodes = requests%node_print
      self%tables%elements = requests%element_print
      self%frames%vtkhdf = any(self%output%vtkhdf)
      self%frames%apdl = any(self%output%apdl)
   end subroutine take_requests

   !> Count iterations of a relaxation, probes included.
   subroutine count_iterations(self, n)
      class(recorder_t), intent(inout) :: self
      integer, intent(in) :: n
      call self%history%add_iterations(n)
   end subroutine count_iterations

   !> Write what is due of a state. Files that have lost their names would take it, but nobody could find it there.
   subroutine state(self, model, position, kind, row_written, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(position_t), intent(in) :: position
      !> kind of frame
      integer, intent(in) :: kind
      logical, intent(out) :: row_written
      character(len=:), allocatable, intent(out) :: error
      logical :: row, frame
      associate (output => self%output(position%step))
         if (position%in_time .and. kind /= frame_start) then
            row = position%row_due
            frame = position%frame_due
            self%events = model%events
         else if (kind == frame_after_event) then
            row = passed(self%events, model%events, output%history_events)
            frame = passed(self%events, model%events, output%field_events)
            self%events = model%events
         else
            row = kind == frame_start .or. position%last .or. every(position%increment, output%history_frequency)
            frame = kind == frame_start .or. position%last .or. every(position%increment, output%field_frequency)
         end if
      end associate
      self%row_owed = .not. row
      self%frame_owed = .not. frame
      row_written = row
      if ((row .or. frame) .and. .not. path_exists(self%file%path)) error = self%file%path// &
         ': cannot write to this file: No such file or directory (was its folder moved or removed?)'
      if (allocated(error)) return
      if (row) call self%write_row(model, position, error)
      if (allocated(error)) return
      if (frame) call self%write_frame(model, position, kind, error)
      if (allocated(error) .or. kind /= frame_settled .or. position%located) return
      call self%watch%start()
      call self%tables%write_tables(model, position, error)
      call self%watch%stop()
   end subroutine state

   !> What is due of a state of a dynamic step, rows and frames. Returns whether anything is.
   logical function look_at_time(self, position, events) result(due)
      class(recorder_t), intent(in) :: self
      type(position_t), intent(inout) :: position
      !> events so far
      integer, intent(in) :: events
      associate (output => self%output(position%step))
         position%row_due = is_due(output%history_given, output%history_frequency, output%history_events, rows_in_time)
         position%frame_due = is_due(output%field_given, output%field_frequency, output%field_events, frames_in_time)
      end associate
      due = position%row_due .or. position%frame_due .or. self%tables%due_in_time(position)

   contains

      !> At so many time steps, or equal parts of the step; and at so many events.
      logical function is_due(given, frequency, event_frequency, parts)
         logical, intent(in) :: given
         integer, intent(in) :: frequency, event_frequency, parts
         is_due = position%last
         if (given) then
            is_due = is_due .or. every(position%increment, frequency)
         else
            is_due = is_due .or. parts_done(position%load_factor, parts) > parts_done(position%last_factor, parts)
         end if
         is_due = is_due .or. passed(self%events, events, event_frequency)
      end function is_due

   end function look_at_time

   !> Equal parts of a step that are done; a time that misses one by rounding has done it.
   pure integer function parts_done(factor, parts)
      !> part of the step that is done [-]
      real(wp), intent(in) :: factor
      integer, intent(in) :: parts
      parts_done = int(factor*parts*(1 + 16*epsilon(1.0_wp)))
   end function parts_done

   !> Whether a count has reached a multiple of a frequency since it was last looked at (0: never).
   pure logical function passed(before, now, frequency)
      integer, intent(in) :: before, now, frequency
      passed = .false.
      if (frequency > 0) passed = now/frequency > before/frequency
   end function passed

   pure logical function every(count, frequency)
      integer, intent(in) :: count, frequency
      every = .false.
      if (frequency > 0) every = mod(count, frequency) == 0
   end function every

   subroutine write_row(self, model, position, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      character(len=:), allocatable, intent(out) :: error
      call self%watch%start()
      call self%history%row(model, position, self%file, error)
      call self%watch%stop()
      self%row_owed = .false.
   end subroutine write_row

   !> A frame shows the stress of every node; afterwards the criterion is looked at as if no frame had been written.
   subroutine write_frame(self, model, position, kind, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(position_t), intent(in) :: position
      integer, intent(in) :: kind
      character(len=:), allocatable, intent(out) :: error
      call model%failure%look_everywhere(model%mesh, model%material, model%motion)
      call self%watch%start()
      call self%frames%write_frame(model, position, kind, error)
      call self%watch%stop()
      call model%failure%look(model%mesh, model%material, model%motion)
      self%frame_owed = .false.
   end subroutine write_frame

   !> The run ends without equilibrium: the state that is kept, as last row and frame.
   subroutine state_not_converged(self, model, position, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(position_t), intent(in) :: position
      character(len=:), allocatable, intent(out) :: error
      call model%failure%look(model%mesh, model%material, model%motion)
      call self%write_row(model, position, error)
      if (.not. allocated(error)) call self%write_frame(model, position, frame_not_converged, error)
   end subroutine state_not_converged

   !> Write what is owed of the last state: something ends with it.
   subroutine complete(self, model, position, row_written, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(position_t), intent(in) :: position
      logical, intent(out) :: row_written
      character(len=:), allocatable, intent(out) :: error
      type(position_t) :: end_of_step
      row_written = self%row_owed
      if (self%row_owed) call self%write_row(model, position, error)
      if (self%frame_owed .and. .not. allocated(error)) call self%write_frame(model, position, frame_settled, error)
      end_of_step = position
      end_of_step%last = .true.
      if (.not. allocated(error)) call self%tables%write_tables(model, end_of_step, error)
   end subroutine complete

   !> Remember what an event's row says of the state before it.
   subroutine before_event(self, model, split)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(split_t), intent(in) :: split
      call self%history%before_event(model, split)
   end subroutine before_event

   !> The rows of the events since the last equilibrium, once the body has come to rest after them.
   subroutine write_events(self, model, position, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      type(position_t), intent(in) :: position
      character(len=:), allocatable, intent(out) :: error
      call self%watch%start()
      call self%history%write_events(model, position, self%file, error)
      call self%watch%stop()
   end subroutine write_events

   !> Sum of the reactions of a monitor [force]; the first one for an empty name.
   function monitor_reaction(self, model, name) result(force)
      class(recorder_t), intent(in) :: self
      type(model_t), intent(in) :: model
      character(len=*), intent(in) :: name
      real(wp) :: force(2)
      integer :: i, m
      m = 1
      do i = 1, size(self%history%monitors)
         if (self%history%monitors(i)%name == trim(name)) m = i
      end do
      force = self%history%monitors(m)%force(model%mesh, model%loads, model%reaction)
   end function monitor_reaction

   !> Write what is owed of the last state, unless the run goes on later, and close all files; the end of the provenance at last, as
   !> it says that all of them are complete.
   subroutine finish(self, model, position, wall_time, exit_status, interrupted, error)
      class(recorder_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      type(position_t), intent(in) :: position
      !> [s]
      real(wp), intent(in) :: wall_time
      integer, intent(in) :: exit_status
      !> the run is to go on from a checkpoint
      logical, intent(in) :: interrupted
      character(len=:), allocatable, intent(out) :: error
      logical :: row_written
      if (.not. interrupted) call self%complete(model, position, row_written, error)
      call self%watch%start()
      if (.not. allocated(error)) call self%frames%close(error)
      if (.not. allocated(error)) call self%tables%close(error)
      if (.not. allocated(error)) call self%history%close(error)
      if (.not. allocated(error)) call self%file%end_swmr(error)
      if (.not. allocated(error)) &
         call write_provenance_end(self, model, wall_time, exit_status, interrupted, error)
      if (.not. allocated(error)) call self%file%close(error)
      call self%watch%stop()
   end subroutine finish

   !> The digests are of a result: an interrupted run has none yet.
   subroutine write_provenance_end(self, model, wall_time, exit_status, interrupted, error)
      type(recorder_t), intent(in) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: wall_time
      integer, intent(in) :: exit_status
      logical, intent(in) :: interrupted
      character(len=:), allocatable, intent(out) :: error
      if (interrupted) then
         call self%provenance%write_end(self%file, wall_time, exit_status, error)
      else
         call self%provenance%write_end(self%file, wall_time, exit_status, error, digests_of(model))
      end if
   end subroutine write_provenance_end

   !> Something cannot be written: close all files of this run. Rows, frames and tables that are finished stay, in files that can
   !> be opened as any other; a file that has none is deleted.
   subroutine discard(self, resumable)
      class(recorder_t), intent(inout) :: self
      !> there is a checkpoint, from which the run can go on with these files: then all of them stay
      logical, intent(in) :: resumable
      logical :: keep
      keep = resumable .or. self%history%row_count() > 0
      call self%history%discard(keep)
      call self%file%discard(keep, sound=self%history%is_sound())
      if (keep) call mend_tables(self)
      call self%frames%discard(resumable)
      call self%tables%discard(resumable)
   end subroutine discard

   !> Make an ordinary file of what is left of JOB.h5.
   subroutine mend_tables(self)
      type(recorder_t), intent(inout) :: self
      character(len=:), allocatable :: path, error
      path = self%file%path
      call self%file%reopen(path, error)
      if (allocated(error)) return
      call self%history%mend(self%file, error)
      call self%file%discard(keep=.true., sound=.not. allocated(error))
   end subroutine mend_tables

   !> Digests of the final displacements and of the topology, in the order of the output.
   function digests_of(model) result(hex)
      type(model_t), intent(in) :: model
      character(len=16) :: hex(2)
      type(digest_t) :: displacements, topology
      real(wp), allocatable :: u(:, :)
      integer, allocatable :: connectivity(:, :)
      integer :: n, e
      associate (mesh => model%mesh)
         allocate (u(2, mesh%n_nodes), connectivity(3, mesh%n_elements))
         do n = 1, mesh%n_nodes
            u(:, mesh%node_rank(n)) = [model%motion%ux(n), model%motion%uy(n)]
         end do
         do e = 1, mesh%n_elements
            connectivity(:, mesh%element_rank(e)) = mesh%node_rank(mesh%connectivity(:, e))
         end do
      end associate
      call displacements%add(u)
      call topology%add(connectivity)
      hex = [displacements%hex(), topology%hex()]
   end function digests_of

end module rf_recorder
