!> A dynamic step of a run (*DYNAMIC, EXPLICIT): time steps, looks at the criterion with all splits of the moment, results.
submodule(rf_simulation) rf_dynamic_step
   use rf_kinds, only: i8
   use rf_failure, only: select_all, splitting_none
   use rf_relaxation, only: reaction
   use rf_selection, only: failing_nodes, separated_nodes, distance_or_default
   implicit none

   !> a number of time steps that misses a whole one by this part of it is that
   real(wp), parameter :: whole_to = 1.0e-12_wp
   !> checkpoints of a step unless the deck says FREQUENCY
   integer, parameter :: checkpoints = 20
   !> all nodes that fail may split, however far below the largest utilisation they are
   real(wp), parameter :: no_window = 1.0_wp

contains

   module subroutine one_time_step(self)
      class(simulation_t), intent(inout) :: self
      real(wp) :: time
      logical :: due
      associate (n => self%time_steps, step => self%steps(self%position%step))
         self%position%last = n == step%n_increments
         time = self%set_time + (n - self%set_at)*self%model%dynamics%time_step
         if (self%position%last) time = step%total_time
         call go_to_time(self, n, time)
         if (n > 0 .and. (mod(n, step%look) == 0 .or. self%position%last)) then
            if (look_and_split(self)) then
               call choose_time_step(self, n, time)
               self%set_at = n
               self%set_time = time
            end if
         end if
         self%position%last = self%position%last .or. self%step_over
         due = .false.
         if (n > 0) due = self%recorder%look_at_time(self%position, self%model%events)
         call evaluate(self, due, time + self%model%dynamics%time_step)
         if (self%run_over) return
         if (due) call record_state(self)
         if (self%run_over) return
         call self%mark_checkpoint(n > 0 .and. checkpoint_due(self))
         if (self%position%last) then
            call finish(self, time)
            return
         end if
         call self%model%dynamics%move(self%model%mesh, self%model%contact, self%model%loads, self%model%motion, &
                                       self%model%energy)
         call self%recorder%count_iterations(1)
         n = n + 1
      end associate
   end subroutine one_time_step

   !> Every so many time steps, or at equal parts of the step.
   pure logical function checkpoint_due(self) result(due)
      type(simulation_t), intent(in) :: self
      if (self%restart%given) then
         due = mod(self%time_steps, self%restart%frequency) == 0
      else
         due = int(self%position%load_factor*checkpoints) > int(self%position%last_factor*checkpoints)
      end if
   end function checkpoint_due

   module subroutine begin_time_steps(self)
      class(simulation_t), intent(inout) :: self
      integer :: s
      s = self%position%step
      self%stage = stage_time_step
      self%time_steps = 0
      self%set_at = 0
      self%set_time = 0
      self%position%in_time = .true.
      self%position%load_factor = 0
      associate (model => self%model)
         model%relaxation%b = 1
         model%relaxation%iterations = 0
         model%relaxation%residual = 0
         model%relaxation%outcome = relaxed
         call model%loads%apply_forces(model%mesh, model%material, 1.0_wp, 0.0_wp)
         call model%dynamics%begin_step(model%mesh, model%material, model%rows, model%contact, model%loads, model%motion)
      end associate
      self%steps(s)%n_increments = 0
      call choose_time_step(self, 0, 0.0_wp)
      call self%log%line('step '//to_text(s)//': explicit dynamics, '//to_text(self%steps(s)%n_increments)//' time steps of '// &
                         short(self%model%dynamics%time_step)//' (the longest that is safe is '// &
                         short(self%model%dynamics%safe)//')')
   end subroutine begin_time_steps

   !> Equal time steps from here to the end of the step, not longer than is safe and than the deck wants. While the present
   !> ones are safe they stay.
   subroutine choose_time_step(self, n, time)
      class(simulation_t), intent(inout) :: self
      !> time steps so far
      integer, intent(in) :: n
      !> step time [time]
      real(wp), intent(in) :: time
      real(wp) :: limit, left
      integer :: steps
      associate (step => self%steps(self%position%step), dynamics => self%model%dynamics)
         limit = dynamics%safe
         if (step%time_increment > 0) limit = min(limit, step%time_increment)
         left = step%total_time - time
         if (n > 0) then
            if (dynamics%time_step <= dynamics%safe .or. .not. left > 0) limit = dynamics%time_step
         end if
         steps = ceiling(left/limit*(1 - whole_to))
         if (n == 0) steps = max(1, steps)
         step%n_increments = n + steps
         if (steps > 0 .and. (n == 0 .or. limit < dynamics%time_step)) limit = left/steps
         call dynamics%set_time_step(limit, self%model%mesh, self%model%contact, self%model%loads, self%model%motion)
      end associate
   end subroutine choose_time_step

   !> Where the state is in time, and the loads there.
   subroutine go_to_time(self, n, time)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: time
      self%position%increment = n
      self%position%last_factor = self%position%load_factor
      self%position%load_factor = time/self%steps(self%position%step)%total_time
      self%position%time = self%time_before + time
      if (n > 0 .and. self%model%dynamics%forces_vary) &
         call self%model%loads%apply_forces(self%model%mesh, self%model%material, 1.0_wp, time)
   end subroutine go_to_time

   !> Forces and velocities of the present state; it ends the run if they are not finite.
   subroutine evaluate(self, shown, next_time)
      class(simulation_t), intent(inout) :: self
      !> the state will be shown
      logical, intent(in) :: shown
      !> step time of the next state [time]
      real(wp), intent(in) :: next_time
      integer(i8) :: ticks(2), rate
      integer :: node
      call system_clock(ticks(1), rate)
      associate (model => self%model)
         call model%dynamics%evaluate(model%mesh, model%rows, model%contact, model%loads, model%motion, model%energy, shown, &
                                      next_time)
         call system_clock(ticks(2))
         model%relaxation%seconds = model%relaxation%seconds + real(ticks(2) - ticks(1), wp)/real(rate, wp)
         model%relaxation%element_updates = model%relaxation%element_updates + model%mesh%n_elements
         node = model%dynamics%not_finite(model%mesh, model%rows, model%motion)
         if (node == 0) return
         model%relaxation%node = node
         model%relaxation%outcome = relaxation_not_finite
      end associate
      call self%stop_not_finite()
   end subroutine evaluate

   !> Look at the criterion at the present moment, and split all separated nodes that fail, by falling utilisation. Returns
   !> whether anything split.
   logical function look_and_split(self) result(changed)
      class(simulation_t), intent(inout) :: self
      integer, allocatable :: nodes(:)
      type(split_t) :: split
      real(wp) :: kinetic
      integer :: i, events
      changed = .false.
      call self%log%progress(self%model, self%position, self%steps(self%position%step)%n_increments, size(self%steps))
      associate (model => self%model, settings => self%model%failure%settings)
         if (.not. settings%on) return
         call model%failure%shield(model%mesh, model%contact%bonds())
         call model%failure%look(model%mesh, model%material, model%motion)
         call find_reactions(self)        ! of the state before: the forces of this one are not known yet
         call self%watch_peak()
         if (settings%splitting == splitting_none) return
         if (settings%selection == select_all) then
            call failing_nodes(model%failure, model%mesh, nodes)
         else
            call separated_nodes(model%failure, model%mesh, distance_or_default(settings%distance, model%mesh), no_window, nodes)
         end if
         events = self%step_events
         kinetic = model%dynamics%kinetic_energy_before(model%mesh%n_nodes, model%motion)
         call model%dynamics%book_loads(model%mesh%n_nodes, model%loads, model%motion, model%energy)
         do i = 1, size(nodes)
            if (settings%max_events > 0 .and. self%step_events >= settings%max_events) then
               self%step_over = .true.
               call self%log%line('step '//to_text(self%position%step)//' stopped: MAX EVENTS='//to_text(settings%max_events))
               exit
            end if
            call model%failure%plan_at(model%mesh, model%material, nodes(i), split)
            if (split%node > 0) call self%one_split(split)
         end do
         changed = self%step_events > events
      end associate
      if (changed) call follow_splits(self, kinetic)
      call self%watch_drop()
   end function look_and_split

   !> Everything dynamic follows the splits of a moment; the events' rows.
   subroutine follow_splits(self, kinetic)
      class(simulation_t), intent(inout) :: self
      !> kinetic energy before [force length]
      real(wp), intent(in) :: kinetic
      character(len=:), allocatable :: error
      call self%follow_growth()
      associate (model => self%model, energy => self%model%energy)
         call model%dynamics%follow_split(model%mesh, model%material, model%rows, model%contact, model%loads, model%motion)
         energy%released_by_event = kinetic - model%dynamics%kinetic_energy_before(model%mesh%n_nodes, model%motion)
         energy%released = energy%released + energy%released_by_event
         call model%failure%look(model%mesh, model%material, model%motion)
      end associate
      call self%last%take(self%model)
      self%last%fraction = self%position%load_factor
      call self%recorder%write_events(self%model, self%position, error)
      if (self%recording_failed(error)) return
   end subroutine follow_splits

   !> Reactions that go with the forces last evaluated.
   subroutine find_reactions(self)
      class(simulation_t), intent(inout) :: self
      associate (model => self%model)
         call reaction(model%mesh, model%contact, model%loads, model%motion, model%reaction)
         call model%dynamics%add_moving(model%loads, model%reaction)
      end associate
   end subroutine find_reactions

   !> What is due of a state.
   subroutine record_state(self)
      class(simulation_t), intent(inout) :: self
      associate (model => self%model)
         call find_reactions(self)
         call model%dynamics%complete(model%mesh, model%loads, model%motion, model%energy)
         call model%failure%look(model%mesh, model%material, model%motion)
         call model%watch_slip()
         call model%watch_softening()
      end associate
      call self%last%take(self%model)
      self%last%fraction = self%position%load_factor
      call self%record(frame_settled)
   end subroutine record_state

   !> The next step goes on from here.
   subroutine finish(self, time)
      class(simulation_t), intent(inout) :: self
      !> step time reached [time]
      real(wp), intent(in) :: time
      associate (model => self%model)
         call model%loads%apply_supports(model%mesh%n_nodes, 1.0_wp, time)
         call model%energy%go_on_from(model%loads, model%motion, model%reaction, model%mesh%n_nodes)
      end associate
      self%position%in_time = .false.
      call self%end_step()
   end subroutine finish

end submodule rf_dynamic_step
