!> The loop of a run: a sequence of stages, most of them a relaxation and what comes of it. Between two stages, and after any
!> step of a relaxation, all of the run is in this type, so that it can be left there. docs/timestep.md explains it line by line.
module rf_simulation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_interruption, only: interruption_t
   use rf_model, only: model_t
   use rf_ray, only: split_t
   use rf_relaxation, only: relaxation_settings_t, relaxed, relaxed_roughly, relaxation_mechanism, relaxation_not_finite
   use rf_failure, only: fracture_settings_t
   use rf_energy, only: energy_t
   use rf_loads, only: load_definition_t
   use rf_removal_input, only: removal_t
   use rf_support_check, only: hold
   use rf_position, only: position_t, frame_start, frame_settled
   use rf_recorder, only: recorder_t
   use rf_snapshot, only: snapshot_t
   use rf_search, only: search_t
   use rf_step_input, only: step_t
   use rf_restart_input, only: restart_settings_t
   use rf_log, only: log_t, short
   use rf_text, only: to_text
   implicit none
   private
   public :: simulation_t
   public :: exit_done, exit_failed, exit_not_written, exit_interrupted

   !> exit statuses of a run (docs/deck.md)
   integer, parameter :: exit_done = 0, exit_failed = 1, exit_not_written = 3, exit_interrupted = 4
   !> What the run does next. Nothing yet: row 0 is due; a step begins; a time step of a dynamic step; the run is over.
   integer, parameter :: stage_start = 0, stage_step = 1, stage_time_step = 2, stage_over = 3
   !> A relaxation: to the load of the increment; to a trial load; to the increment's own load after the search for its first
   !> event; after an event; to TOLERANCE where events were chosen by a coarser one.
   integer, parameter :: stage_increment = 4, stage_search = 5, stage_own_load = 6, stage_event = 7, stage_refine = 8

   type :: simulation_t
      type(model_t) :: model
      type(step_t), allocatable :: steps(:)
      !> per step
      type(relaxation_settings_t), allocatable :: relaxation(:)
      type(fracture_settings_t), allocatable :: fracture(:)
      !> loads and supports of all steps; kinds that a step replaces (OP=NEW), (kind, step)
      type(load_definition_t), allocatable :: loads(:)
      logical, allocatable :: replaced(:, :)
      !> when checkpoints are written
      type(restart_settings_t) :: restart
      !> what is taken out of the body when a step begins
      type(removal_t), allocatable :: removals(:)
      type(recorder_t) :: recorder
      !> what the log says of the cracks that exist from the start
      character(len=:), allocatable :: cracks_note
      type(log_t) :: log
      !> whether the run is to be left, or a checkpoint to be written
      type(interruption_t) :: interruption
      !> exit status, and what to tell the user if it is not 0
      integer :: status = exit_done
      character(len=:), allocatable :: message
      !> time of reading the deck; of the whole run, by all processes that it went through, at the last checkpoint [s]
      real(wp) :: reading_time = 0, wall_time = 0
      !> states that were taken above the tolerance; the largest utilisation that a settled state left
      integer :: not_converged = 0
      real(wp) :: largest_settled = 0
      type(position_t) :: position
      !> what comes next
      integer, private :: stage = stage_start
      !> total time at the start of the step
      real(wp), private :: time_before = 0
      !> steps that are done; events of this step; the step, or the run, is over before its last increment
      integer, private :: steps_done = 0, step_events = 0
      logical, private :: step_over = .false., run_over = .false.
      !> the last accepted equilibrium, and the one before it if nothing broke in between
      type(snapshot_t), private :: last, before
      !> at the start of the increment: largest utilisation, exhausted nodes
      real(wp), private :: utilisation_before = 0
      integer, private :: exhausted_before = 0
      type(search_t), private :: search
      !> dynamic step: time steps so far; those so far, and the step time [time], when the time increment was set last
      integer, private :: time_steps = 0, set_at = 0
      real(wp), private :: set_time = 0
      !> STOP DROP: largest reaction of the monitor and its direction
      real(wp), private :: peak = 0, peak_direction(2) = 0
   contains
      procedure :: run, is_over, place, ending, exchange
      procedure, private :: start, begin_step, end_step, next_increment, begin_increment, head_for, relax, decide
      procedure, private :: mark_checkpoint, accept, record, recording_failed, apply_loads, watch_peak, watch_drop
      ! rf_first_event
      procedure, private :: must_locate, begin_search, after_trial
      ! rf_events
      procedure, private :: settle, after_event, go_on_breaking, settled, one_round, one_split, split_others
      ! rf_dynamic_step
      procedure, private :: begin_time_steps, one_time_step
      ! rf_new_numbers
      procedure, private :: excavate, follow_growth
      ! rf_simulation_state: exchange
      ! rf_endings
      procedure, private :: stop_as_mechanism, stop_not_finite, stop_not_converged
   end type simulation_t

   interface

      !> Whether the load of the increment's first event is to be found: something fails clearly at its end that did not
      !> at its start.
      pure module function must_locate(self) result(must)
         class(simulation_t), intent(in) :: self
         logical :: must
      end function must_locate

      !> Begin to search for the load at which the increment's first event happens.
      module subroutine begin_search(self)
         class(simulation_t), intent(inout) :: self
      end subroutine begin_search

      !> The body has relaxed at a trial load: it is the one, or the next is tried.
      module subroutine after_trial(self)
         class(simulation_t), intent(inout) :: self
      end subroutine after_trial

      !> Take the equilibrium and let everything break that fails at this load, one node at a time.
      module subroutine settle(self)
         class(simulation_t), intent(inout) :: self
      end subroutine settle

      !> The body has relaxed after an event, or found no rest.
      module subroutine after_event(self, usable)
         class(simulation_t), intent(inout) :: self
         !> the state may be taken
         logical, intent(in) :: usable
      end subroutine after_event

      !> Whatever fails next at this load; if nothing does, the state is settled.
      module subroutine go_on_breaking(self)
         class(simulation_t), intent(inout) :: self
      end subroutine go_on_breaking

      !> Nothing fails any more at this load.
      module subroutine settled(self)
         class(simulation_t), intent(inout) :: self
      end subroutine settled

      !> Split, the planned node alone or with others (SELECT); the relaxation at the same load comes next.
      module subroutine one_round(self, split)
         class(simulation_t), intent(inout) :: self
         type(split_t), intent(in) :: split
      end subroutine one_round

      !> One split, and what is counted of it.
      module subroutine one_split(self, split)
         class(simulation_t), intent(inout) :: self
         type(split_t), intent(in) :: split
      end subroutine one_split

      !> The other nodes of a round.
      module subroutine split_others(self, others)
         class(simulation_t), intent(inout) :: self
         integer, intent(in) :: others(:)
      end subroutine split_others

      !> A dynamic step begins.
      module subroutine begin_time_steps(self)
         class(simulation_t), intent(inout) :: self
      end subroutine begin_time_steps

      !> A state of a dynamic step, and the way to the next.
      module subroutine one_time_step(self)
         class(simulation_t), intent(inout) :: self
      end subroutine one_time_step

      !> Take out what the step removes. What later steps say of single nodes and elements follows the new numbers.
      module subroutine excavate(self, s)
         class(simulation_t), intent(inout) :: self
         integer, intent(in) :: s
      end subroutine excavate

      !> Number the mesh anew where it has grown enough, or by more nodes than are given. The states that the run may come back
      !> to are not carried: this stands where the present state is taken next.
      module subroutine follow_growth(self, by_more_than)
         class(simulation_t), intent(inout) :: self
         integer, intent(in), optional :: by_more_than
      end subroutine follow_growth

      !> To or from a checkpoint: all that the deck does not say.
      module subroutine exchange(self, archive)
         class(simulation_t), intent(inout) :: self
         class(archive_t), intent(inout) :: archive
      end subroutine exchange

      !> A piece that loads drive comes to no rest: the expected end under load control. The last equilibrium is the answer.
      module subroutine stop_as_mechanism(self)
         class(simulation_t), intent(inout) :: self
      end subroutine stop_as_mechanism

      !> The iteration limit was reached far from equilibrium.
      module subroutine stop_not_converged(self)
         class(simulation_t), intent(inout) :: self
      end subroutine stop_not_converged

      !> A force or velocity is not finite.
      module subroutine stop_not_finite(self)
         class(simulation_t), intent(inout) :: self
      end subroutine stop_not_finite

   end interface

contains

   !> Run, or go on, until all steps are done or somebody interrupts. Everything has been read and checked.
   subroutine run(self)
      class(simulation_t), intent(inout) :: self
      logical :: usable
      do while (self%stage /= stage_over)
         select case (self%stage)
         case (stage_start)
            call self%start()
         case (stage_step)
            call self%begin_step()
         case (stage_time_step)
            call self%one_time_step()
         case default
            call self%relax(usable)
            if (self%model%relaxation%under_way) exit
            call self%decide(usable)
         end select
         if (self%run_over) then
            self%stage = stage_over
            self%position%located = .false.
         end if
         if (self%interruption%asked()) exit
      end do
   end subroutine run

   !> An increment is done: is a checkpoint due?
   subroutine mark_checkpoint(self, due)
      class(simulation_t), intent(inout) :: self
      !> it is the turn of this increment
      logical, intent(in) :: due
      if (self%restart%write .and. (due .or. self%position%last .or. self%step_over)) self%interruption%save = .true.
   end subroutine mark_checkpoint

   !> Whether nothing is left to do.
   pure logical function is_over(self)
      class(simulation_t), intent(in) :: self
      is_over = self%stage == stage_over
   end function is_over

   !> Where the run stands, for the log.
   function place(self) result(text)
      class(simulation_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'step '//to_text(self%position%step)//', increment '//to_text(self%position%increment)//', load factor '// &
             short(self%position%load_factor)//', '//to_text(self%model%events)//' events'
      if (self%model%relaxation%under_way) text = text//', iteration '//to_text(self%model%relaxation%iterations)
   end function place

   !> What ended a run of which nothing is left to do, for the log.
   function ending(self) result(text)
      class(simulation_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = 'all steps are done'
      if (self%steps_done < size(self%steps)) then
         text = 'a fragment came to no rest: mechanism'
      else if (self%step_over) then
         associate (settings => self%model%failure%settings)
            text = 'STOP DROP'
            if (settings%max_events > 0 .and. self%step_events >= settings%max_events) then
               text = 'MAX EVENTS'
               if (settings%stop_drop > 0) text = 'MAX EVENTS or STOP DROP'
            end if
         end associate
         text = 'its last step was stopped by '//text
      end if
   end function ending

   !> The state before the first step: row and frame 0. What its velocities are worth is booked when the step begins.
   subroutine start(self)
      class(simulation_t), intent(inout) :: self
      type(energy_t) :: energy
      logical, allocatable :: held(:, :)
      call self%follow_growth(by_more_than=0)      ! by cracks that there are from the start
      self%model%failure%settings = self%fracture(1)
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      call self%last%take(self%model)
      energy = self%model%energy
      if (self%steps(1)%dynamic) then
         allocate (held(2, self%model%mesh%n_nodes), source=.false.)
         call hold(self%model%mesh, pack(self%loads, starts_with(self, 1)), held)
         call self%model%dynamics%show_initial(self%model%mesh, self%model%material, held, self%model%energy)
      end if
      call self%record(frame_start)
      self%model%energy = energy
      self%stage = stage_step
   end subroutine start

   !> The next step: its settings, what it takes out, its loads; then its first increment.
   subroutine begin_step(self)
      class(simulation_t), intent(inout) :: self
      integer :: s
      s = self%steps_done + 1
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
      self%position%increment = 0
      if (self%steps(s)%dynamic) then
         call self%begin_time_steps()
      else
         call stop_moving(self)
         call self%next_increment()
      end if
   end subroutine begin_step

   !> A static step begins: a body that moves is stopped.
   subroutine stop_moving(self)
      type(simulation_t), intent(inout) :: self
      if (.not. abs(self%model%energy%kinetic) > 0) return
      call self%log%line('step '//to_text(self%position%step)//' is static: the body is stopped; its kinetic energy, '// &
                         short(self%model%energy%kinetic)//', counts as damped')
      call self%model%dynamics%end_step(self%model%contact, self%model%energy)
   end subroutine stop_moving

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

   !> The step is done. One that ended before its last increment writes what was not due of its last state, but stands for
   !> its end.
   subroutine end_step(self)
      class(simulation_t), intent(inout) :: self
      character(len=:), allocatable :: error
      logical :: row_written
      if (self%step_over .and. .not. self%steps(self%position%step)%dynamic) then
         call self%recorder%complete(self%model, self%position, row_written, error)
         if (row_written) call self%log%row(self%model, self%position, frame_settled, self%recorder)
         if (self%recording_failed(error)) return
      end if
      self%time_before = self%position%time
      self%steps_done = self%steps_done + 1
      self%stage = stage_step
      if (self%steps_done == size(self%steps)) self%stage = stage_over
   end subroutine end_step

   !> The next increment of the step, if there is one.
   subroutine next_increment(self)
      class(simulation_t), intent(inout) :: self
      associate (n => self%steps(self%position%step)%n_increments)
         if (self%step_over .or. self%position%increment == n) then
            call self%end_step()
            return
         end if
         self%position%increment = self%position%increment + 1
         self%position%last = self%position%increment == n
      end associate
      call self%begin_increment()
   end subroutine next_increment

   !> To the load of the increment.
   subroutine begin_increment(self)
      class(simulation_t), intent(inout) :: self
      self%utilisation_before = self%model%failure%largest
      self%exhausted_before = self%model%failure%n_exhausted
      call self%head_for(stage_increment)
   end subroutine begin_increment

   !> Set the increment's own load; the relaxation starts from where the last two equilibria point to.
   subroutine head_for(self, stage)
      class(simulation_t), intent(inout) :: self
      !> what the relaxation is for
      integer, intent(in) :: stage
      self%stage = stage
      call self%apply_loads(own_fraction(self))
      if (self%before%valid) call self%before%interpolate(self%last, own_fraction(self), self%model)
   end subroutine head_for

   !> Part of the step that is done at the end of the increment [-].
   pure real(wp) function own_fraction(self)
      type(simulation_t), intent(in) :: self
      own_fraction = real(self%position%increment, wp)/self%steps(self%position%step)%n_increments
   end function own_fraction

   !> Relax, until equilibrium or an interruption, and judge the outcome.
   subroutine relax(self, usable)
      class(simulation_t), intent(inout) :: self
      !> the state may be taken
      logical, intent(out) :: usable
      usable = .true.
      associate (settings => self%model%relaxation%settings)
         call self%model%equilibrate(merge(settings%event_tolerance, settings%tolerance, self%stage == stage_event), &
                                     self%interruption)
      end associate
      if (self%model%relaxation%under_way) return
      call self%recorder%count_iterations(self%model%relaxation%iterations)
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

   !> What comes after a relaxation.
   subroutine decide(self, usable)
      class(simulation_t), intent(inout) :: self
      !> the state may be taken; if not, the run is over
      logical, intent(in) :: usable
      if (self%stage == stage_event) then
         call self%after_event(usable)
         return
      end if
      if (.not. usable) return
      if (self%stage == stage_refine) call self%accept(at_event=.false.)
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      select case (self%stage)
      case (stage_increment)
         if (self%must_locate()) then
            call self%begin_search()
         else
            call self%settle()
         end if
      case (stage_search)
         call self%after_trial()
      case (stage_own_load)
         call self%settle()
      case (stage_refine)
         call self%go_on_breaking()
      end select
   end subroutine decide

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

end module rf_simulation
