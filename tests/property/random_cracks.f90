!> Random cracks that exist from the start, put into random bodies by fitting the mesh (*CRACK, SPLITTING=FIT): through the
!> body, inside it, crossing, in a T, three from one point, bent, along and beside mesh lines. Each time every invariant of
!> the mesh must hold, the body's area be kept, all segments lie on the lines, and their length be that of the lines
!> inside the body.
!>
!>    random_cracks BODIES [SEED]
!>
!> What fails is told with its seed: `random_cracks 1 SEED` runs that body alone.
program random_cracks
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use rf_kinds, only: wp, pi, degree
   use rf_random, only: uniform
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, side_nodes
   use rf_crack_input, only: crack_list_t
   use rf_crack_line, only: clip_to_element
   use rf_crack_fit, only: fit_t
   use rf_crack_insertion, only: crack_mesh
   use rf_diagnostics, only: diagnostics_t
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   use rf_text, only: to_text
   use test_meshes, only: punched, smallest_angle
   implicit none

   !> lengths and places agree within this part of the body's size
   real(wp), parameter :: near = 1.0e-9_wp
   !> largest change of a triangle's smallest angle that is told apart
   integer, parameter :: n_kinds = 8
   real(wp), parameter :: size_of_body = 10
   character(len=11), parameter :: pattern(4) = [character(len=11) :: 'STAGGERED', 'DIAGONAL', 'ALTERNATING', 'CROSS']
   integer :: bodies, first, seed, draws, below(3)
   real(wp) :: worst

   if (command_argument_count() == 0) then
      write (error_unit, '(a)') 'usage: random_cracks BODIES [SEED]'
      stop 2
   end if
   bodies = argument(1, 300)
   first = argument(2, 1)
   worst = pi
   below = 0
   do seed = first, first + bodies - 1
      call run_body(seed)
   end do
   write (output_unit, '(i0, a, f6.3, a, 3(i0, a))') bodies, ' bodies with random cracks: smallest angle ', worst/degree, &
      ' degrees; below 10, 5, 1 degrees in ', below(1), ', ', below(2), ', ', below(3), ' bodies; every invariant kept'

contains

   integer function argument(place, standard) result(value)
      integer, intent(in) :: place, standard
      character(len=20) :: word
      integer :: status
      value = standard
      if (command_argument_count() < place) return
      call get_command_argument(place, word)
      read (word, *, iostat=status) value
      if (status == 0) return
      write (error_unit, '(a)') 'usage: random_cracks BODIES [SEED]'
      stop 2
   end function argument

   !> The next random number of a body.
   real(wp) function draw(seed)
      integer, intent(in) :: seed
      draws = draws + 1
      draw = uniform(seed, draws, 7)
   end function draw

   !> A random point of the square.
   function any_point(seed) result(point)
      integer, intent(in) :: seed
      real(wp) :: point(2)
      point(1) = size_of_body*(0.1_wp + 0.8_wp*draw(seed))
      point(2) = size_of_body*(0.1_wp + 0.8_wp*draw(seed))
   end function any_point

   subroutine run_body(seed)
      integer, intent(in) :: seed
      type(mesh_t) :: mesh, before
      type(crack_list_t) :: cracks
      type(changes_t) :: changes
      type(fit_t) :: fit
      type(baseline_t) :: original, baseline
      type(diagnostics_t) :: diagnostics
      character(len=:), allocatable :: problem
      real(wp) :: angle
      integer :: cells, kind, which
      draws = 0
      cells = 6 + int(24*draw(seed))
      which = 1 + int(4*draw(seed))
      kind = 1 + int(n_kinds*draw(seed))
      call punched(pattern(which), [size_of_body, size_of_body], [cells, cells], merge(0.15_wp, 0.0_wp, draw(seed) < 0.7_wp), &
                   seed, reshape([any_point(seed), merge(1.5_wp, 0.0_wp, draw(seed) < 0.3_wp)], [3, 1]), mesh)
      before = mesh
      call take_baseline(mesh, original)
      call make_cracks(seed, kind, cracks)
      call crack_mesh(mesh, cracks, fit, changes, diagnostics)
      problem = ''
      if (diagnostics%n_errors > 0) problem = diagnostics%messages(1)%text
      if (problem == 'no part of the crack lies inside the body') problem = ''
      call take_baseline(mesh, baseline)
      if (abs(baseline%area - original%area) > near*original%area) problem = 'the area has changed'
      if (abs(baseline%perimeter - original%perimeter) > near*original%perimeter) problem = 'the boundary has changed'
      if (len(problem) == 0) call check_invariants(mesh, baseline, problem)
      if (len(problem) == 0) call check_lines(before, mesh, cracks, problem)
      if (len(problem) > 0) then
         write (error_unit, '(a, i0, a, i0, 3a, i0, 2a)') 'seed ', seed, ', kind ', kind, ', ', trim(pattern(which)), ' ', cells, &
            ': ', problem
         error stop 1
      end if
      angle = least_angle(mesh)
      worst = min(worst, angle)
      where (angle < [10, 5, 1]*degree) below = below + 1
      if (command_argument_count() > 1) write (output_unit, '(a, i0, a, f7.3, a, f7.3)') 'kind ', kind, &
         ': smallest angle before ', least_angle(before)/degree, ', after ', angle/degree
   end subroutine run_body

   !> One or several cracks that belong together.
   subroutine make_cracks(seed, kind, cracks)
      integer, intent(in) :: seed, kind
      type(crack_list_t), intent(out) :: cracks
      real(wp) :: p(2), q(2), r(2), along(2), angle
      integer :: i
      allocate (cracks%crack(3))
      p = any_point(seed)
      q = any_point(seed)
      angle = 2*pi*draw(seed)
      along = 20*[cos(angle), sin(angle)]
      select case (kind)
      case (1) ! through the body
         call add(cracks, reshape([p - along, p + along], [2, 2]))
      case (2) ! inside
         call add(cracks, reshape([p, q], [2, 2]))
      case (3) ! crossing
         call add(cracks, reshape([p - along, p + along], [2, 2]))
         call add(cracks, reshape([p + 0.1_wp*[along(2), -along(1)], p - 0.2_wp*(q - p)], [2, 2]))
      case (4) ! a T
         call add(cracks, reshape([p, q], [2, 2]))
         call add(cracks, reshape([0.3_wp*p + 0.7_wp*q, any_point(seed)], [2, 2]))
      case (5) ! three from one point
         do i = 1, 3
            along = 3*[cos(angle + 2*i), sin(angle + 2*i)]
            call add(cracks, reshape([p, p + along], [2, 2]))
         end do
      case (6) ! bent, and out of the body
         r = any_point(seed)
         call add(cracks, reshape([p, q, r, p + along], [2, 4]))
      case (7) ! from the boundary, along a mesh line
         call add(cracks, reshape([0.0_wp, size_of_body/2, 0.7_wp*size_of_body, size_of_body/2], [2, 2]))
      case default ! from near the boundary, nearly along a mesh line
         call add(cracks, reshape([0.02_wp, size_of_body/2 + 0.05_wp, 0.7_wp*size_of_body, size_of_body/2], [2, 2]))
      end select
   end subroutine make_cracks

   subroutine add(cracks, point)
      type(crack_list_t), intent(inout) :: cracks
      real(wp), intent(in) :: point(:, :)
      cracks%n = cracks%n + 1
      cracks%crack(cracks%n)%point = point
      cracks%crack(cracks%n)%name = ''
   end subroutine add

   !> Smallest angle of all triangles [rad].
   real(wp) function least_angle(mesh) result(angle)
      type(mesh_t), intent(in) :: mesh
      integer :: e
      angle = pi
      do e = 1, mesh%n_elements
         angle = min(angle, smallest_angle(mesh, e))
      end do
   end function least_angle

   !> All segments lie on the cracks, each crack has its length inside the body.
   subroutine check_lines(before, mesh, cracks, problem)
      type(mesh_t), intent(in) :: before, mesh
      type(crack_list_t), intent(in) :: cracks
      character(len=:), allocatable, intent(inout) :: problem
      real(wp) :: wanted, found, inside(2), x(2, 2)
      integer :: c, i, e, s, nodes(2, 2)
      logical :: meets
      do c = 1, cracks%n
         wanted = 0
         found = 0
         associate (point => cracks%crack(c)%point)
            do i = 1, size(point, 2) - 1
               do e = 1, before%n_elements
                  call clip_to_element(before, e, point(:, i), point(:, i + 1), meets, inside)
                  if (meets) wanted = wanted + inside(2) - inside(1)
               end do
            end do
            do s = 1, mesh%n_segments
               if (mesh%segment_crack(s) /= c) cycle
               nodes = side_nodes(mesh, s)
               x = mesh%x(:, nodes(:, 1))
               found = found + norm2(x(:, 2) - x(:, 1))
               do i = 1, 2
                  if (distance(x(:, i), point) > near*size_of_body) &
                     problem = 'segment '//to_text(s)//' lies '//to_text(distance(x(:, i), point))//' beside its crack'
               end do
            end do
         end associate
         ! a crack along an edge of the old mesh lies in both its elements
         if (abs(found - wanted) > near*size_of_body .and. .not. along_edges(before, cracks, c, found)) &
            problem = 'crack '//to_text(c)//' has the length '//to_text(found)//', not '//to_text(wanted)
      end do
   end subroutine check_lines

   !> Whether parts of the crack lay on edges, where they are counted twice or not at all by rounding: then the line is
   !> shifted by a little for the count. Where it runs along the boundary it does so one way only.
   logical function along_edges(mesh, cracks, c, found)
      type(mesh_t), intent(in) :: mesh
      type(crack_list_t), intent(in) :: cracks
      integer, intent(in) :: c
      real(wp), intent(in) :: found
      real(wp) :: shift(2), inside(2), shifted(2)
      integer :: i, e, way
      logical :: meets
      shifted = 0
      do way = 1, 2
         shift = 1.0e-10_wp*size_of_body*(2*way - 3)*[0.6_wp, 0.8_wp]
         associate (point => cracks%crack(c)%point)
            do i = 1, size(point, 2) - 1
               do e = 1, mesh%n_elements
                  call clip_to_element(mesh, e, point(:, i) + shift, point(:, i + 1) + shift, meets, inside)
                  if (meets) shifted(way) = shifted(way) + inside(2) - inside(1)
               end do
            end do
         end associate
      end do
      along_edges = abs(found - minval(shifted)) <= near*size_of_body
   end function along_edges

   !> Distance of a point from a polyline [length].
   real(wp) function distance(x, point)
      real(wp), intent(in) :: x(2), point(:, :)
      real(wp) :: along(2), s, length
      integer :: i
      distance = huge(1.0_wp)
      do i = 1, size(point, 2) - 1
         length = norm2(point(:, i + 1) - point(:, i))
         along = (point(:, i + 1) - point(:, i))/length
         s = min(max(dot_product(x - point(:, i), along), 0.0_wp), length)
         distance = min(distance, norm2(x - point(:, i) - s*along))
      end do
   end function distance

end program random_cracks
