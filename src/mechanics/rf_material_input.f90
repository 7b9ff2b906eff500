!> Reads the materials and sections: `*MATERIAL` with what belongs to it, `*SOLID SECTION`.
module rf_material_input
   use rf_deck, only: deck_t
   use rf_diagnostics, only: diagnostics_t
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   implicit none
   private
   public :: read_materials

contains

   !> Read all materials, give every element its section and its factors.
   subroutine read_materials(deck, mesh_input, mesh, material, diagnostics)
      type(deck_t), intent(inout) :: deck
      !> sets of the deck
      type(mesh_input_t), intent(in) :: mesh_input
      !> gets the section of each element
      type(mesh_t), intent(inout) :: mesh
      type(material_t), intent(inout) :: material
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
   end subroutine read_materials
end module rf_material_input
