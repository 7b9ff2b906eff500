!> The state of a run: what a checkpoint holds beside the deck.
submodule(rf_simulation) rf_simulation_state
   implicit none

contains

   !> To or from a checkpoint. (Derived: replaced, restart, cracks_note follow from the deck; log, interruption, reading_time,
   !> status, message are of one process; run_over ends a run.)
   module subroutine exchange(self, archive)
      class(simulation_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%enter('model')
      call self%model%exchange(archive)
      call archive%leave()
      call archive%enter('recorder')
      call self%recorder%exchange(archive)
      call archive%leave()
      call archive%enter('position')
      call self%position%exchange(archive)
      call archive%leave()
      call archive%enter('last')
      call self%last%exchange(archive)
      call archive%leave()
      call archive%enter('before')
      call self%before%exchange(archive)
      call archive%leave()
      call archive%enter('search')
      call self%search%exchange(archive)
      call archive%leave()
      call exchange_progress(self, archive)
      call exchange_definitions(self, archive)
      if (.not. archive%reading) return
      self%model%failure%settings = self%fracture(self%position%step)
      self%model%relaxation%settings = self%relaxation(self%position%step)
   end subroutine exchange

   !> Where the run stands.
   subroutine exchange_progress(self, archive)
      type(simulation_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('wall_time', self%wall_time)
      call archive%exchange('stage', self%stage)
      call archive%exchange('steps_done', self%steps_done)
      call archive%exchange('step_events', self%step_events)
      call archive%exchange('step_over', self%step_over)
      call archive%exchange('time_before', self%time_before)
      call archive%exchange('utilisation_before', self%utilisation_before)
      call archive%exchange('exhausted_before', self%exhausted_before)
      call archive%exchange('time_steps', self%time_steps)
      call archive%exchange('set_at', self%set_at)
      call archive%exchange('set_time', self%set_time)
      call archive%exchange('peak', self%peak)
      call archive%exchange_fixed('peak_direction', self%peak_direction)
      call archive%exchange('not_converged', self%not_converged)
      call archive%exchange('largest_settled', self%largest_settled)
   end subroutine exchange_progress

   !> What a run changes of what the deck says: numbers of nodes and elements (a removal gives new ones, and so does growth), time
   !> steps of a dynamic step.
   subroutine exchange_definitions(self, archive)
      type(simulation_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      integer, allocatable :: load(:), removal(:), increments(:)
      integer :: i
      load = self%loads%entity
      removal = self%removals%entity
      increments = self%steps%n_increments
      call archive%exchange('load_entity', load)
      call archive%exchange('removal_entity', removal)
      call archive%exchange('increments', increments)
      if (.not. archive%reading .or. allocated(archive%error)) return
      do i = 1, size(self%loads)
         self%loads(i)%entity = load(i)
      end do
      do i = 1, size(self%removals)
         self%removals(i)%entity = removal(i)
      end do
      do i = 1, size(self%steps)
         self%steps(i)%n_increments = increments(i)
      end do
   end subroutine exchange_definitions

end submodule rf_simulation_state
