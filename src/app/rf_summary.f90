!> What the log says of the model before a run, and of the run after it.
module rf_summary
   use rf_kinds, only: wp
   use rf_simulation, only: simulation_t
   use rf_recorder, only: digests_of
   use rf_failure, only: select_separated, select_all
   use rf_strength_input, only: jump_of_criterion
   use rf_log, only: short
   use rf_text, only: to_text
   implicit none
   private
   public :: summarise_model, summarise_run, tell_that_it_had_ended

   !> exhausted nodes that the summary names
   integer, parameter :: most_names = 8

contains

   !> Size of the mesh, materials, and how the criterion jumps.
   subroutine summarise_model(simulation, seconds)
      type(simulation_t), intent(inout) :: simulation
      !> time of reading [s]
      real(wp), intent(in) :: seconds
      integer :: m
      associate (mesh => simulation%model%mesh, failure => simulation%model%failure)
         call simulation%log%line('model: '//to_text(mesh%n_nodes)//' nodes, '//to_text(mesh%n_elements)//' elements, '// &
            to_text(size(simulation%steps))//' steps, mean edge '//short(mesh%mean_edge)//', read in '//short(seconds)//' s')
         if (len(simulation%cracks_note) > 0) call simulation%log%line(simulation%cracks_note)
         do m = 1, size(failure%strength)
            if (.not. failure%strength(m)%given) cycle
            if (.not. jump_of_criterion(failure, m) > 0) cycle
            call simulation%log%line('note: CRITERION=GRIFFITH of material '//trim(simulation%model%material%name(m))// &
               ' jumps at sigma1 = -3 sigma3: a tension of '//short(failure%strength(m)%tensile)//' fails on one side, of '// &
               short(jump_of_criterion(failure, m))//' on the other')
         end do
      end associate
      call note_approximations(simulation)
   end subroutine summarise_model

   !> Settings with which events are not those of one split at a time at full tolerance: told once each.
   subroutine note_approximations(simulation)
      type(simulation_t), intent(inout) :: simulation
      associate (fracture => simulation%fracture, relaxation => simulation%relaxation)
         if (any(fracture%on .and. fracture%selection == select_separated)) call simulation%log%line('note: '// &
            'SELECT=SEPARATED is approximate: nodes that split together are not those that would split one after the other')
         if (any(fracture%on .and. fracture%selection == select_all)) call simulation%log%line('note: SELECT=ALL is '// &
            'approximate: splitting every node above the limit at once spoils the localisation into a crack')
         if (any(fracture%on .and. relaxation%event_tolerance > relaxation%tolerance)) call simulation%log%line('note: EVENT '// &
            'TOLERANCE above TOLERANCE is approximate: the order of events may differ')
      end associate
   end subroutine note_approximations

   !> A run from whose checkpoint there is nothing to go on: what had ended it, and the digests of its result.
   subroutine tell_that_it_had_ended(simulation)
      type(simulation_t), intent(inout) :: simulation
      character(len=16) :: digests(2)
      call simulation%log%line('nothing left to do: this run had ended at '//simulation%place()//' ('//simulation%ending()// &
                               '); its results stay as they are')
      digests = digests_of(simulation%model)
      call simulation%log%line('digest displacements='//digests(1)//' topology='//digests(2))
   end subroutine tell_that_it_had_ended

   !> Checks, digests, times and files.
   subroutine summarise_run(simulation, wall_time, checkpoint_time)
      type(simulation_t), intent(inout) :: simulation
      !> of the process; of its checkpoints [s]
      real(wp), intent(in) :: wall_time, checkpoint_time
      character(len=:), allocatable :: checkpoints
      character(len=16) :: digests(2)
      character(len=12) :: rate
      associate (model => simulation%model, relaxation => simulation%model%relaxation, &
                 figures => simulation%recorder%history%figures)
         call simulation%log%line('')
         call simulation%log%line('events: '//to_text(model%events)//' ('//to_text(model%events_tension)//' in tension, '// &
            to_text(model%events_shear)//' in shear), cracks: '//to_text(figures%cracks)//', crack length '// &
            short(figures%crack_length)//', fragments: '//to_text(model%pieces%n))
         call write_checks()
         write (rate, '(es10.3)') relaxation%element_updates/max(relaxation%seconds, tiny(1.0_wp))
         call simulation%log%line('wall time '//short(wall_time)//' s, relaxation '//short(relaxation%seconds)//' s, '// &
            trim(adjustl(rate))//' element updates per second')
         checkpoints = ''
         if (checkpoint_time > 0) checkpoints = ', checkpoints '//short(checkpoint_time)//' s'
         call simulation%log%line('time: reading '//short(simulation%reading_time)//' s, relaxation '// &
            short(relaxation%seconds)//' s (of it contact after the step '//short(relaxation%contact_watch%total)// &
            ' s), criterion '//short(model%failure%watch%total)//' s, splitting '//short(model%watch%total)//' s, output '// &
            short(simulation%recorder%watch%total)//' s'//checkpoints)
         call simulation%log%line('files: '//simulation%recorder%files)
         digests = digests_of(model)
         call simulation%log%line('digest displacements='//digests(1)//' topology='//digests(2))
      end associate

   contains

      !> The checks of section balance, strength and energy.
      subroutine write_checks()
         associate (model => simulation%model, figures => simulation%recorder%history%figures)
            if (simulation%not_converged > 0) call simulation%log%line('warning: '//to_text(simulation%not_converged)// &
               ' relaxations ended above the tolerance (converged = 0)')
            if (size(simulation%recorder%history%lines) > 0) &
               call simulation%log%line('check of section balance: largest error '//short(figures%section_error))
            call simulation%log%line('check of energy: largest error '//short(figures%energy_error)//' of the external work')
            if (.not. any(simulation%fracture%on)) return
            call simulation%log%line('check of strength: largest utilisation left '//short(simulation%largest_settled)// &
               '; exhausted nodes '//to_text(model%failure%n_exhausted)//', their largest '// &
               short(model%failure%largest_exhausted)//exhausted_names())
            if (model%failure%out_of_plane_node > 0) call simulation%log%line('warning: at node '// &
               to_text(model%failure%out_of_plane_node)//' the stress out of the plane was the extreme '// &
               'one when the node failed; the criterion looks at the stresses in the plane only')
            if (model%slip_warning_node > 0) call simulation%log%line('warning: the slip of the pair at node '// &
               to_text(model%slip_warning_node)//' exceeds 0.2 of the element size; node pairs hold for '// &
               'less')
            call warn_of_steepness(model%steep_warning_node(1), 'opening', 'Gf_I/sigma_t^2')
            call warn_of_steepness(model%steep_warning_node(2), 'slip', 'Gf_II/c^2')
         end associate
      end subroutine write_checks

      !> Elements larger than what the fracture energy can be resolved with.
      subroutine warn_of_steepness(node, motion, length)
         !> its id, 0: there is none
         integer, intent(in) :: node
         !> of the faces; the material's length but for E
         character(len=*), intent(in) :: motion, length
         if (node == 0) return
         call simulation%log%line('warning: at node '//to_text(node)//' the elements are too '// &
            'large for *SOFTENING in '//motion//' (about 2 E '//length//'): a crack there breaks at once, as without it')
      end subroutine warn_of_steepness

      !> Ids of the first exhausted nodes.
      function exhausted_names() result(text)
         character(len=:), allocatable :: text
         integer :: n, shown
         text = ''
         shown = 0
         associate (model => simulation%model)
            do n = 1, model%mesh%n_nodes
               if (.not. model%failure%exhausted(n)) cycle
               shown = shown + 1
               if (shown > most_names) exit
               text = text//' '//to_text(model%mesh%node_id(n))
            end do
         end associate
         if (shown > most_names) text = text//' ...'
         if (shown > 0) text = ' (nodes'//text//')'
      end function exhausted_names

   end subroutine summarise_run

end module rf_summary
