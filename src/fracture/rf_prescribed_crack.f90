!> A crack that exists from the start, cut through the elements as a run would cut it (`*CRACK, SPLITTING=ELEMENT`): split
!> by split, from the node nearest to its first point or to where its line enters the body, each time towards the next point.
module rf_prescribed_crack
   use rf_kinds, only: wp, i1
   use rf_crack_line, only: line_margin
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, side_nodes, node_on_boundary
   use rf_ray, only: split_t, split_limits_t, choose_split
   use rf_splitting, only: split_mesh
   implicit none
   private
   public :: cutter_t

   !> the crack is at a point when it is nearer to it than this part of its last step
   real(wp), parameter :: near_enough = 0.5_wp
   !> nodes at one place differ by less than this part of the mean edge
   real(wp), parameter :: same_place = 1.0e-9_wp

   type :: cutter_t
      !> number of the *CRACK
      integer :: crack = 0
      !> node at which the crack ends now, and length of its last step [length]
      integer :: tip = 0
      real(wp) :: step = 0
      integer :: splits = 0
      !> no direction is admissible at the tip, which lies inside the body
      logical :: stuck = .false.
   contains
      procedure :: start, advance, arrived, has_left
   end type cutter_t

contains

   !> Start at the node nearest to a point (of several the first in the order of the output).
   subroutine start(self, mesh, crack, point)
      class(cutter_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: crack
      !> [length]
      real(wp), intent(in) :: point(2)
      integer :: n
      real(wp) :: best, distance
      self%crack = crack
      self%stuck = .false.
      best = huge(1.0_wp)
      do n = 1, mesh%n_nodes
         distance = norm2(mesh%x(:, n) - point)
         if (distance > best) cycle
         if (.not. distance < best) then
            if (mesh%node_rank(n) > mesh%node_rank(self%tip)) cycle
         end if
         best = distance
         self%tip = n
      end do
      self%step = mesh%mean_edge
   end subroutine start

   !> Whether the tip is at a point, or beyond it.
   pure logical function arrived(self, mesh, from, to)
      class(cutter_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> the line that the crack follows [length]
      real(wp), intent(in) :: from(2), to(2)
      arrived = dot_product(to - mesh%x(:, self%tip), to - from)/norm2(to - from) <= near_enough*self%step
   end function arrived

   !> Whether the crack has left the body, or passed the place where its line does.
   logical function has_left(self, mesh, from, exit_place)
      class(cutter_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      !> start of the line, where it leaves the body [length]
      real(wp), intent(in) :: from(2), exit_place(2)
      has_left = dot_product(exit_place - mesh%x(:, self%tip), exit_place - from) <= line_margin*mesh%size*norm2(exit_place - from)
      if (has_left .or. .not. self%arrived(mesh, from, exit_place)) return
      has_left = node_on_boundary(mesh, self%tip)
   end function has_left

   !> One split towards a point. The changes join those there are.
   subroutine advance(self, mesh, to, no_split_node, no_split_element, changes, done)
      class(cutter_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> [length]
      real(wp), intent(in) :: to(2)
      !> what never breaks
      logical, intent(in) :: no_split_node(:), no_split_element(:)
      type(changes_t), intent(inout) :: changes
      !> there was none: the crack ends here
      logical, intent(out) :: done
      type(split_t) :: split
      type(split_limits_t) :: limits
      real(wp), allocatable :: utilisation(:)
      real(wp) :: at(2), direction(2)
      integer :: n, before
      at = mesh%x(:, self%tip)
      direction = (to - at)/norm2(to - at)
      allocate (utilisation(mesh%n_elements))
      utilisation = 1
      do n = 1, mesh%n_nodes         ! at a crack there are several nodes
         if (norm2(mesh%x(:, n) - at) > same_place*mesh%mean_edge .or. no_split_node(n)) cycle
         call choose_split(mesh, n, reshape(direction, [2, 1]), limits, utilisation, no_split_node, no_split_element, split)
         if (split%node > 0) exit
      end do
      done = split%node == 0
      self%stuck = done .and. .not. node_on_boundary(mesh, self%tip)
      if (done) return
      split%mode = 0_i1
      split%crack = self%crack
      before = mesh%n_segments
      call split_mesh(mesh, split, 0, changes, keep=.true.)
      self%splits = self%splits + 1
      self%tip = farthest(mesh, before, at, direction)
      self%step = norm2(mesh%x(:, self%tip) - at)
   end subroutine advance

   !> The node of the new segments that lies farthest ahead.
   integer function farthest(mesh, before, start, direction) result(tip)
      type(mesh_t), intent(in) :: mesh
      !> segments there were
      integer, intent(in) :: before
      real(wp), intent(in) :: start(2), direction(2)
      real(wp) :: ahead
      integer :: s, i, node(2, 2)
      tip = 0
      ahead = -huge(1.0_wp)
      do s = before + 1, mesh%n_segments
         node = side_nodes(mesh, s)
         do i = 1, 2
            if (dot_product(mesh%x(:, node(i, 1)) - start, direction) <= ahead) cycle
            ahead = dot_product(mesh%x(:, node(i, 1)) - start, direction)
            tip = node(i, 1)
         end do
      end do
   end function farthest

end module rf_prescribed_crack
