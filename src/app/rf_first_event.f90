!> The load at which the first event of an increment happens: utilisation between 1 and 1 + OVERSHOOT.
submodule(rf_simulation) rf_first_event
   use rf_failure, only: splitting_none
   implicit none

contains

   pure module function must_locate(self) result(must)
      class(simulation_t), intent(in) :: self
      logical :: must
      associate (settings => self%model%failure%settings)
         must = settings%on .and. settings%splitting /= splitting_none .and. settings%locate .and. &
                self%utilisation_before < 1 .and. self%model%failure%largest > 1 + settings%overshoot
      end associate
   end function must_locate

   module subroutine begin_search(self)
      class(simulation_t), intent(inout) :: self
      call self%search%begin(self%model, self%last%fraction, self%position%load_factor, self%utilisation_before, &
                             self%model%failure%settings%overshoot)
      call try_load(self)
   end subroutine begin_search

   !> Try a load of the increment: from the last equilibrium, on the line between the increment's ends. It leaves nothing
   !> behind.
   subroutine try_load(self)
      type(simulation_t), intent(inout) :: self
      self%stage = stage_search
      call self%last%restore(self%model)
      call self%apply_loads(self%search%trial)
      call self%last%interpolate(self%search%beyond, self%search%trial, self%model)
   end subroutine try_load

   module subroutine after_trial(self)
      class(simulation_t), intent(inout) :: self
      logical :: found
      call self%search%judge(self%model%failure%largest, self%model%failure%settings%overshoot, found)
      if (found) then
         call at_first_event(self)
      else
         call try_load(self)
      end if
   end subroutine after_trial

   !> The body is in equilibrium at the load of the first event.
   subroutine at_first_event(self)
      type(simulation_t), intent(inout) :: self
      type(split_t) :: split
      call self%model%failure%plan(self%model%mesh, self%model%material, split)
      if (split%node > 0) then
         self%position%located = .true.
         call self%settle()
         return
      end if
      call self%last%restore(self%model)
      call self%model%failure%look(self%model%mesh, self%model%material, self%model%motion)
      if (self%model%failure%n_exhausted > self%exhausted_before) then
         call self%begin_increment()              ! no admissible direction there: look for the next
      else
         call self%head_for(stage_own_load)       ! the load cannot be found (states above the tolerance): leave it
      end if
   end subroutine at_first_event

end submodule rf_first_event
