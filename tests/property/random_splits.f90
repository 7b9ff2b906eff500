!> Random splits of random bodies: after each one everything in rf_invariants must hold, and all that is attached to the
!> mesh must have followed.
!>
!>    random_splits SPLITS [SEED]
!>
!> A run is a function of its seed. What fails is told with the seed of its body and the number of its split:
!> `random_splits 1 SEED` runs that body alone.
program random_splits
   use, intrinsic :: iso_fortran_env, only: output_unit, error_unit
   use rf_kinds, only: wp, pi, degree
   use rf_random, only: uniform
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_contact, only: contact_t
   use rf_rows, only: rows_t
   use rf_step_k, only: internal_forces
   use rf_pieces, only: pieces_t
   use rf_loads, only: loads_t, load_definition_t, load_support, load_force, load_edges, load_gravity
   use rf_criterion, only: max_rays, mode_tension, mode_shear
   use rf_criterion_cutoff, only: cutoff_t
   use rf_ray, only: split_t, split_limits_t, choose_split
   use rf_splitting, only: split_mesh
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   use test_meshes, only: punched, uniform_material, check_changes, check_carried, check_pairs, totals_t, take_totals, &
      smallest_angle, nodal_forces, check_forces
   implicit none

   !> a body and what is attached to it
   type :: body_t
      type(mesh_t) :: mesh
      type(material_t) :: material
      type(motion_t) :: motion
      type(contact_t) :: contact
      type(loads_t) :: loads
      type(rows_t) :: rows
      type(pieces_t) :: pieces
      type(baseline_t) :: baseline
      type(split_limits_t) :: limits
      logical, allocatable :: no_split_node(:), no_split_element(:)
      !> applied forces before the first split: sum [force], sum of magnitudes
      real(wp) :: applied(2), applied_scale
      !> smallest angle of the mesh before its first split [rad]
      real(wp) :: angle
      integer :: seed = 0, splits = 0
   end type body_t

   !> bodies are split this often at most, and left when so many tries in a row found nothing to split
   integer, parameter :: splits_a_body = 60, tries_in_vain = 40
   character(len=11), parameter :: pattern(4) = [character(len=11) :: 'STAGGERED', 'DIAGONAL', 'ALTERNATING', 'CROSS']
   integer :: draws, wanted, first_seed, done, bodies, kinds(4), seed
   !> of nodal forces over a split, relative to the largest force
   real(wp) :: largest_jump

   if (command_argument_count() == 0) then
      write (error_unit, '(a)') 'usage: random_splits SPLITS [SEED]'
      stop 2
   end if
   wanted = argument(1, 1000)
   first_seed = argument(2, 1)
   done = 0
   bodies = 0
   kinds = 0
   largest_jump = 0
   seed = first_seed
   do while (done < wanted)
      call run_body(seed)
      bodies = bodies + 1
      seed = seed + 1
   end do
   write (output_unit, '(i0, a, i0, a, i0, a, i0, a, 4(i0, a))') done, ' random splits of ', bodies, ' bodies (seeds ', &
      first_seed, ' to ', seed - 1, '): types I, II, III, edge ', kinds(1), ', ', kinds(2), ', ', kinds(3), ', ', kinds(4), &
      '; every invariant kept after each'
   write (output_unit, '(a, es8.2)') 'largest jump of nodal forces over a split / largest force: ', largest_jump

contains

   !> An argument of the command line that is a number.
   integer function argument(place, standard) result(value)
      integer, intent(in) :: place, standard
      character(len=20) :: word
      integer :: status
      value = standard
      if (command_argument_count() < place) return
      call get_command_argument(place, word)
      read (word, *, iostat=status) value
      if (status == 0) return
      write (error_unit, '(a)') 'usage: random_splits SPLITS [SEED]'
      stop 2
   end function argument

   !> The next random number of a body.
   real(wp) function draw(seed)
      integer, intent(in) :: seed
      draws = draws + 1
      draw = uniform(seed, draws, 1)
   end function draw

   !> A random whole number from 1 to n.
   integer function pick(seed, n)
      integer, intent(in) :: seed, n
      pick = min(n, 1 + int(n*draw(seed)))
   end function pick

   !> Make a body and split it at random.
   subroutine run_body(seed)
      integer, intent(in) :: seed
      type(body_t) :: body
      type(split_t) :: split
      integer :: tries
      draws = 0
      call make_body(seed, body)
      tries = 0
      do while (body%splits < splits_a_body .and. tries < tries_in_vain)
         call plan_at_random(body, split)
         tries = tries + 1
         if (split%node == 0) cycle
         tries = 0
         call split_and_check(body, split)
      end do
   end subroutine run_body

   !> A rectangle of random pattern and size with up to two holes, which may touch each other or the boundary at nodes.
   subroutine make_body(seed, body)
      integer, intent(in) :: seed
      type(body_t), intent(out) :: body
      real(wp) :: circle(3, 2), lengths(2)
      character(len=:), allocatable :: problem
      integer :: cells(2), holes, i, e
      body%seed = seed
      cells = [2 + pick(seed, 9), 2 + pick(seed, 9)]
      lengths = cells*[1.0_wp, 0.7_wp + 0.6_wp*draw(seed)]
      holes = pick(seed, 3) - 1
      do i = 1, holes
         circle(:, i) = [lengths(1)*draw(seed), lengths(2)*draw(seed), 0.3_wp + 1.5_wp*draw(seed)]
      end do
      call punched(trim(pattern(pick(seed, 4))), lengths, cells, merge(0.0_wp, 0.25_wp, draw(seed) < 0.3_wp), seed, &
                   circle(:, :holes), body%mesh)
      call uniform_material(body%mesh, body%material)
      call take_baseline(body%mesh, body%baseline)
      call check_invariants(body%mesh, body%baseline, problem)
      if (len(problem) > 0) call fail(body, 'before the first split: '//problem)
      body%angle = pi
      do e = 1, body%mesh%n_elements
         body%angle = min(body%angle, smallest_angle(body%mesh, e))
      end do
      body%limits%max_level = pick(seed, 5)
      if (draw(seed) < 0.3_wp) body%limits%crack_angle = 0
      body%limits%along_edges = mod(seed, 6) == 0
      allocate (body%no_split_node(100*body%mesh%n_nodes), body%no_split_element(100*body%mesh%n_elements), source=.false.)
      if (draw(seed) < 0.3_wp) body%no_split_element(pick(seed, body%mesh%n_elements)) = .true.
      if (draw(seed) < 0.3_wp) body%no_split_node(pick(seed, body%mesh%n_nodes)) = .true.
      call set_in_motion(body)
      call load(body)
      call body%contact%rebuild(body%mesh, body%material, body%motion)
      call body%rows%build(body%mesh, body%material)
      call body%pieces%find(body%mesh)
   end subroutine make_body

   !> Random displacements and velocities.
   subroutine set_in_motion(body)
      type(body_t), intent(inout) :: body
      integer :: n
      call body%motion%reserve(body%mesh%n_nodes)
      do n = 1, body%mesh%n_nodes
         body%motion%ux(n) = draw(body%seed) - 0.5_wp
         body%motion%uy(n) = draw(body%seed) - 0.5_wp
         body%motion%vx(n) = draw(body%seed) - 0.5_wp
         body%motion%vy(n) = draw(body%seed) - 0.5_wp
      end do
   end subroutine set_in_motion

   !> Set 1 (half of the nodes) is held across, set 2 bears forces, set 3 pressure where it has edges; all have weight.
   subroutine load(body)
      type(body_t), intent(inout) :: body
      type(load_definition_t) :: definition(5)
      logical :: replaced(load_gravity)
      integer :: n, set
      do n = 1, body%mesh%n_nodes
         do set = 1, 3
            if (draw(body%seed) < 0.5_wp) body%mesh%node_membership(1, n) = ibset(body%mesh%node_membership(1, n), set - 1)
         end do
      end do
      body%mesh%element_membership(1, :body%mesh%n_elements) = 1
      definition(1) = load_definition_t(kind=load_support, set=1, first_dof=1, last_dof=1, value=0.5_wp)
      definition(2) = load_definition_t(kind=load_force, set=2, first_dof=1, last_dof=1, value=1.0_wp)
      definition(3) = load_definition_t(kind=load_force, entity=pick(body%seed, body%mesh%n_nodes), first_dof=2, last_dof=2, &
                                        value=3.0_wp)
      definition(4) = load_definition_t(kind=load_edges, set=3, value=0.7_wp)
      definition(5) = load_definition_t(kind=load_gravity, set=1, value=9.81_wp, direction=[0.6_wp, -0.8_wp])
      replaced = .false.
      call body%loads%prepare(body%mesh%n_nodes)
      call body%loads%begin_step(body%mesh, definition, replaced, spread([0.0_wp, 0.0_wp], 2, body%mesh%n_nodes), &
                                 body%motion%ux, body%motion%uy)
      call body%loads%apply(body%mesh, body%material, 0.5_wp, 0.5_wp)
      body%applied = applied_now(body)
      body%applied_scale = sum(abs(body%loads%px(:body%mesh%n_nodes))) + sum(abs(body%loads%py(:body%mesh%n_nodes)))
   end subroutine load

   function applied_now(body) result(force)
      type(body_t), intent(in) :: body
      real(wp) :: force(2)
      force = [sum(body%loads%px(:body%mesh%n_nodes)), sum(body%loads%py(:body%mesh%n_nodes))]
   end function applied_now

   !> A split as a run would choose it, at a random node in a random state of stress. Half of the nodes are the newest:
   !> tips, crack faces, and what was split before.
   subroutine plan_at_random(body, split)
      type(body_t), intent(inout) :: body
      type(split_t), intent(out) :: split
      type(cutoff_t) :: law
      real(wp), allocatable :: utilisation(:)
      real(wp) :: ray(2, max_rays), stress(3)
      integer :: node, n_rays, e, i
      node = pick(body%seed, body%mesh%n_nodes)
      if (draw(body%seed) < 0.5_wp) node = body%mesh%n_nodes + 1 - pick(body%seed, min(12, body%mesh%n_nodes))
      if (draw(body%seed) < 0.3_wp .and. body%mesh%n_segments > 0) then
         e = body%mesh%segment_element(pick(body%seed, 2), pick(body%seed, body%mesh%n_segments))
         node = body%mesh%connectivity(pick(body%seed, 3), e)
      end if
      if (body%mesh%hinge(node) .or. body%no_split_node(node)) return
      do i = 1, 3
         stress(i) = draw(body%seed) - 0.5_wp
      end do
      if (draw(body%seed) < 0.2_wp) stress(3) = 0       ! along the mesh's own lines
      call law%directions(stress, tan(30*degree), merge(mode_tension, mode_shear, draw(body%seed) < 0.5_wp), ray, n_rays)
      allocate (utilisation(body%mesh%n_elements))
      do e = 1, body%mesh%n_elements
         utilisation(e) = draw(body%seed)
      end do
      call choose_split(body%mesh, node, ray(:, :n_rays), body%limits, utilisation, body%no_split_node, body%no_split_element, &
                        split)
      split%mode = mode_tension
   end subroutine plan_at_random

   !> Split, let everything follow, check all of it.
   subroutine split_and_check(body, split)
      type(body_t), intent(inout) :: body
      type(split_t), intent(in) :: split
      type(mesh_t) :: before
      type(totals_t) :: totals
      type(changes_t) :: changes
      character(len=:), allocatable :: problem
      real(wp), allocatable :: forces(:, :)
      real(wp) :: jump
      integer :: i
      jump = 0
      before = body%mesh
      forces = nodal_forces(body%mesh, body%material, body%motion)
      totals = take_totals(body%mesh, body%motion)
      call split_mesh(body%mesh, split, body%splits + 1, changes)
      call body%material%adopt(changes)
      call body%motion%adopt(changes)
      call body%loads%adopt(changes)
      call body%loads%follow(body%mesh, body%material, changes, 0.5_wp, 0.5_wp)
      call body%rows%update(body%mesh, body%material, changes)
      call body%pieces%follow(body%mesh, changes)
      call body%contact%follow(body%mesh, body%material, body%motion, changes)
      call check_invariants(body%mesh, body%baseline, problem, changes)
      if (len(problem) == 0) call check_changes(before, body%mesh, changes, problem)
      if (len(problem) == 0) call check_carried(totals, body%mesh, body%motion, changes, problem)
      if (len(problem) == 0) call check_forces(forces, body%mesh, body%material, body%motion, changes, problem, jump)
      largest_jump = max(largest_jump, jump)
      if (len(problem) == 0) call check_followed(body, problem)
      if (len(problem) == 0) call check_pairs(body%mesh, body%material, body%contact, problem)
      if (norm2(applied_now(body) - body%applied) > 1.0e-11_wp*body%applied_scale) problem = 'the sum of the loads has changed'
      do i = 1, changes%n_elements
         if (smallest_angle(body%mesh, changes%element(i)) < min(body%angle, body%limits%smallest_angle) - 1.0e-9_wp) &
            problem = 'a child is too thin'
         if (body%mesh%split_level(changes%element(i)) > body%limits%max_level) problem = 'a child is too many generations down'
      end do
      body%splits = body%splits + 1
      if (len(problem) > 0) call fail(body, problem, split)
      done = done + 1
      kinds(split%kind) = kinds(split%kind) + 1
   end subroutine split_and_check

   !> What follows a split where it touched the body is what it would be if it were found anew, bit for bit.
   subroutine check_followed(body, problem)
      type(body_t), intent(in) :: body
      character(len=:), allocatable, intent(inout) :: problem
      type(loads_t) :: loads
      type(rows_t) :: rows
      type(pieces_t) :: pieces
      integer :: n, i
      n = body%mesh%n_nodes
      loads = body%loads
      call loads%apply(body%mesh, body%material, 0.5_wp, 0.5_wp)
      if (any(differ(loads%px(:n), body%loads%px(:n)) .or. differ(loads%py(:n), body%loads%py(:n)))) problem = 'forces on nodes'
      do i = 1, n
         if (any(differ(loads%at_support(loads%displacement, i), body%loads%at_support(body%loads%displacement, i)))) &
            problem = 'supports'
         if (any(differ(loads%force_at(i), body%loads%force_at(i)))) problem = 'applied forces'
      end do
      call pieces%find(body%mesh)
      if (pieces%n /= body%pieces%n) problem = 'the number of pieces'
      if (any(pieces%of_node(:n) /= body%pieces%of_node(:n))) problem = 'pieces of nodes'
      call rows%build(body%mesh, body%material, body%rows%alike)
      if (any(differ(rows%inverse_mass(:n), body%rows%inverse_mass(:n)))) problem = 'masses'
      if (any(differ(forces_of(rows, body), forces_of(body%rows, body)))) problem = 'rows'
      if (len(problem) > 0) problem = problem//' did not follow'
   end subroutine check_followed

   elemental logical function differ(one, other)
      real(wp), intent(in) :: one, other
      differ = abs(one - other) > 0
   end function differ

   !> Internal forces by the rows [force], (2 nodes).
   function forces_of(rows, body) result(f)
      type(rows_t), intent(in) :: rows
      type(body_t), intent(in) :: body
      real(wp), allocatable :: f(:)
      real(wp) :: fx(body%mesh%n_nodes), fy(body%mesh%n_nodes)
      call internal_forces(rows%n_blocks, rows%first, rows%count, rows%slice, rows%order, rows%column, rows%kxx, rows%kxy, &
                           rows%kyx, rows%kyy, rows%skew_start, rows%skew_count, rows%skew_edge, rows%skew, &
                           body%motion%ux, body%motion%uy, fx, fy)
      f = [fx, fy]
   end function forces_of

   subroutine fail(body, problem, split)
      type(body_t), intent(in) :: body
      character(len=*), intent(in) :: problem
      type(split_t), intent(in), optional :: split
      write (error_unit, '(a, i0, a, i0, 2a)') 'random_splits: seed ', body%seed, ', split ', body%splits, ': ', problem
      if (present(split)) write (error_unit, '(3(a, i0), 2(a, f12.9), a, f9.6, 2(a, i0))') '  node ', split%node, ', element ', &
         split%element, ', type ', split%kind, ', ray ', split%direction(1), ' ', split%direction(2), ', s ', split%s, &
         ', corners ', split%corner, ' ', split%second_corner
      error stop 1
   end subroutine fail

end program random_splits
