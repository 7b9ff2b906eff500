!> Random bodies for the property test: the smallest have two triangles, the largest 5,000; with slivers, holes, re-entrant
!> corners, points where parts only touch, cracks from the start; held, pushed, pressed and heavy, in random motion.
!>
!> A number drawn depends on the seed, the attempt it is drawn for and how many were drawn for it before, not on what other
!> attempts did: a sequence of events from which some are left out still draws the same numbers for the others.
module random_body
   use rf_kinds, only: wp, pi, degree, i1
   use rf_random, only: uniform
   use rf_mesh, only: mesh_t
   use rf_generate, only: generate
   use rf_topology, only: changes_t, bisect_edge
   use rf_cst, only: elasticity
   use rf_model, only: model_t
   use rf_loads, only: load_definition_t, load_support, load_force, load_edges, load_gravity, load_crack
   use rf_criterion, only: strength_t
   use rf_criteria, only: make_criterion
   use rf_crack_input, only: crack_list_t
   use rf_crack_fit, only: fit_t
   use rf_crack_insertion, only: crack_mesh
   use rf_diagnostics, only: diagnostics_t
   use test_meshes, only: plain_mesh, smallest_angle
   implicit none
   private
   public :: draws_t, body_t, make_body, load_body, shape_name, n_shapes

   !> shapes of bodies
   integer, parameter :: n_shapes = 8
   character(len=12), parameter :: shape_name(n_shapes) = [character(len=12) :: 'two elements', 'rectangle', 'holes', &
                                                           'notch', 'slivers', 'irregular', 'gaps', 'cracks']
   character(len=11), parameter :: pattern(4) = [character(len=11) :: 'STAGGERED', 'DIAGONAL', 'ALTERNATING', 'CROSS']
   !> elements of the smallest and the largest body; small ones are more frequent: the exponent of the draw
   real(wp), parameter :: fewest = 2, most = 5000, smallness = 2.2_wp
   !> node sets 1 to 3 of every body, element sets 1 (all) and 2
   integer, parameter, public :: n_node_sets = 3, n_element_sets = 2

   !> numbers drawn for one attempt
   type :: draws_t
      integer :: seed = 0, attempt = 0, n = 0
   contains
      procedure :: next, pick, chance
   end type draws_t

   !> a body under load, and what it began with
   type :: body_t
      type(model_t) :: model
      integer :: shape = 0
      !> smallest angle of the mesh before its first split [rad]
      real(wp) :: angle = pi
   end type body_t

contains

   !> The next random number of an attempt, in (0, 1).
   real(wp) function next(self)
      class(draws_t), intent(inout) :: self
      self%n = self%n + 1
      next = uniform(self%seed, self%n, self%attempt)
   end function next

   !> A random whole number from 1 to n.
   integer function pick(self, n)
      class(draws_t), intent(inout) :: self
      integer, intent(in) :: n
      pick = min(n, 1 + int(n*self%next()))
   end function pick

   !> True as often as asked for.
   logical function chance(self, often)
      class(draws_t), intent(inout) :: self
      !> from 0 (never) to 1
      real(wp), intent(in) :: often
      chance = self%next() < often
   end function chance

   !> The body of a seed.
   subroutine make_body(seed, body)
      integer, intent(in) :: seed
      type(body_t), intent(out) :: body
      type(draws_t) :: draws
      integer :: e
      draws = draws_t(seed, 0, 0)
      body%shape = 1 + mod(seed, n_shapes)
      call make_mesh(draws, body)
      associate (model => body%model)
         do e = 1, model%mesh%n_elements
            body%angle = min(body%angle, smallest_angle(model%mesh, e))
            if (model%mesh%x(1, model%mesh%connectivity(1, e)) > 0.6_wp*model%mesh%size) model%mesh%section(e) = 2
         end do
         call make_material(draws, model)
         call make_sets(draws, model%mesh)
         call model%prepare()
         do e = 1, model%mesh%n_nodes
            if (draws%chance(0.02_wp)) model%failure%no_split_node(e) = .true.
         end do
         if (draws%chance(0.3_wp)) model%failure%no_split_element(draws%pick(model%mesh%n_elements)) = .true.
         call set_in_motion(draws, model)
      end associate
      call load_body(draws, body)
      call body%model%contact%rebuild(body%model%mesh, body%model%material, body%model%motion)
   end subroutine make_body

   !> A mesh of the body's shape.
   subroutine make_mesh(draws, body)
      type(draws_t), intent(inout) :: draws
      type(body_t), intent(inout) :: body
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: connectivity(:, :), sides(:)
      real(wp) :: wanted, aspect, size(2), jitter
      integer :: cells(2)
      wanted = fewest*(most/fewest)**(draws%next()**smallness)
      aspect = 4**(draws%next() - 0.5_wp)
      if (body%shape == 1) wanted = 2
      cells = max(1, nint(sqrt(wanted/2)*[aspect, 1/aspect]))
      if (wanted <= 2) cells = 1
      size = real(cells, wp)
      jitter = merge(0.0_wp, 0.3_wp*draws%next(), draws%chance(0.3_wp))
      call generate(merge(pattern(2), pattern(draws%pick(4)), body%shape == 1), [0.0_wp, 0.0_wp], size, cells, jitter, &
                    draws%seed, x, connectivity, sides)
      select case (body%shape)
      case (3)
         call leave_out(draws, 'circles', x, connectivity)
      case (4)
         call leave_out(draws, 'boxes', x, connectivity)
      case (5)
         x(1, :) = x(1, :)*(1 + 29*draws%next())
         x(2, :) = x(2, :)*(0.2_wp + x(2, :)/size(2))
         if (draws%chance(0.5_wp)) x(1, :) = x(1, :) + 2*x(2, :)
      case (7)
         call leave_out(draws, 'anything', x, connectivity)
      end select
      call plain_mesh(x, connectivity, body%model%mesh)
      if (body%shape == 6) call make_irregular(draws, body%model%mesh)
      if (body%shape == 8) call crack_body(draws, body%model%mesh, size, body%model%changes)
   end subroutine make_mesh

   !> Leave out elements in circles, in boxes (slits and corners), or anywhere; one stays at least.
   subroutine leave_out(draws, where_from, x, connectivity)
      type(draws_t), intent(inout) :: draws
      character(len=*), intent(in) :: where_from
      real(wp), intent(in) :: x(:, :)
      integer, allocatable, intent(inout) :: connectivity(:, :)
      real(wp) :: centre(2), reach(2), full(2), radius, apart(2)
      integer, allocatable :: kept(:)
      logical, allocatable :: stays(:)
      integer :: e, i
      allocate (stays(size(connectivity, 2)), source=.true.)
      full = maxval(x, 2)
      do i = 1, draws%pick(3)
         centre = full*[draws%next(), draws%next()]
         radius = 0.25_wp*minval(full)*draws%next()
         reach = full*merge([0.03_wp, 0.4_wp], [0.3_wp, 0.3_wp], draws%chance(0.5_wp))
         if (draws%chance(0.5_wp)) reach = full/full(2)*reach([2, 1])
         do e = 1, size(connectivity, 2)
            apart = sum(x(:, connectivity(:, e)), 2)/3 - centre
            if (where_from == 'circles') stays(e) = stays(e) .and. norm2(apart) >= radius
            if (where_from == 'boxes') stays(e) = stays(e) .and. any(abs(apart) >= reach)
         end do
      end do
      if (where_from == 'anything') then
         do e = 1, size(connectivity, 2)
            stays(e) = .not. draws%chance(0.2_wp)
         end do
      end if
      if (.not. any(stays)) stays(1) = .true.
      kept = pack([(e, e=1, size(stays))], stays)
      connectivity = connectivity(:, kept)
   end subroutine leave_out

   !> Bisect edges at random: fans and angles of all kinds. The mesh then counts as the deck's.
   subroutine make_irregular(draws, mesh)
      type(draws_t), intent(inout) :: draws
      type(mesh_t), intent(inout) :: mesh
      type(changes_t) :: changes
      type(mesh_t) :: fresh
      integer :: i, midpoint
      call changes%clear()
      do i = 1, 1 + mesh%n_elements/4
         call bisect_edge(mesh, draws%pick(mesh%n_elements), draws%pick(3), changes, midpoint)
      end do
      call plain_mesh(mesh%x(:, :mesh%n_nodes), mesh%connectivity(:, :mesh%n_elements), fresh)
      mesh = fresh
   end subroutine make_irregular

   !> One to three cracks from the start, crossing or not; where one cannot be put in, the body stays as far as it got.
   subroutine crack_body(draws, mesh, size, changes)
      type(draws_t), intent(inout) :: draws
      type(mesh_t), intent(inout) :: mesh
      !> of the body [length]
      real(wp), intent(in) :: size(2)
      type(changes_t), intent(inout) :: changes
      type(crack_list_t) :: cracks
      type(fit_t) :: fit
      type(diagnostics_t) :: diagnostics
      real(wp) :: middle(2)
      integer :: i
      allocate (cracks%crack(3))
      cracks%n = draws%pick(3)
      middle = size*[0.3_wp + 0.4_wp*draws%next(), 0.3_wp + 0.4_wp*draws%next()]
      do i = 1, cracks%n
         allocate (cracks%crack(i)%point(2, 2))
         cracks%crack(i)%point(:, 1) = size*[draws%next(), draws%next()]
         cracks%crack(i)%point(:, 2) = merge(middle, 1.3_wp*size*[draws%next(), draws%next()], draws%chance(0.6_wp))
         cracks%crack(i)%name = ''
      end do
      call crack_mesh(mesh, cracks, fit, changes, diagnostics)
   end subroutine crack_body

   !> Two materials, the second one softens; or both break at once.
   subroutine make_material(draws, model)
      type(draws_t), intent(inout) :: draws
      type(model_t), intent(inout) :: model
      integer :: i
      logical :: soft
      soft = draws%chance(0.3_wp)
      allocate (model%material%section(2))
      do i = 1, 2
         associate (section => model%material%section(i))
            section%law = elasticity(real(i, wp), 0.25_wp, .true.)
            section%material = i
            section%thickness = 2
            section%friction = 0.5_wp
            section%cohesion = 3
            section%density = 1
            section%strength = [1.0_wp, 10.0_wp]
            if (soft .and. i == 2) section%fracture_energy = [1.0_wp, 2.0_wp]
         end associate
      end do
      call model%material%prepare(model%mesh%n_elements)
      model%failure%strength = [(strength_t(1.0_wp, 10.0_wp, tan(30*degree), .true.), i=1, 2)]
      allocate (model%failure%criterion(2))
      do i = 1, 2
         call make_criterion('CUTOFF', model%failure%criterion(i))
      end do
      model%failure%settings%on = .true.
      call model%failure%prepare(model%mesh, model%material)
   end subroutine make_material

   !> Every node set has a good part of the nodes, element set 2 half of the elements.
   subroutine make_sets(draws, mesh)
      type(draws_t), intent(inout) :: draws
      type(mesh_t), intent(inout) :: mesh
      integer :: i, set
      real(wp) :: often(n_node_sets)
      do set = 1, n_node_sets
         often(set) = 0.1_wp + 0.8_wp*draws%next()
      end do
      do i = 1, mesh%n_nodes
         do set = 1, n_node_sets
            if (draws%chance(often(set))) mesh%node_membership(1, i) = ibset(mesh%node_membership(1, i), set - 1)
         end do
      end do
      do i = 1, mesh%n_elements
         mesh%element_membership(1, i) = merge(3_i1, 1_i1, draws%chance(0.5_wp))
      end do
   end subroutine make_sets

   !> Random displacements and velocities; crack faces are together.
   subroutine set_in_motion(draws, model)
      type(draws_t), intent(inout) :: draws
      type(model_t), intent(inout) :: model
      integer :: n
      associate (motion => model%motion)
         do n = 1, model%mesh%n_nodes
            motion%ux(n) = draws%next() - 0.5_wp
            motion%uy(n) = draws%next() - 0.5_wp
            motion%vx(n) = draws%next() - 0.5_wp
            motion%vy(n) = draws%next() - 0.5_wp
         end do
      end associate
   end subroutine set_in_motion

   !> A step: set 1 is held across, in some bodies upwards too; set 2 bears forces, set 3 pressure where it has edges; one node
   !> of the deck bears a force of its own, element set 2 its weight, a crack from the start pressure that may follow it.
   subroutine load_body(draws, body)
      type(draws_t), intent(inout) :: draws
      type(body_t), intent(inout) :: body
      type(load_definition_t) :: definition(7)
      logical :: replaced(load_crack)
      integer :: n
      definition(1) = load_definition_t(kind=load_support, set=1, first_dof=1, last_dof=merge(2, 1, draws%chance(0.5_wp)), &
                                        value=0.5_wp)
      definition(2) = load_definition_t(kind=load_force, set=2, first_dof=1, last_dof=1, value=1.0_wp)
      definition(3) = load_definition_t(kind=load_force, entity=draws%pick(body%model%mesh%n_numbered_nodes), first_dof=2, &
                                        last_dof=2, value=3.0_wp)
      definition(4) = load_definition_t(kind=load_edges, set=3, value=0.7_wp)
      definition(5) = load_definition_t(kind=load_gravity, set=2, value=9.81_wp, direction=[0.6_wp, -0.8_wp])
      n = 5
      if (body%shape == 8) then
         n = 6
         definition(6) = load_definition_t(kind=load_crack, entity=1, value=0.3_wp, follow=draws%chance(0.5_wp))
      end if
      replaced = .false.
      associate (model => body%model)
         call model%loads%begin_step(model%mesh, definition(:n), replaced, model%reaction, model%motion%ux, model%motion%uy)
         call model%loads%apply(model%mesh, model%material, 0.5_wp, 0.5_wp)
      end associate
   end subroutine load_body

end module random_body
