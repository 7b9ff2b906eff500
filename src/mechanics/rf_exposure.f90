!> What elements hold and bear, element by element (not by the node rows): for a part of the body that is taken out, the energy
!> that leaves with it; for the nodes that it leaves behind, the forces by which it acted on them (theory: eqs. 45 to 47).
module rf_exposure
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around, corner_of, sort_ascending
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_contact, only: contact_t
   use rf_loads, only: loads_t
   use rf_cst, only: gradients, strain, stress, corner_forces
   implicit none
   private
   public :: stored_energy, let_fall

contains

   !> Strain energy of some elements, counted as that of the body (theory: eq. 44) [force length].
   real(wp) function stored_energy(mesh, material, motion, chosen) result(total)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      !> (elements)
      logical, intent(in) :: chosen(:)
      real(wp) :: gradient(2, 3), area, eps(3)
      integer :: e
      total = 0
      do e = 1, mesh%n_elements
         if (.not. chosen(e)) cycle
         call gradients(mesh%x(:, mesh%connectivity(:, e)), gradient, area)
         eps = strain(gradient, motion%corner_displacements(mesh, e))
         associate (section => material%section(mesh%section(e)))
            total = total + area*section%thickness*dot_product(eps, material%initial%in_plane(e) + &
                                                               0.5_wp*material%stiffness_of(e)*stress(section%law, eps))
         end associate
      end do
   end function stored_energy

   !> Internal force of a node, that of the initial stress included [force].
   subroutine internal_force(mesh, material, motion, node, around, force)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: node
      !> list to work on
      integer, allocatable, intent(inout) :: around(:)
      real(wp), intent(out) :: force(2)
      real(wp) :: gradient(2, 3), area, f(2, 3)
      integer :: i, n, e
      call elements_around(mesh, node, around, n)
      call sort_ascending(around(:n))
      force = 0
      do i = 1, n
         e = around(i)
         call gradients(mesh%x(:, mesh%connectivity(:, e)), gradient, area)
         associate (section => material%section(mesh%section(e)))
            f = corner_forces(gradient, area*section%thickness, material%initial%in_plane(e) + material%stiffness_of(e)* &
                              stress(section%law, strain(gradient, motion%corner_displacements(mesh, e))))
         end associate
         force = force + f(:, corner_of(mesh, e, node))
      end do
   end subroutine internal_force

   !> Put forces on exposed nodes that keep them in equilibrium now and fall to zero over the step that begins next: what is
   !> missing at each of them between internal forces, loads, reactions and contact.
   subroutine let_fall(mesh, material, motion, contact, loads, reaction, b, exposed)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      type(contact_t), intent(in) :: contact
      !> gathered at their present values, without these forces; gets them
      type(loads_t), intent(inout) :: loads
      !> force of the supports on the body before [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      !> factor of the residual in the last step's update (contact force = impulse/b)
      real(wp), intent(in) :: b
      integer, intent(in) :: exposed(:)
      real(wp), allocatable :: pressing(:, :)
      integer, allocatable :: around(:)
      real(wp) :: f(2)
      integer :: i, n, dof
      pressing = contact%node_force(mesh%n_nodes, b)
      do i = 1, size(exposed)
         n = exposed(i)
         call internal_force(mesh, material, motion, n, around, f)
         f = f - loads%force_at(n) - loads%at_support(reaction, n) - pressing(:, n)
         do dof = 1, 2
            call loads%add_falling(n, dof, f(dof))
         end do
      end do
      call loads%gather(mesh, material)
   end subroutine let_fall

end module rf_exposure
