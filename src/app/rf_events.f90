!> Events of a static step: all that fails at one load, round by round until nothing does.
submodule(rf_simulation) rf_events
   use rf_selection, only: others_of_round
   use rf_failure, only: splitting_none
   use rf_criterion, only: mode_tension
   use rf_position, only: frame_before_event, frame_after_event
   implicit none

contains

   module subroutine settle(self)
      class(simulation_t), intent(inout) :: self
      type(split_t) :: split
      call self%accept(at_event=.false.)
      call plan_next(self, split)
      if (split%node == 0) then
         call self%settled()
      else
         call self%record(frame_before_event)
         if (.not. self%run_over) call self%one_round(split)
      end if
   end subroutine settle

   !> The next split, or none: nothing fails, fracture is off, or the step has had its events.
   subroutine plan_next(self, split)
      type(simulation_t), intent(inout) :: self
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

   module subroutine one_round(self, split)
      class(simulation_t), intent(inout) :: self
      type(split_t), intent(in) :: split
      integer, allocatable :: others(:)
      self%stage = stage_event
      call others_of_round(self%model%failure, self%model%mesh, split%node, others)      ! before anything changes
      call self%one_split(split)
      call self%split_others(others)
      call self%follow_growth()
      self%before%valid = .false.
      call self%last%take(self%model)
      self%last%fraction = self%position%load_factor
      self%model%energy%released_by_event = 0
   end subroutine one_round

   module subroutine after_event(self, usable)
      class(simulation_t), intent(inout) :: self
      logical, intent(in) :: usable
      character(len=:), allocatable :: error
      if (self%status == exit_not_written) return
      if (usable) then
         call self%accept(at_event=.true.)         ! which looks by itself where cracks soften
         if (.not. self%model%contact%softens()) &
            call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      end if
      call self%recorder%write_events(self%model, self%position, error)        ! one that ends the run is an event too
      if (self%recording_failed(error) .or. .not. usable) return
      call self%record(frame_after_event)
      if (.not. self%run_over) call self%go_on_breaking()
   end subroutine after_event

   module subroutine go_on_breaking(self)
      class(simulation_t), intent(inout) :: self
      type(split_t) :: split
      call plan_next(self, split)
      associate (settings => self%model%relaxation%settings)
         if (split%node > 0) then
            call self%one_round(split)
         else if (self%stage == stage_event .and. settings%event_tolerance > settings%tolerance .and. &
                  self%model%relaxation%residual > settings%tolerance) then
            self%stage = stage_refine      ! what is recorded is relaxed to TOLERANCE
         else
            call self%settled()
         end if
      end associate
   end subroutine go_on_breaking

   module subroutine settled(self)
      class(simulation_t), intent(inout) :: self
      ! exhausted nodes are out now: what is largest must not depend on whether a frame looks everywhere
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      if (self%model%failure%settings%on .and. .not. self%step_over) &
         self%largest_settled = max(self%largest_settled, self%model%failure%largest)
      call self%record(frame_settled)
      if (self%run_over) return
      if (self%position%located .and. .not. self%step_over) then
         self%position%located = .false.
         call self%head_for(stage_own_load)
      else
         self%position%located = .false.
         if (.not. self%step_over) call self%watch_drop()
         call self%mark_checkpoint(mod(self%position%increment, self%restart%frequency) == 0)
         call self%next_increment()
      end if
   end subroutine settled

   module subroutine one_split(self, split)
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
   module subroutine split_others(self, others)
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

end submodule rf_events
