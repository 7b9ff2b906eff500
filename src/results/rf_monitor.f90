!> Monitors: mean displacement and summed reaction of a node set, columns of history and events.
module rf_monitor
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan
   use rf_kinds, only: wp
   use rf_mesh, only: mesh_t
   use rf_loads, only: loads_t
   use rf_motion, only: motion_t
   implicit none
   private
   public :: monitor_t

   type :: monitor_t
      character(len=:), allocatable :: name
      !> number of the node set
      integer :: set = 0
   contains
      procedure :: displacement, force
   end type monitor_t

contains

   !> Mean displacement [length]: each node of the deck counts once, shared by its copies. NaN if all nodes were removed.
   function displacement(self, mesh, motion) result(mean)
      class(monitor_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(motion_t), intent(in) :: motion
      real(wp) :: mean(2)
      real(wp) :: total
      integer :: n
      mean = 0
      total = 0
      do n = 1, mesh%n_nodes
         if (.not. mesh%node_in_set(n, self%set)) cycle
         total = total + mesh%share_of(n)
         mean = mean + mesh%share_of(n)*[motion%ux(n), motion%uy(n)]
      end do
      if (total > 0) then
         mean = mean/total
      else
         mean = ieee_value(total, ieee_quiet_nan)
      end if
   end function displacement

   !> Sum of the reactions [force]. NaN if all nodes were removed.
   function force(self, mesh, loads, reaction) result(total)
      class(monitor_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(loads_t), intent(in) :: loads
      !> force of the supports on the body [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      real(wp) :: total(2)
      integer :: n
      logical :: found
      total = 0
      found = .false.
      do n = 1, mesh%n_nodes
         if (.not. mesh%node_in_set(n, self%set)) cycle
         found = .true.
         total = total + loads%at_support(reaction, n)
      end do
      if (.not. found) total = ieee_value(total, ieee_quiet_nan)
   end function force

end module rf_monitor
