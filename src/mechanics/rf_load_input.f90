!> Reads supports and loads: `*AMPLITUDE`, `*BOUNDARY`, `*CLOAD`, `*DLOAD`, `*PRESSURE`.
module rf_load_input
   use rf_amplitude, only: amplitude_t
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_loads, only: load_definition_t, load_gravity
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: read_loads

contains

   !> Read what holds and loads the body in all steps.
   subroutine read_loads(deck, mesh_input, mesh, material, amplitudes, definitions, replaced, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      !> with topology and sections
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(amplitude_t), allocatable, intent(out) :: amplitudes(:)
      !> in the order of steps (step 0: before the first), within a step in the deck's
      type(load_definition_t), allocatable, intent(out) :: definitions(:)
      !> the step says OP=NEW for a kind, (load_gravity, steps)
      logical, allocatable, intent(out) :: replaced(:, :)
      type(diagnostics_t), intent(inout) :: diagnostics
      allocate (amplitudes(0), definitions(0), replaced(load_gravity, deck%step_count()))
      replaced = .false.
   end subroutine read_loads
end module rf_load_input
