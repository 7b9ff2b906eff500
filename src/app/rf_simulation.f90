!> The loop of a run: increments, the load of the first event, events round by round until nothing fails, results.
!> docs/timestep.md explains it line by line.
module rf_simulation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use rf_kinds, only: wp
   use rf_model, only: model_t
   use rf_ray, only: split_t
   use rf_relaxation, only: relaxation_settings_t, relaxed, relaxed_roughly, relaxation_mechanism, relaxation_not_finite
   use rf_failure, only: fracture_settings_t, splitting_none
   use rf_selection, only: others_of_round
   use rf_energy, only: energy_t
   use rf_loads, only: load_definition_t, renumber_definition
   use rf_removal_input, only: removal_t, mark_removed
   use rf_renumber, only: renumbering_t
   use rf_support_check, only: hold
   use rf_criterion, only: mode_tension
   use rf_position, only: position_t, frame_start, frame_before_event, frame_after_event, frame_settled, frame_not_converged
   use rf_recorder, only: recorder_t
   use rf_snapshot, only: snapshot_t
   use rf_step_input, only: step_t
   use rf_log, only: log_t, short
   use rf_text, only: to_text
   implicit none
   private
   public :: simulation_t
   public :: exit_done, exit_failed, exit_not_written

   !> exit statuses of a run (docs/deck.md)
   integer, parameter :: exit_done = 0, exit_failed = 1, exit_not_written = 3
   !> probes for the load of the first event
   integer, parameter :: max_probes = 40

   type :: simulation_t
      type(model_t) :: model
      type(step_t), allocatable :: steps(:)
      !> per step
      type(relaxation_settings_t), allocatable :: relaxation(:)
      type(fracture_settings_t), allocatable :: fracture(:)
      !> loads and supports of all steps; kinds that a step replaces (OP=NEW), (kind, step)
      type(load_definition_t), allocatable :: loads(:)
      logical, allocatable :: replaced(:, :)
      !> what is taken out of the body when a step begins
      type(removal_t), allocatable :: removals(:)
      type(recorder_t) :: recorder
      !> what the log says of the cracks that exist from the start
      character(len=:), allocatable :: cracks_note
      type(log_t) :: log
      !> exit status, and what to tell the user if it is not 0
      integer :: status = exit_done
      character(len=:), allocatable :: message
      !> time of reading the deck [s]
      real(wp) :: reading_time = 0
      !> states that were taken above the tolerance; the largest utilisation that a settled state left
      integer :: not_converged = 0
      real(wp) :: largest_settled = 0
      type(position_t) :: position
      !> total time at the start of the step
      real(wp), private :: time_before = 0
      !> events of this step; the step, or the run, is over before its last increment
      integer, private :: step_events = 0
      logical, private :: step_over = .false., run_over = .false.
      !> the last accepted equilibrium, and the one before it if nothing broke in between
      type(snapshot_t), private :: last, before
      !> STOP DROP: largest reaction of the monitor and its direction
      real(wp), private :: peak = 0, peak_direction(2) = 0
   contains
      procedure :: run
      procedure, private :: run_time_steps, stop_moving
      procedure, private :: run_step, complete_step, run_increment, settle, locate_first_event, probe, go_to, relax
      procedure, private :: one_round, one_split, split_others
      procedure, private :: excavate, record_start, note_lost_monitors
      procedure, private :: accept, record, apply_loads, watch_peak, watch_drop, stop_as_mechanism, stop_not_finite
      procedure, private :: must_locate, recording_failed, stop_not_converged, record_not_converged
   end type simulation_t

   interface
      !> All time steps of a dynamic step (rf_dynamic_step).
      module subroutine run_time_steps(self, s)
         class(simulation_t), intent(inout) :: self
         integer, intent(in) :: s
      end subroutine run_time_steps
   end interface

contains

   !> Run all steps. Everything has been read and checked.
   subroutine run(self)
      class(simulation_t), intent(inout) :: self
      integer :: s
      self%model%failure%settings = self%fracture(1)
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      call self%last%take(self%model)
      call self%record_start()
      do s = 1, size(self%steps)
         if (self%run_over) exit
         call self%run_step(s)
      end do
   end subroutine run

   !> The state before the first step. What its velocities are worth is booked when the step begins.
   subroutine record_start(self)
      class(simulation_t), intent(inout) :: self
      type(energy_t) :: energy
      logical, allocatable :: held(:, :)
      energy = self%model%energy
      if (self%steps(1)%dynamic) then
         allocate (held(2, self%model%mesh%n_nodes), source=.false.)
         call hold(self%model%mesh, pack(self%loads, starts_with(self, 1)), held)
         call self%model%dynamics%show_initial(self%model%mesh, self%model%material, held, self%model%energy)
      end if
      call self%record(frame_start)
      self%model%energy = energy
   end subroutine record_start

   !> All increments of a step.
   subroutine run_step(self, s)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: s
      integer :: i
      self%position%step = s
      self%step_over = .false.
      self%step_events = 0
      self%peak = 0
      self%before%valid = .false.
      self%last%fraction = 0
      call self%model%relaxation%begin_step(self%relaxation(s))
      self%model%failure%settings = self%fracture(s)
      call self%excavate(s)
      call self%model%loads%begin_step(self%model%mesh, pack(self%loads, starts_with(self, s)), self%replaced(:, s), &
                                       self%model%reaction, self%model%motion%ux, self%model%motion%uy)
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      if (self%steps(s)%dynamic) then
         call self%run_time_steps(s)
         self%time_before = self%position%time
         return
      end if
      call self%stop_moving()
      do i = 1, self%steps(s)%n_increments
         self%position%increment = i
         self%position%last = i == self%steps(s)%n_increments
         call self%run_increment(real(i, wp)/self%steps(s)%n_increments)
         if (self%step_over .or. self%run_over) exit
      end do
      if (self%step_over .and. .not. self%run_over) call self%complete_step()
      self%time_before = self%position%time
   end subroutine run_step

   !> A static step begins: a body that moves is stopped.
   subroutine stop_moving(self)
      class(simulation_t), intent(inout) :: self
      if (.not. abs(self%model%energy%kinetic) > 0) return
      call self%log%line('step '//to_text(self%position%step)//' is static: the body is stopped; its kinetic energy, '// &
                         short(self%model%energy%kinetic)//', counts as damped')
      call self%model%dynamics%end_step(self%model%contact, self%model%energy)
   end subroutine stop_moving

   !> Take out what the step removes. What later steps say of single nodes and elements follows the new numbers.
   subroutine excavate(self, s)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: s
      type(renumbering_t) :: map
      logical, allocatable :: gone(:)
      integer :: i
      if (.not. any(self%removals%step == s)) return
      allocate (gone(self%model%mesh%n_elements))
      gone = .false.
      do i = 1, size(self%removals)
         if (self%removals(i)%step == s) call mark_removed(self%model%mesh, self%removals, i, gone)
      end do
      if (.not. any(gone)) return
      call self%model%remove(gone, .not. self%steps(s)%dynamic, map)
      do i = 1, size(self%loads)
         call renumber_definition(self%loads(i), map)
      end do
      do i = 1, size(self%removals)
         if (self%removals(i)%entity > 0) self%removals(i)%entity = map%element_deputy(self%removals(i)%entity)
      end do
      call self%last%take(self%model)
      call self%log%line('step '//to_text(s)//': '//to_text(count(gone))//' elements removed, '// &
                         to_text(self%model%mesh%n_elements)//' are left')
      call self%note_lost_monitors()
   end subroutine excavate

   !> Monitors whose nodes have all been removed.
   subroutine note_lost_monitors(self)
      class(simulation_t), intent(inout) :: self
      integer :: i
      associate (monitors => self%recorder%history%monitors)
         do i = 1, size(monitors)
            if (.not. any(ieee_is_nan(monitors(i)%force(self%model%mesh, self%model%reaction)))) cycle
            call self%log%line('warning: all nodes of monitor '//monitors(i)%name//' have been removed: its columns are NaN '// &
                               'from here on')
         end do
      end associate
   end subroutine note_lost_monitors

   !> The step ended before its last increment: what is not due of its last state, but stands for its end.
   subroutine complete_step(self)
      class(simulation_t), intent(inout) :: self
      character(len=:), allocatable :: error
      logical :: row_written
      call self%recorder%complete(self%model, self%position, row_written, error)
      if (row_written) call self%log%row(self%model, self%position, frame_settled, self%recorder)
      if (self%recording_failed(error)) return
   end subroutine complete_step

   !> Which loads and supports a step brings: its own; the first one also those before the steps, unless it replaces them.
   pure function starts_with(self, s) result(which)
      type(simulation_t), intent(in) :: self
      integer, intent(in) :: s
      logical :: which(size(self%loads))
      integer :: i
      which = self%loads%step == s
      if (s > 1) return
      do i = 1, size(self%loads)
         if (self%loads(i)%step == 0) which(i) = .not. self%replaced(self%loads(i)%kind, 1)
      end do
   end function starts_with

   !> One increment: equilibrium at its load; where that overshoots, the first event at the load at which it happens;
   !> then all events, one at a time, until nothing fails.
   subroutine run_increment(self, fraction)
      class(simulation_t), intent(inout) :: self
      !> part of the step that is done at its end [-]
      real(wp), intent(in) :: fraction
      type(split_t) :: split
      logical :: usable
      real(wp) :: at_start
      integer :: exhausted
      do
         at_start = self%model%failure%largest
         exhausted = self%model%failure%n_exhausted
         call self%go_to(fraction, usable)
         if (.not. usable) return
         if (.not. self%must_locate(at_start)) exit
         call self%locate_first_event(fraction, at_start, usable)
         if (.not. usable) return
         call self%model%failure%plan(self%model%mesh, self%model%material, split)
         if (split%node == 0) then
            call self%last%restore(self%model)
            call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
            if (self%model%failure%n_exhausted > exhausted) cycle        ! no admissible direction there: look for the next
            call self%go_to(fraction, usable)  ! the load cannot be found (states above the tolerance): leave it
            if (.not. usable) return
            exit
         end if
         self%position%located = .true.
         call self%settle()
         self%position%located = .false.
         if (self%run_over .or. self%step_over) return
         call self%go_to(fraction, usable)
         if (.not. usable) return
         exit
      end do
      call self%settle()
      if (.not. (self%run_over .or. self%step_over)) call self%watch_drop()
   end subroutine run_increment

   !> Whether the load of the increment's first event is to be found: something fails clearly at its end that did not
   !> at its start.
   logical function must_locate(self, at_start)
      class(simulation_t), intent(in) :: self
      !> largest utilisation at the increment's start
      real(wp), intent(in) :: at_start
      associate (settings => self%model%failure%settings)
         must_locate = settings%on .and. settings%splitting /= splitting_none .and. settings%locate .and. at_start < 1 .and. &
                       self%model%failure%largest > 1 + settings%overshoot
      end associate
   end function must_locate

   !> Loads at a fraction of the step, and where that is in time.
   subroutine apply_loads(self, fraction)
      class(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: fraction
      real(wp) :: time
      time = fraction*self%steps(self%position%step)%total_time
      call self%model%loads%apply(self%model%mesh, self%model%material, merge(1.0_wp, fraction, self%position%in_time), time)
      self%position%load_factor = fraction
      self%position%time = self%time_before + time
   end subroutine apply_loads

   !> Equilibrium at a load, from where the last two equilibria point to; and a look at the criterion.
   subroutine go_to(self, fraction, usable)
      class(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: fraction
      logical, intent(out) :: usable
      call self%apply_loads(fraction)
      if (self%before%valid) call self%before%interpolate(self%last, fraction, self%model)
      call self%relax(self%model%relaxation%settings%tolerance, usable)
      if (usable) call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
   end subroutine go_to

   !> Relax and judge the outcome.
   subroutine relax(self, tolerance, usable)
      class(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: tolerance
      !> the state may be taken
      logical, intent(out) :: usable
      call self%model%equilibrate(tolerance)
      call self%recorder%count_iterations(self%model%relaxation%iterations)
      usable = .true.
      select case (self%model%relaxation%outcome)
      case (relaxed)
      case (relaxed_roughly)
         self%not_converged = self%not_converged + 1
      case (relaxation_mechanism)
         call self%stop_as_mechanism()
         usable = .false.
      case (relaxation_not_finite)
         call self%stop_not_finite()
         usable = .false.
      case default
         self%not_converged = self%not_converged + 1
         if (self%model%relaxation%settings%continue_anyway) return
         call self%stop_not_converged()
         usable = .false.
      end select
   end subroutine relax

   !> The load at which the increment's first event happens: utilisation between 1 and 1 + OVERSHOOT, by false position
   !> (Illinois; theory: eq. 36) between the increment's ends. Probes start from the last equilibrium and leave nothing behind.
   subroutine locate_first_event(self, end_fraction, at_start, usable)
      class(simulation_t), intent(inout) :: self
      real(wp), intent(in) :: end_fraction, at_start
      logical, intent(out) :: usable
      type(snapshot_t) :: beyond
      real(wp) :: low, high, f_low, f_high, fraction, target, f
      integer :: i, side
      call beyond%take(self%model)
      beyond%fraction = end_fraction
      low = self%last%fraction
      high = end_fraction
      target = 1 + 0.5_wp*self%model%failure%settings%overshoot
      f_low = at_start - target
      f_high = self%model%failure%largest - target
      side = 0
      do i = 1, max_probes
         fraction = (low*f_high - high*f_low)/(f_high - f_low)
         if (.not. (fraction > low .and. fraction < high)) fraction = 0.5_wp*(low + high)
         call self%probe(beyond, fraction, usable)
         if (.not. usable) return
         f = self%model%failure%largest - target
         if (abs(f) <= 0.5_wp*self%model%failure%settings%overshoot) return
         if (f > 0) then
            high = fraction
            f_high = f
            if (side == 1) f_low = 0.5_wp*f_low
            side = 1
         else
            low = fraction
            f_low = f
            if (side == -1) f_high = 0.5_wp*f_high
            side = -1
         end if
         if (high - low <= 4*epsilon(1.0_wp)) exit
      end do
      ! the utilisation jumps over the band (the paper's criterion does): the first load at which it is above
      call self%probe(beyond, high, usable)
   end subroutine locate_first_event

   !> Equilibrium at a load of the increment, starting on the line between its ends.
   subroutine probe(self, beyond, fraction, usable)
      class(simulation_t), intent(inout) :: self
      type(snapshot_t), intent(in) :: beyond
      real(wp), intent(in) :: fraction
      logical, intent(out) :: usable
      call self%last%restore(self%model)
      call self%apply_loads(fraction)
      call self%last%interpolate(beyond, fraction, self%model)
      call self%relax(self%model%relaxation%settings%tolerance, usable)
      if (usable) call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
   end subroutine probe

   !> Take the equilibrium and let everything break that fails at this load, one node at a time.
   subroutine settle(self)
      class(simulation_t), intent(inout) :: self
      type(split_t) :: split
      logical :: usable
      call self%accept(at_event=.false.)
      call plan_next(self, split)
      if (split%node > 0) then
         call self%record(frame_before_event)
         do
            do while (split%node > 0)
               if (self%run_over) return
               call self%one_round(split, usable)
               if (.not. usable) return
               call plan_next(self, split)
            end do
            associate (settings => self%model%relaxation%settings)
               if (self%model%relaxation%residual <= settings%tolerance .or. &
                   settings%event_tolerance <= settings%tolerance) exit
               call self%relax(settings%tolerance, usable)      ! what is recorded is relaxed to TOLERANCE
               if (.not. usable) return
            end associate
            call self%accept(at_event=.false.)
            call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
            call plan_next(self, split)
            if (split%node == 0) exit
         end do
      end if
      ! exhausted nodes are out now: what is largest must not depend on whether a frame looks everywhere
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      if (self%model%failure%settings%on .and. .not. self%step_over) &
         self%largest_settled = max(self%largest_settled, self%model%failure%largest)
      call self%record(frame_settled)
   end subroutine settle

   !> The next split, or none: nothing fails, fracture is off, or the step has had its events.
   subroutine plan_next(self, split)
      class(simulation_t), intent(inout) :: self
      type(split_t), intent(out) :: split
      associate (settings => self%model%failure%settings)
         if (.not. settings%on .or. settings%splitting == splitting_none .or. self%step_over) return
         call self%model%failure%plan(self%model%mesh, self%model%material, split)
         if (split%node == 0 .or. settings%max_events == 0 .or. self%step_events < settings%max_events) return
         split%node = 0
         self%step_over = .true.
         call self%log%line('step '//to_text(self%position%step)//' stopped: MAX EVENTS='//to_text(settings%max_events))
      end associate
   end subroutine plan_next

   !> Split, the planned node alone or with others (SELECT), and relax at the same load.
   subroutine one_round(self, split, usable)
      class(simulation_t), intent(inout) :: self
      type(split_t), intent(in) :: split
      logical, intent(out) :: usable
      integer, allocatable :: others(:)
      character(len=:), allocatable :: error
      call others_of_round(self%model%failure, self%model%mesh, split%node, others)      ! before anything changes
      call self%one_split(split)
      call self%split_others(others)
      self%before%valid = .false.
      call self%last%take(self%model)
      self%last%fraction = self%position%load_factor
      self%model%energy%released_by_event = 0
      call self%relax(self%model%relaxation%settings%event_tolerance, usable)
      if (self%status == exit_not_written) return
      if (usable) then
         call self%accept(at_event=.true.)
         call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      end if
      call self%recorder%write_events(self%model, self%position, error)        ! one that ends the run is an event too
      if (self%recording_failed(error) .or. .not. usable) return
      call self%record(frame_after_event)
   end subroutine one_round

   !> One split, and what is counted of it.
   subroutine one_split(self, split)
      class(simulation_t), intent(inout) :: self
      type(split_t), intent(in) :: split
      call self%recorder%before_event(self%model, split)
      call self%model%split(split, merge(1.0_wp, self%position%load_factor, self%position%in_time), &
                            self%position%load_factor*self%steps(self%position%step)%total_time)
      self%step_events = self%step_events + 1
      if (split%mode == mode_tension) then
         self%model%events_tension = self%model%events_tension + 1
      else
         self%model%events_shear = self%model%events_shear + 1
      end if
   end subroutine one_split

   !> The other nodes of a round, as long as the step may have events: each planned on the mesh that the splits before it
   !> have left. One whose elements they changed waits for the next look.
   subroutine split_others(self, others)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: others(:)
      type(split_t) :: split
      integer :: i
      associate (settings => self%model%failure%settings)
         do i = 1, size(others)
            if (settings%max_events > 0 .and. self%step_events >= settings%max_events) exit
            call self%model%failure%plan_at(self%model%mesh, self%model%material, others(i), split)
            if (split%node > 0) call self%one_split(split)
         end do
      end associate
   end subroutine split_others

   !> The equilibrium is part of the answer.
   subroutine accept(self, at_event)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: at_event
      call self%model%accept(at_event)
      if (.not. at_event .and. self%last%valid .and. self%position%load_factor > self%last%fraction) then
         self%before = self%last
      else
         self%before%valid = .false.
      end if
      call self%last%take(self%model)
      self%last%fraction = self%position%load_factor
      call self%watch_peak()
   end subroutine accept

   !> Write what is due of a state, and a row of the log.
   subroutine record(self, kind)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: kind
      character(len=:), allocatable :: error
      logical :: row_written
      call self%recorder%state(self%model, self%position, kind, row_written, error)
      if (row_written) call self%log%row(self%model, self%position, kind, self%recorder)
      call self%log%progress(self%model, self%position, self%steps(self%position%step)%n_increments, size(self%steps))
      if (self%recording_failed(error)) return
   end subroutine record

   !> A result file could not be written: the run is over.
   logical function recording_failed(self, error) result(failed)
      class(simulation_t), intent(inout) :: self
      character(len=:), allocatable, intent(in) :: error
      failed = allocated(error)
      if (.not. failed) return
      self%status = exit_not_written
      self%message = error
      self%run_over = .true.
   end function recording_failed

   !> STOP DROP: the monitor's largest reaction so far in this step.
   subroutine watch_peak(self)
      class(simulation_t), intent(inout) :: self
      real(wp) :: force(2)
      if (.not. self%model%failure%settings%stop_drop > 0) return
      force = self%recorder%monitor_reaction(self%model, self%model%failure%settings%monitor)
      if (any(ieee_is_nan(force))) return          ! its nodes have been removed
      if (.not. norm2(force) > self%peak) return
      self%peak = norm2(force)
      self%peak_direction = force/self%peak
   end subroutine watch_peak

   !> STOP DROP: the step ends when the reaction has fallen by that part of its peak (theory: eq. 37).
   subroutine watch_drop(self)
      class(simulation_t), intent(inout) :: self
      real(wp) :: force(2), drop
      drop = self%model%failure%settings%stop_drop
      if (.not. (drop > 0 .and. self%peak > 0) .or. self%step_events == 0) return
      force = self%recorder%monitor_reaction(self%model, self%model%failure%settings%monitor)
      if (dot_product(force, self%peak_direction) > (1 - drop)*self%peak) return
      self%step_over = .true.
      call self%log%line('step '//to_text(self%position%step)//' stopped: STOP DROP='//to_text(drop)// &
                         ', the reaction has fallen to '//short(dot_product(force, self%peak_direction))//' from its peak of '// &
                         short(self%peak))
   end subroutine watch_drop

   !> A piece that loads drive comes to no rest: the expected end under load control. The last equilibrium is the answer.
   subroutine stop_as_mechanism(self)
      class(simulation_t), intent(inout) :: self
      integer :: n
      do n = 1, self%model%mesh%n_nodes
         if (self%model%pieces%of_node(n) == self%model%relaxation%piece) exit
      end do
      call self%log%line('stopped: mechanism. Fragment '//to_text(self%model%relaxation%piece)//' (node '// &
                         to_text(self%model%mesh%node_id(n))//') comes to no rest at load factor '// &
                         short(self%position%load_factor)//'; the last equilibrium is kept')
      call self%last%restore(self%model)
      call self%apply_loads(self%last%fraction)
      self%run_over = .true.
      call self%record_not_converged()
   end subroutine stop_as_mechanism

   !> The iteration limit was reached far from equilibrium.
   subroutine stop_not_converged(self)
      class(simulation_t), intent(inout) :: self
      self%status = exit_failed
      self%run_over = .true.
      associate (relaxation => self%model%relaxation)
         self%message = 'the relaxation of step '//to_text(self%position%step)//', increment '// &
                        to_text(self%position%increment)//' reached MAX ITERATIONS='// &
                        to_text(relaxation%settings%max_iterations)//' with a residual of '//short(relaxation%residual)// &
                        '; above 100 x TOLERANCE a state is not taken unless *RELAXATION says CONTINUE=YES'
      end associate
      call self%record_not_converged()
   end subroutine stop_not_converged

   !> The state with which a run ends that found no equilibrium: a row, a frame, a row of the log.
   subroutine record_not_converged(self)
      class(simulation_t), intent(inout) :: self
      character(len=:), allocatable :: error
      call self%recorder%state_not_converged(self%model, self%position, error)
      if (self%recording_failed(error)) return
      call self%log%row(self%model, self%position, frame_not_converged, self%recorder)
   end subroutine record_not_converged

   !> A force or velocity is not finite.
   subroutine stop_not_finite(self)
      class(simulation_t), intent(inout) :: self
      integer :: node, element
      self%status = exit_failed
      self%run_over = .true.
      node = self%model%relaxation%node
      if (node == 0) node = most_forced_node(self%model)        ! squares overflow before their forces do
      element = self%model%mesh%element_of(node)
      self%message = 'a force is not a finite number at node '//to_text(self%model%mesh%node_id(node))//' (element '// &
                     to_text(self%model%mesh%element_id(element))//'), step '//to_text(self%position%step)//', increment '// &
                     to_text(self%position%increment)//', iteration '//to_text(self%model%relaxation%iterations)// &
                     '; the likely cause: numbers of very different size in units, stiffness or loads'
      call self%last%restore(self%model)
      call self%apply_loads(self%last%fraction)
      call self%record_not_converged()
   end subroutine stop_not_finite

   !> The node with the largest force on it.
   pure integer function most_forced_node(model) result(node)
      type(model_t), intent(in) :: model
      associate (n => model%mesh%n_nodes, motion => model%motion)
         node = maxloc(max(abs(model%loads%px(:n) - motion%fx(:n)), abs(model%loads%py(:n) - motion%fy(:n))), dim=1)
      end associate
   end function most_forced_node

end module rf_simulation
