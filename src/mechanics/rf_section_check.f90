!> Section balance (Qiu & Ding 2007, section 2.5): the part of the body on one side of a line must be in equilibrium under
!> its loads, its reactions and what the other side exerts on it (theory: eq. 38).
module rf_section_check
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around
   use rf_material, only: material_t
   use rf_cst, only: gradients, strain, stress, corner_forces
   use rf_motion, only: motion_t
   use rf_contact, only: contact_t
   use rf_loads, only: loads_t
   implicit none
   private
   public :: section_line_t, section_result_t, check_section

   !> distance from the line, relative to the model's size, within which a node's elements decide its side
   real(wp), parameter :: on_line = 1.0e-6_wp
   !> reactions below this part of the loads are none: loads that balance each other leave round-off only
   real(wp), parameter :: no_reactions = 1.0e-3_wp

   !> A line through a point, and the side its normal points to.
   type :: section_line_t
      character(len=80) :: name = ''
      !> point [length], unit normal [-]
      real(wp) :: point(2) = 0, normal(2) = [1.0_wp, 0.0_wp]
   end type section_line_t

   type :: section_result_t
      !> force and moment about the point that the other side exerts [force], [force length]
      real(wp) :: force(2) = 0, moment = 0
      !> unbalance of the side, relative to the norm of the reactions (loads where there are none; at least a part of the
      !> largest forces so far) [-]
      real(wp) :: error = 0
   end type section_result_t

contains

   !> Forces through a line and the balance of the side that the normal points to.
   subroutine check_section(line, mesh, material, motion, contact, loads, reaction, b, floor, found)
      type(section_line_t), intent(in) :: line
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      !> force of the supports on the body [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      !> factor of the residual in the last step's update (contact force = impulse/b)
      real(wp), intent(in) :: b
      !> the norm never falls below this: part of the largest forces of any converged state [force]
      real(wp), intent(in) :: floor
      type(section_result_t), intent(out) :: found
      logical, allocatable :: beyond(:)
      real(wp) :: sums(3), norm, applied, f(2)
      integer :: n
      call find_side(line, mesh, beyond)
      call add_elements(line, mesh, material, motion, beyond, found)
      call add_contact(line, mesh, contact, b, beyond, found)
      sums = [found%force, found%moment]
      do n = 1, mesh%n_nodes
         if (.not. beyond(n)) cycle
         f = loads%at_support(reaction, n) + loads%force_at(n)
         sums = sums + [f, moment_of(f, mesh%x(:, n) - line%point)]
      end do
      norm = norm_of(reaction, mesh, loads)
      applied = loads%scale(mesh%n_nodes)
      if (norm <= no_reactions*applied) norm = applied
      norm = max(norm, floor)
      if (norm > 0) found%error = max(norm2(sums(:2))/norm, abs(sums(3))/(norm*mesh%diagonal))
   end subroutine check_section

   !> Norm of the reactions, in the order of the nodes [force].
   pure real(wp) function norm_of(reaction, mesh, loads)
      real(wp), intent(in) :: reaction(:, :)
      type(mesh_t), intent(in) :: mesh
      type(loads_t), intent(in) :: loads
      real(wp), allocatable :: force(:, :)
      integer :: n
      allocate (force(2, mesh%n_nodes))
      do n = 1, mesh%n_nodes
         force(:, n) = loads%at_support(reaction, n)
      end do
      norm_of = norm2(force)
   end function norm_of

   pure real(wp) function moment_of(force, arm)
      real(wp), intent(in) :: force(2), arm(2)
      moment_of = arm(1)*force(2) - arm(2)*force(1)
   end function moment_of

   !> Which nodes lie beyond the line; for those on it their elements' centroids decide, so that a crack along the line
   !> parts the body there.
   subroutine find_side(line, mesh, beyond)
      type(section_line_t), intent(in) :: line
      type(mesh_t), intent(in) :: mesh
      logical, allocatable, intent(out) :: beyond(:)
      integer, allocatable :: around(:)
      real(wp) :: distance
      integer :: n, i, count
      allocate (beyond(mesh%n_nodes))
      do n = 1, mesh%n_nodes
         distance = dot_product(mesh%x(:, n) - line%point, line%normal)
         if (abs(distance) <= on_line*mesh%size) then
            call elements_around(mesh, n, around, count)
            distance = 0
            do i = 1, count
               distance = distance + dot_product(sum(mesh%x(:, mesh%connectivity(:, around(i))), 2)/3 - line%point, line%normal)
            end do
         end if
         beyond(n) = distance > 0
      end do
   end subroutine find_side

   !> Internal forces of the elements that lie on both sides.
   subroutine add_elements(line, mesh, material, motion, beyond, found)
      type(section_line_t), intent(in) :: line
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: beyond(:)
      type(section_result_t), intent(inout) :: found
      real(wp) :: gradient(2, 3), area, f(2, 3)
      integer :: e, k, corner(3)
      do e = 1, mesh%n_elements
         corner = mesh%connectivity(:, e)
         if (all(beyond(corner)) .or. .not. any(beyond(corner))) cycle
         call gradients(mesh%x(:, corner), gradient, area)
         associate (section => material%section(mesh%section(e)))
            f = corner_forces(gradient, area*section%thickness, material%initial%in_plane(e) + material%stiffness_of(e)* &
                              stress(section%law, strain(gradient, motion%corner_displacements(mesh, e))))
         end associate
         do k = 1, 3
            if (.not. beyond(corner(k))) cycle
            found%force = found%force - f(:, k)
            found%moment = found%moment - moment_of(f(:, k), mesh%x(:, corner(k)) - line%point)
         end do
      end do
   end subroutine add_elements

   !> Contact forces of the pairs that lie on both sides.
   subroutine add_contact(line, mesh, contact, b, beyond, found)
      type(section_line_t), intent(in) :: line
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(in) :: contact
      real(wp), intent(in) :: b
      logical, intent(in) :: beyond(:)
      type(section_result_t), intent(inout) :: found
      real(wp) :: pull(2), f(2)
      integer :: p
      do p = 1, contact%n_pairs
         if (beyond(contact%pair(1, p)) .eqv. beyond(contact%pair(2, p))) cycle
         pull = contact%traction(p, b)
         f = contact%normal(:, p)*pull(1) + [-contact%normal(2, p), contact%normal(1, p)]*pull(2)
         if (beyond(contact%pair(1, p))) f = -f
         found%force = found%force + f
         found%moment = found%moment + moment_of(f, mesh%x(:, contact%pair(2, p)) - line%point)
      end do
   end subroutine add_contact

end module rf_section_check
