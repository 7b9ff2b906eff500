!> From a deck to a simulation: all readers in the order in which they need each other. The same calls describe the deck
!> for its manual.
module rf_case
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t, new_place
   use rf_mesh_input, only: mesh_input_t
   use rf_topology, only: build_topology, manifold_ok
   use rf_crack_input, only: crack_list_t
   use rf_crack_insertion, only: insert_cracks
   use rf_material_input, only: read_materials
   use rf_initial_input, only: read_initial_conditions
   use rf_strength_input, only: read_strengths, read_no_split
   use rf_relaxation_input, only: read_relaxation
   use rf_fracture_input, only: read_fracture, check_strengths
   use rf_load_input, only: read_loads
   use rf_removal_input, only: read_removals
   use rf_support_check, only: check_supports
   use rf_output_input, only: output_requests_t, read_output, check_stop_drop
   use rf_step_input, only: read_steps, read_job, declare_others
   use rf_restart_input, only: read_restart
   use rf_dynamic_input, only: check_dynamics
   use rf_simulation, only: simulation_t
   use rf_text, only: to_text
   implicit none
   private
   public :: read_case

contains

   !> Read everything; what is wrong goes to the diagnostics.
   subroutine read_case(deck, simulation, requests, job, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(simulation_t), intent(inout) :: simulation
      !> what is to be written
      type(output_requests_t), intent(out) :: requests
      !> name that *JOB gives, empty if none
      character(len=:), allocatable, intent(out) :: job
      type(diagnostics_t), intent(inout) :: diagnostics
      type(mesh_input_t) :: mesh_input
      type(crack_list_t) :: cracks
      associate (model => simulation%model)
         call read_job(deck, job)
         call read_restart(deck, simulation%restart)
         call mesh_input%read(deck, model%mesh, diagnostics)
         call connect(simulation, deck, diagnostics)
         call cracks%read(deck)
         call read_materials(deck, mesh_input, model%mesh, model%material, diagnostics)
         call read_initial_conditions(deck, mesh_input, model%mesh, model%material, model%dynamics)
         call read_strengths(deck, model%material, model%failure, diagnostics)
         call model%failure%mark_regions(model%mesh)
         call read_no_split(deck, mesh_input, model%mesh, model%failure, diagnostics)
         call read_steps(deck, simulation%steps, diagnostics)
         call check_dynamics(deck, simulation%steps, model%mesh, model%material, diagnostics)
         model%dynamics%wanted = any(simulation%steps%dynamic)
         call read_relaxation(deck, simulation%relaxation)
         call read_fracture(deck, simulation%fracture)
         model%failure%watching = any(simulation%fracture%on)
         call check_strengths(deck, model%mesh, model%material, model%failure)
         call read_removals(deck, mesh_input, model%mesh, simulation%removals)
         call read_loads(deck, mesh_input, cracks, model%mesh, model%material, simulation%removals, model%loads%amplitudes, &
                         simulation%loads, simulation%replaced, diagnostics)
         call check_supports(deck, model%mesh, simulation%loads, simulation%replaced, simulation%removals, diagnostics)
         call read_output(deck, mesh_input, model%mesh, requests)
         model%failure%keeps_stress = size(requests%element_print) > 0
         call check_stop_drop(deck, requests, simulation%fracture)
         call declare_others(deck)
         call deck%finish(diagnostics)
         if (deck%describing() .or. diagnostics%n_errors > 0) return
         call model%loads%know_faces(model%mesh, simulation%loads, mesh_input%turned)
         call insert_cracks(cracks, simulation%loads, model, simulation%cracks_note, diagnostics)
      end associate
   end subroutine read_case

   !> Find the neighbours of all elements.
   subroutine connect(simulation, deck, diagnostics)
      type(simulation_t), intent(inout) :: simulation
      type(deck_t), intent(in) :: deck
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: status, offenders(2)
      if (deck%describing() .or. simulation%model%mesh%n_elements == 0) return
      call build_topology(simulation%model%mesh, status, offenders)
      if (status == manifold_ok .or. diagnostics%n_errors > 0) return ! after errors the mesh is not the one meant
      associate (id => simulation%model%mesh%element_id)
         call diagnostics%error(new_place(deck%name(), 0), 'elements '//to_text(minval(id(offenders)))//' and '// &
                                to_text(maxval(id(offenders)))//' overlap, or share an edge with a third one; '// &
                                'an edge has at most two elements, one on each side')
      end associate
   end subroutine connect

end module rf_case
