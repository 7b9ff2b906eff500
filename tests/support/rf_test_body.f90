!> A body for tests: mesh, material, rows, contact, loads and relaxation of a rectangle, made from plain arguments, and
!> what a test does with it: cut it along mesh edges, bisect edges, load it in steps, relax it, solve it directly.
module rf_test_body
   use rf_kinds, only: wp, i1
   use rf_generate, only: generate
   use rf_mesh, only: mesh_t
   use rf_ordering, only: ordering_hilbert
   use rf_mesh_assembly, only: raw_mesh_t, assemble
   use rf_renumber, only: renumbering_t, plan_order, renumber_mesh
   use rf_topology, only: changes_t, build_topology, crack_edge, bisect_edge, refan_node, next_corner
   use rf_cst, only: elasticity, gradients, stiffness_block, strain, stress
   use rf_material, only: material_t, section_t
   use rf_rows, only: rows_t
   use rf_contact, only: contact_t
   use rf_loads, only: loads_t, load_definition_t, load_support, load_force, load_edges, load_gravity
   use rf_pieces, only: pieces_t
   use rf_motion, only: motion_t
   use rf_relaxation, only: relaxation_t, reaction
   implicit none
   private
   public :: body_t, section, set_left, set_right, set_bottom, set_top, first_free_set, all_elements

   !> node sets of every body: the sides of its rectangle; a test marks sets of its own from first_free_set on
   integer, parameter :: set_left = 1, set_right = 2, set_bottom = 3, set_top = 4, first_free_set = 5
   !> element set of all elements
   integer, parameter :: all_elements = 1
   !> defaults: the rock of the verification cases, MPa and mm
   real(wp), parameter :: default_young = 27400.0_wp, default_poisson = 0.25_wp

   type :: body_t
      type(mesh_t) :: mesh
      type(material_t) :: material
      type(rows_t) :: rows
      type(contact_t) :: contact
      type(loads_t) :: loads
      type(pieces_t) :: pieces
      type(motion_t) :: motion
      type(relaxation_t) :: relaxation
      type(changes_t) :: changes
      !> definitions of the step to come
      type(load_definition_t), allocatable :: definitions(:)
      real(wp) :: tolerance = 1.0e-8_wp
   contains
      procedure :: box, build, cut, bisect, number_anew, follow, mark, define, hold, push, press, weigh_down
      procedure :: begin_step, apply, relax
      procedure :: node_at, displacement, total_reaction, largest_stress, stress_of, direct_solution, stiffness_matrix
   end type body_t

contains

   !> A section of one isotropic material.
   pure type(section_t) function section(young, poisson, plane_strain, thickness, friction, cohesion)
      !> Young's modulus [stress], Poisson's ratio [-]; defaults: rock in MPa
      real(wp), intent(in), optional :: young, poisson
      !> default: plane strain
      logical, intent(in), optional :: plane_strain
      !> thickness [length] (1), friction [-] (0) and cohesion [stress] (0) of its cracks
      real(wp), intent(in), optional :: thickness, friction, cohesion
      section%young = default_young
      section%poisson = default_poisson
      if (present(young)) section%young = young
      if (present(poisson)) section%poisson = poisson
      if (present(plane_strain)) section%plane_strain = plane_strain
      if (present(thickness)) section%thickness = thickness
      if (present(friction)) section%friction = friction
      if (present(cohesion)) section%cohesion = cohesion
      section%material = 1
      section%density = 1
      section%law = elasticity(section%young, section%poisson, section%plane_strain)
   end function section

   !> A rectangle with its lower left corner at the origin.
   subroutine box(self, lengths, cells, pattern, of, jitter, seed)
      class(body_t), intent(inout) :: self
      !> width and height [length]
      real(wp), intent(in) :: lengths(2)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> pattern of rf_generate
      character(len=*), intent(in) :: pattern
      !> what it is made of (default: rock in plane strain)
      type(section_t), intent(in), optional :: of
      !> how far inner nodes are moved [shortest edge] (default: none), and the random directions
      real(wp), intent(in), optional :: jitter
      integer, intent(in), optional :: seed
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: connectivity(:, :), sides(:)
      real(wp) :: amount
      integer :: chosen
      amount = 0
      chosen = 1
      if (present(jitter)) amount = jitter
      if (present(seed)) chosen = seed
      call generate(pattern, [0.0_wp, 0.0_wp], lengths, cells, amount, chosen, x, connectivity, sides)
      if (present(of)) then
         call self%build(x, connectivity, sides, of)
      else
         call self%build(x, connectivity, sides, section())
      end if
   end subroutine box

   !> A body from coordinates and triangles, numbered along a Hilbert curve.
   subroutine build(self, x, connectivity, sides, of)
      class(body_t), intent(inout) :: self
      !> coordinates [length], (2, nodes); nodes counter-clockwise, (3, elements); bits of the sides, (nodes)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: connectivity(:, :), sides(:)
      type(section_t), intent(in) :: of
      type(raw_mesh_t) :: raw
      integer, allocatable :: node_place(:), element_place(:)
      integer :: i, status, offenders(2)
      raw%n_nodes = size(x, 2)
      raw%n_elements = size(connectivity, 2)
      raw%x = x
      raw%connectivity = connectivity
      call assemble(raw, [(i, i=1, raw%n_nodes)], [(i, i=1, raw%n_elements)], ordering_hilbert, self%mesh, &
                    node_place, element_place)
      associate (mesh => self%mesh)
         mesh%section(:mesh%n_elements) = 1
         mesh%last_node_id = raw%n_nodes
         mesh%last_element_id = raw%n_elements
         mesh%element_membership(1, :mesh%n_elements) = 1_i1
         do i = 1, raw%n_nodes
            mesh%node_membership(1, node_place(i)) = int(sides(i), i1)
         end do
         call build_topology(mesh, status, offenders)
      end associate
      self%material%section = [of]
      call self%material%prepare(self%mesh%n_elements)
      self%rows%with_sums = .true.
      call self%rows%build(self%mesh, self%material)
      call self%motion%reserve(self%mesh%n_nodes)
      call self%loads%prepare(self%mesh%n_nodes)
      call self%loads%keep_forces()
      call self%contact%rebuild(self%mesh, self%material, self%motion)
      call self%pieces%find(self%mesh)
      allocate (self%definitions(0))
   end subroutine build

   !> Crack all edges between nodes of a line, and open the line.
   subroutine cut(self, on_line)
      class(body_t), intent(inout) :: self
      !> the node lies on the line, (nodes)
      logical, intent(in) :: on_line(:)
      integer :: e, k, n, copies
      call self%changes%clear()
      do e = 1, self%mesh%n_elements
         do k = 1, 3
            if (.not. on_line(self%mesh%connectivity(k, e))) cycle
            if (.not. on_line(self%mesh%connectivity(next_corner(k), e))) cycle
            call crack_edge(self%mesh, e, k, 0_i1, 0)
         end do
      end do
      do n = 1, size(on_line)
         if (on_line(n)) call refan_node(self%mesh, n, self%changes, copies)
      end do
      call self%follow()
   end subroutine cut

   !> Bisect an edge.
   subroutine bisect(self, element, edge)
      class(body_t), intent(inout) :: self
      integer, intent(in) :: element, edge
      integer :: midpoint
      call self%changes%clear()
      call bisect_edge(self%mesh, element, edge, self%changes, midpoint)
      call self%follow()
   end subroutine bisect

   !> New numbers for nodes and elements, copies beside what they are copies of.
   subroutine number_anew(self)
      class(body_t), intent(inout) :: self
      type(renumbering_t) :: map
      call plan_order(self%mesh, map)
      call renumber_mesh(self%mesh, map)
      call self%material%renumber(map)
      call self%motion%renumber(map)
      call self%loads%renumber(map)
      call self%contact%renumber(map)
      call self%rows%build(self%mesh, self%material)
      call self%contact%rebuild(self%mesh, self%material, self%motion)
      call self%pieces%find(self%mesh)
   end subroutine number_anew

   !> Everything attached to the mesh follows its changes.
   subroutine follow(self)
      class(body_t), intent(inout) :: self
      call self%material%adopt(self%changes)
      call self%motion%adopt(self%changes)
      call self%loads%adopt(self%changes)
      call self%material%initial%nodal_forces(self%mesh, self%material%section%thickness, self%loads%initial, self%changes)
      call self%contact%follow(self%mesh, self%material, self%motion, self%changes)
      call self%rows%update(self%mesh, self%material, self%changes)
      call self%pieces%follow(self%mesh, self%changes)
   end subroutine follow

   !> Put nodes into a set.
   subroutine mark(self, set, member)
      class(body_t), intent(inout) :: self
      integer, intent(in) :: set
      !> (nodes)
      logical, intent(in) :: member(:)
      integer :: n
      do n = 1, size(member)
         if (member(n)) self%mesh%node_membership(1, n) = ibset(self%mesh%node_membership(1, n), set - 1)
      end do
   end subroutine mark

   !> One more definition for the step to come.
   subroutine define(self, kind, set, dof, value, entity, amplitude)
      class(body_t), intent(inout) :: self
      !> load_support ... load_gravity; set it acts on (0: one entity); direction or face; value
      integer, intent(in) :: kind, set, dof
      real(wp), intent(in) :: value
      integer, intent(in), optional :: entity, amplitude
      type(load_definition_t) :: definition
      definition%kind = kind
      definition%set = set
      definition%first_dof = dof
      definition%last_dof = dof
      definition%value = value
      if (present(entity)) definition%entity = entity
      if (present(amplitude)) definition%amplitude = amplitude
      self%definitions = [self%definitions, definition]
   end subroutine define

   !> Support the nodes of a set in one direction.
   subroutine hold(self, set, dof, value)
      class(body_t), intent(inout) :: self
      integer, intent(in) :: set, dof
      !> prescribed displacement [length]
      real(wp), intent(in) :: value
      call self%define(load_support, set, dof, value)
   end subroutine hold

   !> A force on each node of a set.
   subroutine push(self, set, dof, value)
      class(body_t), intent(inout) :: self
      integer, intent(in) :: set, dof
      !> [force]
      real(wp), intent(in) :: value
      call self%define(load_force, set, dof, value)
   end subroutine push

   !> A pressure on the boundary edges of a node set.
   subroutine press(self, set, value)
      class(body_t), intent(inout) :: self
      integer, intent(in) :: set
      !> [stress]
      real(wp), intent(in) :: value
      call self%define(load_edges, set, 0, value)
   end subroutine press

   !> Gravity on all elements.
   subroutine weigh_down(self, value, direction)
      class(body_t), intent(inout) :: self
      !> [length/time^2], [-]
      real(wp), intent(in) :: value, direction(2)
      call self%define(load_gravity, all_elements, 0, value)
      self%definitions(size(self%definitions))%direction = direction
   end subroutine weigh_down

   !> Begin a step with the definitions there are.
   subroutine begin_step(self, replaced)
      class(body_t), intent(inout) :: self
      !> kinds that the step defines anew (default: none)
      logical, intent(in), optional :: replaced(:)
      real(wp), allocatable :: force(:, :)
      logical :: anew(load_gravity)
      anew = .false.
      if (present(replaced)) anew = replaced
      call reaction(self%mesh, self%contact, self%loads, self%motion, force)
      call self%loads%begin_step(self%mesh, self%definitions, anew, force, self%motion%ux, self%motion%uy)
      self%definitions = self%definitions(:0)
   end subroutine begin_step

   !> Loads at a fraction of the step, which is also the step time.
   subroutine apply(self, fraction)
      class(body_t), intent(inout) :: self
      real(wp), intent(in) :: fraction
      call self%loads%apply(self%mesh, self%material, fraction, fraction)
   end subroutine apply

   !> Relax, and accept the state where it converged.
   subroutine relax(self, friction_work)
      class(body_t), intent(inout) :: self
      !> work against friction since the last state [force length]
      real(wp), intent(out), optional :: friction_work
      real(wp) :: work
      work = 0
      call self%relaxation%equilibrate(self%mesh, self%rows, self%contact, self%loads, self%pieces, self%motion, self%tolerance)
      if (self%relaxation%outcome == 0) call self%contact%settle(self%motion, self%relaxation%b, work)
      if (present(friction_work)) friction_work = work
   end subroutine relax

   !> The node nearest to a place.
   integer function node_at(self, x, y) result(node)
      class(body_t), intent(in) :: self
      !> [length]
      real(wp), intent(in) :: x, y
      node = minloc((self%mesh%x(1, :self%mesh%n_nodes) - x)**2 + (self%mesh%x(2, :self%mesh%n_nodes) - y)**2, 1)
   end function node_at

   !> Displacements [length], (2, nodes).
   function displacement(self) result(u)
      class(body_t), intent(in) :: self
      real(wp), allocatable :: u(:, :)
      allocate (u(2, self%mesh%n_nodes))
      u(1, :) = self%motion%ux(:self%mesh%n_nodes)
      u(2, :) = self%motion%uy(:self%mesh%n_nodes)
   end function displacement

   !> Sum of the reactions of a node set in one direction [force].
   real(wp) function total_reaction(self, set, dof) result(total)
      class(body_t), intent(in) :: self
      integer, intent(in) :: set, dof
      real(wp), allocatable :: force(:, :)
      real(wp) :: at_node(2)
      integer :: n
      call reaction(self%mesh, self%contact, self%loads, self%motion, force)
      total = 0
      do n = 1, self%mesh%n_nodes
         at_node = self%loads%at_support(force, n)
         if (self%mesh%node_in_set(n, set)) total = total + at_node(dof)
      end do
   end function total_reaction

   !> Stresses of an element, xx, yy, xy [stress].
   function stress_of(self, element) result(sigma)
      class(body_t), intent(in) :: self
      integer, intent(in) :: element
      real(wp) :: sigma(3)
      real(wp) :: g(2, 3), area
      call gradients(self%mesh%x(:, self%mesh%connectivity(:, element)), g, area)
      sigma = stress(self%material%section(self%mesh%section(element))%law, &
                     strain(g, self%motion%corner_displacements(self%mesh, element)))
   end function stress_of

   !> Largest component of stress in the body [stress].
   real(wp) function largest_stress(self) result(largest)
      class(body_t), intent(in) :: self
      integer :: e
      largest = 0
      do e = 1, self%mesh%n_elements
         largest = max(largest, maxval(abs(self%stress_of(e))))
      end do
   end function largest_stress

   !> Stiffness assembled element by element [force/length], (2 nodes, 2 nodes).
   function stiffness_matrix(self) result(k)
      class(body_t), intent(in) :: self
      real(wp), allocatable :: k(:, :)
      real(wp) :: g(2, 3), area, volume
      integer :: e, i, j, a, b, s
      allocate (k(2*self%mesh%n_nodes, 2*self%mesh%n_nodes), source=0.0_wp)
      do e = 1, self%mesh%n_elements
         call gradients(self%mesh%x(:, self%mesh%connectivity(:, e)), g, area)
         s = self%mesh%section(e)
         volume = area*self%material%section(s)%thickness*self%material%stiffness_factor(e)
         do i = 1, 3
            a = 2*self%mesh%connectivity(i, e)
            do j = 1, 3
               b = 2*self%mesh%connectivity(j, e)
               k(a - 1:a, b - 1:b) = k(a - 1:a, b - 1:b) + &
                                     volume*stiffness_block(self%material%section(s)%law, g(:, i), g(:, j))
            end do
         end do
      end do
   end function stiffness_matrix

   !> Displacements at the present loads by Cholesky's factorisation, without contact [length], (2, nodes).
   function direct_solution(self) result(u)
      class(body_t), intent(in) :: self
      real(wp), allocatable :: u(:, :)
      real(wp), allocatable :: k(:, :), right(:)
      integer :: n, dof, i
      allocate (k, source=self%stiffness_matrix())
      allocate (right(size(k, 1)))
      do n = 1, self%mesh%n_nodes
         right(2*n - 1) = self%loads%px(n)
         right(2*n) = self%loads%py(n)
      end do
      do n = 1, self%mesh%n_nodes
         do dof = 1, 2
            if (.not. self%loads%is_held(dof, n)) cycle
            i = 2*n - 2 + dof
            call hold_unknown(k, right, i, self%loads%prescribed(dof, n))
         end do
      end do
      call solve_cholesky(k, right)
      u = reshape(right, [2, self%mesh%n_nodes])
   end function direct_solution

   !> Prescribe one unknown of a symmetric system.
   subroutine hold_unknown(k, right, i, value)
      real(wp), intent(inout) :: k(:, :), right(:)
      integer, intent(in) :: i
      real(wp), intent(in) :: value
      real(wp) :: diagonal
      diagonal = k(i, i)
      right = right - k(:, i)*value
      k(:, i) = 0
      k(i, :) = 0
      k(i, i) = diagonal
      right(i) = diagonal*value
   end subroutine hold_unknown

   !> Solve a symmetric positive definite system; the matrix is overwritten.
   subroutine solve_cholesky(k, right)
      real(wp), intent(inout) :: k(:, :), right(:)
      integer :: i, j, n
      n = size(right)
      do j = 1, n
         k(j, j) = sqrt(k(j, j))
         k(j + 1:, j) = k(j + 1:, j)/k(j, j)
         do i = j + 1, n
            if (abs(k(i, j)) > 0) k(i:, i) = k(i:, i) - k(i:, j)*k(i, j)
         end do
      end do
      do j = 1, n
         right(j) = right(j)/k(j, j)
         right(j + 1:) = right(j + 1:) - k(j + 1:, j)*right(j)
      end do
      do j = n, 1, -1
         right(j) = (right(j) - dot_product(k(j + 1:, j), right(j + 1:)))/k(j, j)
      end do
   end subroutine solve_cholesky

end module rf_test_body
