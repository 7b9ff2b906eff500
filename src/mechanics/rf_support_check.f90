!> Whether supports hold every piece of the body.
module rf_support_check
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_mesh, only: mesh_t
   implicit none
   private
   public :: check_rigid_motion

contains

   !> Each piece that can move as a rigid body is an error.
   subroutine check_rigid_motion(mesh, held, place, diagnostics)
      type(mesh_t), intent(in) :: mesh
      !> the direction is supported, (2, nodes)
      logical, intent(in) :: held(:, :)
      !> where the errors belong: the step's *STATIC
      type(place_t), intent(in) :: place
      type(diagnostics_t), intent(inout) :: diagnostics
   end subroutine check_rigid_motion
end module rf_support_check
