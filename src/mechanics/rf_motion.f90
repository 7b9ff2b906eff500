!> The state of motion of all nodes, one array a component: what the step kernel works on.
module rf_motion
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_renumber, only: renumbering_t, carry
   implicit none
   private
   public :: motion_t

   type :: motion_t
      !> displacements [length], (nodes)
      real(wp), allocatable :: ux(:), uy(:)
      !> displacements after the step under way [length]
      real(wp), allocatable :: wx(:), wy(:)
      !> velocities [length per step]
      real(wp), allocatable :: vx(:), vy(:)
      !> internal forces of the displacements [force]
      real(wp), allocatable :: fx(:), fy(:)
   contains
      procedure :: reserve, advance, adopt, renumber, corner_displacements
      procedure :: exchange
   end type motion_t

contains

   !> Room for n nodes; new ones are at rest.
   subroutine reserve(self, n)
      class(motion_t), intent(inout) :: self
      integer, intent(in) :: n
      call grow(self%ux, n)
      call grow(self%uy, n)
      call grow(self%wx, n)
      call grow(self%wy, n)
      call grow(self%vx, n)
      call grow(self%vy, n)
      call grow(self%fx, n)
      call grow(self%fy, n)
   end subroutine reserve

   !> The displacements after the step under way become the present ones.
   pure subroutine advance(self)
      class(motion_t), intent(inout) :: self
      call swap(self%ux, self%wx)
      call swap(self%uy, self%wy)
   end subroutine advance

   pure subroutine swap(a, b)
      real(wp), allocatable, intent(inout) :: a(:), b(:)
      real(wp), allocatable :: keep(:)
      call move_alloc(a, keep)
      call move_alloc(b, a)
      call move_alloc(keep, b)
   end subroutine swap

   !> New nodes move as what they come from: a copy as its node, a midpoint as the mean of its ends.
   subroutine adopt(self, changes)
      class(motion_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer :: i, n, a, b
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         call self%reserve(n)
         self%ux(n) = 0.5_wp*(self%ux(a) + self%ux(b))
         self%uy(n) = 0.5_wp*(self%uy(a) + self%uy(b))
         self%vx(n) = 0.5_wp*(self%vx(a) + self%vx(b))
         self%vy(n) = 0.5_wp*(self%vy(a) + self%vy(b))
      end do
   end subroutine adopt

   !> Follow new numbers of the nodes.
   subroutine renumber(self, map)
      class(motion_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      call carry(self%ux, map%node_from)
      call carry(self%uy, map%node_from)
      call carry(self%wx, map%node_from)
      call carry(self%wy, map%node_from)
      call carry(self%vx, map%node_from)
      call carry(self%vy, map%node_from)
      call carry(self%fx, map%node_from)
      call carry(self%fy, map%node_from)
   end subroutine renumber

   !> Displacements of an element's corners [length], (2, 3).
   pure function corner_displacements(self, mesh, element) result(u)
      class(motion_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp) :: u(2, 3)
      u(1, :) = self%ux(mesh%connectivity(:, element))
      u(2, :) = self%uy(mesh%connectivity(:, element))
   end function corner_displacements

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(motion_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('ux', self%ux)
      call archive%exchange('uy', self%uy)
      call archive%exchange('wx', self%wx)
      call archive%exchange('wy', self%wy)
      call archive%exchange('vx', self%vx)
      call archive%exchange('vy', self%vy)
      call archive%exchange('fx', self%fx)
      call archive%exchange('fy', self%fy)
   end subroutine exchange

end module rf_motion
