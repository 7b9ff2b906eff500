!> Ends of a run that are not the end of its last step.
submodule(rf_simulation) rf_endings
   use rf_position, only: frame_not_converged
   implicit none

contains

   module subroutine stop_as_mechanism(self)
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
      call record_not_converged(self)
   end subroutine stop_as_mechanism

   module subroutine stop_not_converged(self)
      class(simulation_t), intent(inout) :: self
      self%status = exit_failed
      self%run_over = .true.
      associate (relaxation => self%model%relaxation)
         self%message = 'the relaxation of step '//to_text(self%position%step)//', increment '// &
                        to_text(self%position%increment)//' reached MAX ITERATIONS='// &
                        to_text(relaxation%settings%max_iterations)//' with a residual of '//short(relaxation%residual)// &
                        '; above 100 x TOLERANCE a state is not taken unless *RELAXATION says CONTINUE=YES'
      end associate
      call record_not_converged(self)
   end subroutine stop_not_converged

   !> The state with which a run ends that found no equilibrium: a row, a frame, a row of the log.
   subroutine record_not_converged(self)
      type(simulation_t), intent(inout) :: self
      character(len=:), allocatable :: error
      call self%recorder%state_not_converged(self%model, self%position, error)
      if (self%recording_failed(error)) return
      call self%log%row(self%model, self%position, frame_not_converged, self%recorder)
   end subroutine record_not_converged

   module subroutine stop_not_finite(self)
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
      call record_not_converged(self)
   end subroutine stop_not_finite

   !> The node with the largest force on it.
   pure integer function most_forced_node(model) result(node)
      type(model_t), intent(in) :: model
      real(wp) :: force, largest
      integer :: n
      node = 1
      largest = -1
      do n = 1, model%mesh%n_nodes
         force = maxval(abs(model%loads%acting_at(n) - [model%motion%fx(n), model%motion%fy(n)]))
         if (.not. force > largest) cycle      ! not numbers either
         largest = force
         node = n
      end do
   end function most_forced_node

end submodule rf_endings
