!> Reads the strength of materials (`*STRENGTH`) and the regions that never break (`*NO SPLIT`).
module rf_strength_input
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_failure, only: failure_t
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: read_strengths, read_no_split

contains

   !> Strength and criterion of each material; friction of broken surfaces where the deck gives none.
   subroutine read_strengths(deck, material, failure, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(material_t), intent(inout) :: material
      type(failure_t), intent(inout) :: failure
      type(diagnostics_t), intent(inout) :: diagnostics
   end subroutine read_strengths

   !> Regions that never break; failure%prepare has been called before.
   subroutine read_no_split(deck, mesh_input, mesh, failure, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(failure_t), intent(inout) :: failure
      type(diagnostics_t), intent(inout) :: diagnostics
   end subroutine read_no_split
end module rf_strength_input
