!> The stress that the body is under before anything moves (in-situ stress): constant in each element, added to the stress of
!> the displacements wherever stress is asked for. Its nodal forces enter as loads with their sign turned, so that K u stays
!> the only internal force of the step kernel (theory: eqs. 42 and 43). A new crack face releases it, because the forces of the
!> nodes that came apart are no longer summed over both sides.
module rf_initial_stress
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, elements_around, corner_of, sort_ascending
   use rf_cst, only: gradients, corner_forces
   implicit none
   private
   public :: initial_stress_t, stress_line_t

   !> What the deck says of the elements of a set: a stress that is linear in y.
   type :: stress_line_t
      !> number of the element set
      integer :: set = 0
      !> xx, yy, zz, xy at y = 0 [stress] and their increase with y [stress/length]
      real(wp) :: base(4) = 0, slope(4) = 0
   end type stress_line_t

   type :: initial_stress_t
      !> some element has an initial stress; if not, the array is not there
      logical :: given = .false.
      !> xx, yy, zz, xy, tension positive [stress], (4, elements)
      real(wp), allocatable :: stress(:, :)
      !> what the deck says, in its order; not allocated if it says nothing
      type(stress_line_t), allocatable :: line(:)
   contains
      procedure :: prepare, assign_lines, adopt, in_plane, nodal_force, nodal_forces
      procedure :: exchange
   end type initial_stress_t

contains

   !> All elements without stress, ready to be given one.
   subroutine prepare(self, n_elements)
      class(initial_stress_t), intent(inout) :: self
      integer, intent(in) :: n_elements
      self%given = .true.
      if (allocated(self%stress)) deallocate (self%stress)
      allocate (self%stress(4, n_elements), source=0.0_wp)
   end subroutine prepare

   !> The stress of every element by the lines of the deck, of which the last that names an element holds: taken at the
   !> centroid, once the mesh is as it will be before the first step.
   subroutine assign_lines(self, mesh, plane_strain)
      class(initial_stress_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> of the sections
      logical, intent(in) :: plane_strain(:)
      integer :: i, e
      if (.not. allocated(self%line)) return
      call self%prepare(mesh%n_elements)
      do i = 1, size(self%line)
         do e = 1, mesh%n_elements
            if (.not. mesh%element_in_set(e, self%line(i)%set)) cycle
            self%stress(:, e) = self%line(i)%base + self%line(i)%slope*(sum(mesh%x(2, mesh%connectivity(:, e)))/3)
            if (.not. plane_strain(mesh%section(e))) self%stress(3, e) = 0
         end do
      end do
   end subroutine assign_lines

   !> Children are under the stress of the element they were cut from.
   subroutine adopt(self, changes)
      class(initial_stress_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer :: i
      if (.not. self%given) return
      do i = 1, changes%n_children
         call grow(self%stress, changes%child(1, i))
         self%stress(:, changes%child(1, i)) = self%stress(:, changes%child(2, i))
      end do
   end subroutine adopt

   !> xx, yy, xy of an element [stress].
   pure function in_plane(self, element) result(stress)
      class(initial_stress_t), intent(in) :: self
      integer, intent(in) :: element
      real(wp) :: stress(3)
      stress = 0
      if (self%given) stress = self%stress([1, 2, 4], element)
   end function in_plane

   !> Internal force of the initial stress at a node, t A B^T sigma0 over its elements [force]. The order of the sum is that of
   !> the elements' numbers, wherever a walk round the node begins.
   subroutine nodal_force(self, mesh, thickness, node, around, force)
      class(initial_stress_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> of the sections [length]
      real(wp), intent(in) :: thickness(:)
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
         f = corner_forces(gradient, area*thickness(mesh%section(e)), self%in_plane(e))
         force = force + f(:, corner_of(mesh, e, node))
      end do
   end subroutine nodal_force

   !> The same of all nodes, or of the nodes of the elements that a split changed.
   subroutine nodal_forces(self, mesh, thickness, force, changes)
      class(initial_stress_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> of the sections [length]
      real(wp), intent(in) :: thickness(:)
      !> not allocated where there is no initial stress, (2, nodes)
      real(wp), allocatable, intent(inout) :: force(:, :)
      type(changes_t), intent(in), optional :: changes
      integer, allocatable :: around(:)
      integer :: i, k, n
      if (.not. self%given) return
      call grow(force, mesh%n_nodes, 2)
      if (.not. present(changes)) then
         do n = 1, mesh%n_nodes
            call self%nodal_force(mesh, thickness, n, around, force(:, n))
         end do
         return
      end if
      do i = 1, changes%n_elements
         do k = 1, 3
            n = mesh%connectivity(k, changes%element(i))
            call self%nodal_force(mesh, thickness, n, around, force(:, n))
         end do
      end do
   end subroutine nodal_forces

   !> To or from a checkpoint. (Derived: line follows from the deck.)
   subroutine exchange(self, archive)
      class(initial_stress_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('given', self%given)
      call archive%exchange('stress', self%stress)
   end subroutine exchange

end module rf_initial_stress
