!> How straight cracks run: cracks of prescribed direction through irregular meshes (*MESH, PATTERN=STAGGERED with its
!> standard jitter), event by event as a run would split, with nothing to steer them back. The error of a path is the
!> angle between the line from its start to its end and the direction asked for. Its root mean square must not exceed
!> 5.5 degrees. 48 cracks, 16 directions on three meshes, scatter by a degree or so; hence ten times as many.
!>
!>    splitting_paths [-v]
program splitting_paths
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use rf_kinds, only: wp, pi, degree
   use rf_mesh, only: mesh_t
   use rf_generate, only: staggered_jitter
   use rf_topology, only: changes_t, side_nodes
   use rf_ray, only: split_t, split_limits_t, choose_split
   use rf_splitting, only: split_mesh
   use rf_criterion, only: mode_tension
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   use test_meshes, only: rectangle, node_at
   implicit none

   !> what verification asks for, written down before the first measurement [rad]
   real(wp), parameter :: largest_error = 5.5_wp*degree
   integer, parameter :: n_directions = 16, n_meshes = 30, cells(2) = 40
   real(wp), parameter :: lengths(2) = 40.0_wp
   real(wp) :: error, square, worst
   integer :: i, m, kinds(3), events, stopped
   logical :: verbose

   verbose = command_argument_count() > 0
   square = 0
   worst = 0
   kinds = 0
   events = 0
   stopped = 0
   do m = 1, n_meshes
      do i = 1, n_directions
         call follow(m, 2*pi*(i + real(m, wp)/n_meshes)/n_directions, error)
         square = square + error**2
         worst = max(worst, abs(error))
      end do
   end do
   error = sqrt(square/(n_meshes*n_directions))
   write (output_unit, '(i0, a, f5.2, a, f5.2, a, i0, a, i0, 5(a, i0))') n_meshes*n_directions, &
      ' prescribed cracks: rms angle error ', error/degree, ' degrees, worst ', worst/degree, ' degrees; ', events, &
      ' events, types I, II, III ', kinds(1), ', ', kinds(2), ', ', kinds(3), '; ended inside ', stopped
   if (error > largest_error) error stop 1

contains

   !> One crack: from near the middle until it leaves the body.
   subroutine follow(m, angle, error)
      !> mesh; direction [rad]
      integer, intent(in) :: m
      real(wp), intent(in) :: angle
      !> turn of the path from the direction [rad]
      real(wp), intent(out) :: error
      type(mesh_t) :: mesh
      type(changes_t) :: changes
      type(split_t) :: split
      type(split_limits_t) :: limits
      type(baseline_t) :: baseline
      character(len=:), allocatable :: problem
      real(wp) :: direction(2), start(2), chord(2), at(2)
      real(wp), allocatable :: utilisation(:)
      logical, allocatable :: protected(:)
      integer :: tip, event
      direction = [cos(angle), sin(angle)]
      call rectangle('STAGGERED', lengths, cells, staggered_jitter, m, mesh)
      call take_baseline(mesh, baseline)
      allocate (protected(10*mesh%n_elements), source=.false.)
      allocate (utilisation(10*mesh%n_elements), source=1.0_wp)
      at = 0.5_wp*lengths - 0.2_wp*lengths*direction
      tip = node_at(mesh, at(1), at(2))
      start = mesh%x(:, tip)
      event = 0
      do
         call choose_split(mesh, tip, reshape(direction, [2, 1]), limits, utilisation, protected, protected, split)
         if (split%node == 0) exit
         split%mode = mode_tension
         event = event + 1
         kinds(split%kind) = kinds(split%kind) + 1
         call split_mesh(mesh, split, event, changes)
         tip = farthest(mesh, event, start, direction)
      end do
      call check_invariants(mesh, baseline, problem)
      if (len(problem) > 0) then
         write (error_unit, '(a)') problem
         error stop 2
      end if
      events = events + event
      chord = mesh%x(:, tip) - start
      error = atan2(direction(1)*chord(2) - direction(2)*chord(1), dot_product(direction, chord))
      at = mesh%x(:, tip)
      if (all(at > 0.01_wp) .and. all(at < lengths - 0.01_wp)) stopped = stopped + 1
      if (verbose) write (output_unit, '(i2, f8.1, a, f7.2, a, 2f7.2, a, i0, a, f7.2)') m, angle/degree, ' error ', &
         error/degree, ' end ', at, ' events ', event, ' length ', norm2(chord)
   end subroutine follow

   !> The node of an event's crack that lies farthest ahead.
   integer function farthest(mesh, event, start, direction) result(tip)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: event
      real(wp), intent(in) :: start(2), direction(2)
      real(wp) :: ahead
      integer :: s, i, node(2, 2)
      tip = 0
      ahead = -huge(1.0_wp)
      do s = 1, mesh%n_segments
         if (mesh%segment_event(s) /= event) cycle
         node = side_nodes(mesh, s)
         do i = 1, 2
            if (dot_product(mesh%x(:, node(i, 1)) - start, direction) <= ahead) cycle
            ahead = dot_product(mesh%x(:, node(i, 1)) - start, direction)
            tip = node(i, 1)
         end do
      end do
   end function farthest

end program splitting_paths
