!> What pressure on a face and the weight of an element put on a node. In a file of their own, so that no compiler melts
!> them into the sums they go into: whoever adds them up gets the same bits.
module rf_load_share
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_material, only: material_t
   implicit none
   private
   public :: face_push, corner_weight

contains

   !> What a pressure puts on each end of a face [force]: half of it, from outside.
   pure function face_push(mesh, material, pressure, element, ends) result(push)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> [stress]
      real(wp), intent(in) :: pressure
      !> the element, and the nodes of its face counter-clockwise
      integer, intent(in) :: element, ends(2)
      real(wp) :: push(2)
      real(wp) :: edge(2)
      edge = mesh%x(:, ends(2)) - mesh%x(:, ends(1))
      push = 0.5_wp*pressure*material%section(mesh%section(element))%thickness*[-edge(2), edge(1)]
   end function face_push

   !> A third of an element's weight, for each of its corners [force].
   pure function corner_weight(mesh, material, acceleration, direction, element) result(weight)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> [length/time^2]; where it points to [-]
      real(wp), intent(in) :: acceleration, direction(2)
      integer, intent(in) :: element
      real(wp) :: weight(2)
      associate (section => material%section(mesh%section(element)))
         weight = acceleration*section%density*section%thickness*mesh%area(element)/3*direction
      end associate
   end function corner_weight

end module rf_load_share
