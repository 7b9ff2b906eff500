!> Reads `*FRACTURE`.
module rf_fracture_input
   use rf_deck, only: deck_t
   use rf_failure, only: failure_t, fracture_settings_t
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   implicit none
   private
   public :: read_fracture, check_strengths

contains

   !> Settings of each step.
   subroutine read_fracture(deck, settings)
      type(deck_t), intent(inout) :: deck
      !> (steps)
      type(fracture_settings_t), allocatable, intent(out) :: settings(:)
      allocate (settings(deck%step_count()))
   end subroutine read_fracture

   !> Materials without strength where the deck lets the body break are errors. After read_no_split.
   subroutine check_strengths(deck, mesh, material, failure)
      type(deck_t), intent(inout) :: deck
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(failure_t), intent(in) :: failure
   end subroutine check_strengths
end module rf_fracture_input
