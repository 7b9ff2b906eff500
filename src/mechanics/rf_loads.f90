!> Supports and loads: what each step asks for, how it follows load factor and time, and how it follows the mesh.
!>
!> Supports and nodal forces are kept per node, pressures per face (through mesh%face_tag, which every split keeps),
!> gravity per element. Without amplitude a value runs linearly from where the last step left it.
module rf_loads
   use rf_kinds, only: wp, i1, i8
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, next_corner
   use rf_renumber, only: renumbering_t, carry
   use rf_material, only: material_t
   use rf_load_share, only: face_push, corner_weight
   use rf_amplitude, only: amplitude_t
   use rf_crack_pressure, only: pressed_segments, press_segments
   implicit none
   private
   public :: loads_t, load_definition_t, ramp_t, renumber_definition
   public :: load_support, load_force, load_element_face, load_edges, load_gravity, load_crack, load_kinds

   !> kinds of definitions
   integer, parameter :: load_support = 1, load_force = 2, load_element_face = 3, load_edges = 4, load_gravity = 5, &
      load_crack = 6
   !> how many kinds there are
   integer, parameter :: load_kinds = 6

   !> How a value runs over the step.
   type :: ramp_t
      !> value at the start of the step, value asked for
      real(wp) :: from = 0, to = 0
      !> number of the amplitude, 0: linear over the step
      integer :: amplitude = 0
      !> value at the load factor and time last applied
      real(wp) :: now = 0
      !> the values are velocities of a support; only `from` is the displacement at the start of the step
      logical :: is_velocity = .false.
   end type ramp_t

   !> One data line of *BOUNDARY, *CLOAD, *DLOAD or *PRESSURE.
   type :: load_definition_t
      integer :: kind = 0
      !> step it belongs to (0: before the first)
      integer :: step = 0
      !> it acts on a set of nodes or elements, or on one (the other is 0), or on the crack of this number
      integer :: set = 0, entity = 0
      !> directions (support, force, gravity), or the face (1 to 3, by the deck's node order)
      integer :: first_dof = 0, last_dof = 0
      !> displacement [length], force [force], pressure [stress] or acceleration [length/time^2]
      real(wp) :: value = 0
      !> direction of gravity [-]
      real(wp) :: direction(2) = 0
      integer :: amplitude = 0
      !> the value of a support is a velocity [length/time]
      logical :: is_velocity = .false.
      !> pressure in a crack enters what breaks from it
      logical :: follow = .false.
   end type load_definition_t

   !> The nodal force of one definition on one node and direction.
   type :: nodal_force_t
      integer :: node = 0, dof = 0, definition = 0
      type(ramp_t) :: ramp
   end type nodal_force_t

   type :: loads_t
      !> nodal forces that act now against the internal forces K u: applied forces less those of the initial stress [force],
      !> (nodes); of size 0 as long as nothing but supports acts (acting_at)
      real(wp), allocatable :: px(:), py(:)
      !> applied nodal forces now: forces, pressures, gravity [force], (2, nodes); not allocated where there is no initial
      !> stress: then px, py are they (force_at)
      real(wp), allocatable :: applied(:, :)
      !> internal forces of the initial stress (rf_initial_stress) [force], (2, nodes); not allocated if there is none
      real(wp), allocatable :: initial(:, :)
      !> 1 where a direction is free, 0 where it is supported, (nodes)
      integer(i1), allocatable :: free_x(:), free_y(:)
      type(amplitude_t), allocatable :: amplitudes(:)
      !> how the directions of nodes with supports run, (2, supported nodes); their displacement now [length], (2, supported
      !> nodes); place of each node among them (0: it has no support), (nodes)
      type(ramp_t), allocatable :: support(:, :)
      real(wp), allocatable :: displacement(:, :)
      integer, allocatable :: place(:)
      integer :: n_supported = 0
      !> ends of the boundary edge that a node is the midpoint of (0: no such node), (2, nodes); not allocated without any
      integer, allocatable :: ends(:, :)
      integer :: n_forces = 0
      type(nodal_force_t), allocatable :: force(:)
      !> definitions that are acting, with their ramps (pressure and gravity use them; forces have their own)
      integer :: n_acting = 0
      type(load_definition_t), allocatable :: acting(:)
      type(ramp_t), allocatable :: ramp(:)
      !> tag t of a face: the acting definitions tag_member(tag_first(t):tag_first(t+1)-1) press on it
      integer :: n_tags = 0
      integer, allocatable :: tag_first(:), tag_member(:)
      logical, private :: any_gravity = .false.
      !> where in the step the forces were last summed up [-], [time] (before the first: nowhere), and how often they were
      real(wp), private :: fraction = -huge(1.0_wp), time = -huge(1.0_wp)
      integer :: sums = 0
      !> nodes that were loaded anew by the last split alone, ascending
      integer :: n_touched = 0
      integer, allocatable :: touched(:)
   contains
      procedure :: prepare, know_faces, begin_step, apply, apply_supports, apply_forces, gather, adopt, renumber, add_falling
      procedure :: follow, is_held, forces_vary, support_at, prescribed, at_support, scale, force_at, acting_at
      procedure :: any_force, keep_forces
      procedure, private :: act, drop, acting_index, join, release, spread, tag_faces, new_tag, press_exposed, wake_faces
      procedure, private :: add_nodal_forces, add_pressures, add_gravity
      procedure, private :: value_at, pressure_of
      procedure, private, nopass :: acts_on_element
      procedure :: exchange
   end type loads_t

   interface
      !> To or from a checkpoint.
      module subroutine exchange(self, archive)
         class(loads_t), intent(inout) :: self
         class(archive_t), intent(inout) :: archive
      end subroutine exchange

      !> Share the loads anew after a split (after adopt): what `apply` would do, at the cost of what the split touched.
      module subroutine follow(self, mesh, material, changes, fraction, time)
         class(loads_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         type(changes_t), intent(in) :: changes
         !> part of the step that is done [-], step time [time]
         real(wp), intent(in) :: fraction, time
      end subroutine follow
   end interface

contains

   !> A body without supports and loads.
   subroutine prepare(self, n_nodes)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      call reserve_nodes(self, n_nodes)
      allocate (self%force(0))
      call start_lists(self)
      if (.not. allocated(self%amplitudes)) allocate (self%amplitudes(0))
   end subroutine prepare

   !> Lists of what acts, empty unless know_faces has begun them.
   subroutine start_lists(self)
      class(loads_t), intent(inout) :: self
      if (allocated(self%acting)) return
      allocate (self%acting(0), self%ramp(0), self%tag_member(0))
      self%tag_first = [1]
   end subroutine start_lists

   subroutine reserve_nodes(self, n)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: n
      integer :: old
      old = 0
      if (allocated(self%free_x)) old = size(self%free_x)
      if (old >= n) return
      if (.not. allocated(self%px)) allocate (self%px(0), self%py(0))
      if (size(self%px) > 0) call grow(self%px, n)
      if (size(self%py) > 0) call grow(self%py, n)
      call grow(self%free_x, n)
      call grow(self%free_y, n)
      call grow(self%place, n)
      if (allocated(self%applied)) call grow(self%applied, n, 2)
      if (allocated(self%ends)) call grow(self%ends, n, 2)
      if (.not. allocated(self%support)) allocate (self%support(2, 0), self%displacement(2, 0))
      self%free_x(old + 1:) = 1_i1
      self%free_y(old + 1:) = 1_i1
   end subroutine reserve_nodes

   !> A place among the supports for a node that has none: its directions stay where they are.
   subroutine take_place(self, node, displacement)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: node
      !> where the node is [length]
      real(wp), intent(in) :: displacement(2)
      type(ramp_t), allocatable :: larger(:, :)
      if (self%place(node) > 0) return
      if (self%n_supported == size(self%support, 2)) then
         allocate (larger(2, 2*self%n_supported + 8))
         larger(:, :self%n_supported) = self%support(:, :self%n_supported)
         call move_alloc(larger, self%support)
      end if
      self%n_supported = self%n_supported + 1
      call grow(self%displacement, self%n_supported, 2)
      self%place(node) = self%n_supported
      self%support(1, self%n_supported) = held_at(displacement(1))
      self%support(2, self%n_supported) = held_at(displacement(2))
   end subroutine take_place

   !> Force applied to a node now [force].
   pure function force_at(self, node) result(force)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: node
      real(wp) :: force(2)
      if (allocated(self%applied)) then
         force = self%applied(:, node)
      else
         force = self%acting_at(node)
      end if
   end function force_at

   !> Force that acts on a node now against its internal force [force].
   pure function acting_at(self, node) result(force)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: node
      real(wp) :: force(2)
      force = 0
      if (size(self%px) > 0) force = [self%px(node), self%py(node)]
   end function acting_at

   !> Keep the force on every node from now on, zero or not.
   subroutine keep_forces(self)
      class(loads_t), intent(inout) :: self
      call grow(self%px, size(self%free_x))
      call grow(self%py, size(self%free_x))
   end subroutine keep_forces

   !> Whether anything but supports acts, or has acted.
   pure logical function any_force(self)
      class(loads_t), intent(in) :: self
      any_force = self%n_forces > 0 .or. self%n_acting > 0 .or. allocated(self%initial)
   end function any_force

   !> Ends of the boundary edge that a node is the midpoint of; 0 if it is none.
   pure function ends_of(self, node) result(ends)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: node
      integer :: ends(2)
      ends = 0
      if (allocated(self%ends)) ends = self%ends(:, node)
   end function ends_of

   !> Whether a direction of a node is supported.
   pure logical function is_held(self, dof, node)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: dof, node
      is_held = merge(self%free_x(node), self%free_y(node), dof == 1) == 0_i1
   end function is_held

   !> Start a step: everything that acts goes on from its present value; the step's definitions replace or join it.
   subroutine begin_step(self, mesh, definitions, replaced, reaction, ux, uy)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> definitions of this step, in the deck's order
      type(load_definition_t), intent(in) :: definitions(:)
      !> kinds for which the step says OP=NEW: what it does not name is dropped, (load_gravity)
      logical, intent(in) :: replaced(:)
      !> reactions of the supports now [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      !> displacements now [length], (nodes): where a new support takes hold
      real(wp), intent(in) :: ux(:), uy(:)
      integer :: i, n, d
      do n = 1, mesh%n_nodes
         if (self%place(n) == 0) cycle
         associate (support => self%support(:, self%place(n)))
            support(1) = going_on(support(1), self%is_held(1, n), merge(self%prescribed(1, n), ux(n), self%is_held(1, n)))
            support(2) = going_on(support(2), self%is_held(2, n), merge(self%prescribed(2, n), uy(n), self%is_held(2, n)))
         end associate
      end do
      do i = 1, self%n_forces
         self%force(i)%ramp = held_at(self%force(i)%ramp%now)
         if (self%force(i)%definition == 0) self%force(i)%ramp%to = 0      ! what a released support still bears goes on falling
      end do
      do d = 1, self%n_acting
         self%ramp(d) = held_at(self%ramp(d)%now)
      end do
      if (replaced(load_support)) call self%release(mesh, definitions, reaction)
      call self%drop(replaced)
      call self%wake_faces(mesh)
      do i = 1, size(definitions)
         call self%act(mesh, definitions(i), ux, uy)
      end do
      if (allocated(self%ends)) call support_midpoints(self, mesh, ux, uy)
      self%any_gravity = any(self%acting(:self%n_acting)%kind == load_gravity)
   end subroutine begin_step

   !> A ramp that stays where it is.
   pure type(ramp_t) function held_at(value)
      real(wp), intent(in) :: value
      held_at = ramp_t(value, value, 0, value)
   end function held_at

   !> A support at the start of a step: it stays where it is, or keeps its last velocity.
   pure type(ramp_t) function going_on(last, held, displacement)
      type(ramp_t), intent(in) :: last
      logical, intent(in) :: held
      !> where the node is [length]
      real(wp), intent(in) :: displacement
      going_on = held_at(displacement)
      if (held .and. last%is_velocity) going_on = ramp_t(displacement, last%now, 0, last%now, .true.)
   end function going_on

   !> OP=NEW for supports: those that the step does not name let go, their reactions fall linearly to zero.
   subroutine release(self, mesh, definitions, reaction)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(load_definition_t), intent(in) :: definitions(:)
      real(wp), intent(in) :: reaction(:, :)
      real(wp) :: borne(2)
      integer :: n, dof
      do n = 1, mesh%n_nodes
         borne = self%at_support(reaction, n)
         do dof = 1, 2
            if (.not. self%is_held(dof, n)) cycle
            if (is_named(self, definitions, mesh, n, dof)) cycle
            if (dof == 1) self%free_x(n) = 1_i1
            if (dof == 2) self%free_y(n) = 1_i1
            call add_force(self, nodal_force_t(n, dof, 0, ramp_t(borne(dof), 0.0_wp, 0, borne(dof))))
         end do
      end do
   end subroutine release

   !> Whether supports name a direction of a node: the node itself, or both ends of the boundary edge it is the middle of.
   pure recursive logical function is_named(self, definitions, mesh, node, dof) result(named)
      type(loads_t), intent(in) :: self
      type(load_definition_t), intent(in) :: definitions(:)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, dof
      integer :: i, ends(2)
      named = .false.
      do i = 1, size(definitions)
         if (definitions(i)%kind == load_support .and. dof >= definitions(i)%first_dof .and. dof <= definitions(i)%last_dof) &
            named = named .or. acts_on_node(definitions(i), mesh, node)
      end do
      ends = ends_of(self, node)
      if (named .or. ends(1) == 0) return
      named = is_named(self, definitions, mesh, ends(1), dof)
      if (named) named = is_named(self, definitions, mesh, ends(2), dof)
   end function is_named

   !> Midpoints of boundary edges are held where both ends are, between them: by their place, for those that cracks from the
   !> start made lie anywhere. They are taken in order of creation (their rank), so that ends that are midpoints themselves
   !> have been seen to.
   subroutine support_midpoints(self, mesh, ux, uy)
      type(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> displacements now [length], (nodes)
      real(wp), intent(in) :: ux(:), uy(:)
      integer, allocatable :: middle(:)
      integer :: i, n, dof, p, a, b
      real(wp) :: part
      middle = pack([(n, n=1, mesh%n_nodes)], self%ends(1, :mesh%n_nodes) > 0)
      middle = middle(sorted_order(int(mesh%node_rank(middle), i8)))
      do i = 1, size(middle)
         n = middle(i)
         part = part_between(mesh, n, self%ends(:, n))
         do dof = 1, 2
            if (.not. (self%is_held(dof, self%ends(1, n)) .and. self%is_held(dof, self%ends(2, n)))) cycle
            call take_place(self, n, [ux(n), uy(n)])
            p = self%place(n)
            a = self%place(self%ends(1, n))
            b = self%place(self%ends(2, n))
            self%support(dof, p)%to = (1 - part)*self%support(dof, a)%to + part*self%support(dof, b)%to
            self%support(dof, p)%amplitude = self%support(dof, a)%amplitude
            self%support(dof, p)%is_velocity = self%support(dof, a)%is_velocity
            if (dof == 1) self%free_x(n) = 0_i1
            if (dof == 2) self%free_y(n) = 0_i1
         end do
      end do
   end subroutine support_midpoints

   !> How far a node lies from the first to the second end of its edge [-]; a half, without rounding, in the middle.
   pure real(wp) function part_between(mesh, node, ends) result(part)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node, ends(2)
      real(wp) :: edge(2)
      part = 0.5_wp
      if (.not. any(abs(mesh%x(:, node) - 0.5_wp*(mesh%x(:, ends(1)) + mesh%x(:, ends(2)))) > 0)) return
      edge = mesh%x(:, ends(2)) - mesh%x(:, ends(1))
      part = dot_product(mesh%x(:, node) - mesh%x(:, ends(1)), edge)/dot_product(edge, edge)
   end function part_between

   !> OP=NEW for loads: all that acted falls to zero, unless a definition takes it up again.
   subroutine drop(self, replaced)
      class(loads_t), intent(inout) :: self
      logical, intent(in) :: replaced(:)
      integer :: i
      do i = 1, self%n_acting
         if (replaced(self%acting(i)%kind)) self%ramp(i)%to = 0
      end do
      do i = 1, self%n_forces
         if (replaced(load_force)) self%force(i)%ramp%to = 0
      end do
   end subroutine drop

   !> Whether a definition means a node: by its set, or as the node it names or one of that node's copies.
   pure logical function acts_on_node(definition, mesh, node)
      type(load_definition_t), intent(in) :: definition
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      acts_on_node = mesh%node_in_set(node, definition%set)
      if (definition%entity > 0) acts_on_node = mesh%origin_of_node(node) == mesh%origin_of_node(definition%entity)
   end function acts_on_node

   !> Whether a definition means an element: by its set, or as the element it names or one cut from that.
   pure logical function acts_on_element(definition, mesh, element)
      type(load_definition_t), intent(in) :: definition
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      acts_on_element = mesh%element_in_set(element, definition%set)
      if (definition%entity > 0) acts_on_element = mesh%origin_of_element(element) == mesh%origin_of_element(definition%entity)
   end function acts_on_element

   !> Nodes or elements among which those are that a definition means: the one it names, as long as there is only one of each.
   pure subroutine in_question(entity, any_copies, n, first, last)
      !> number of the node or element, 0: the definition means a set
      integer, intent(in) :: entity
      !> splitting has made copies or children
      logical, intent(in) :: any_copies
      !> how many nodes or elements there are; the first and the last of those in question
      integer, intent(in) :: n
      integer, intent(out) :: first, last
      first = 1
      last = n
      if (entity == 0 .or. any_copies) return
      first = entity
      last = entity
   end subroutine in_question

   !> Let a definition act: it takes the place of those with the same target, or joins.
   subroutine act(self, mesh, definition, ux, uy)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      type(load_definition_t), intent(in) :: definition
      !> displacements now [length], (nodes)
      real(wp), intent(in) :: ux(:), uy(:)
      integer :: d, n, dof, i, first, last
      logical :: is_new
      if (definition%kind == load_support) then
         call in_question(definition%entity, allocated(mesh%node_origin), mesh%n_nodes, first, last)
         do n = first, last
            if (.not. acts_on_node(definition, mesh, n)) cycle
            call take_place(self, n, [ux(n), uy(n)])
            do dof = definition%first_dof, definition%last_dof
               self%support(dof, self%place(n))%to = definition%value
               self%support(dof, self%place(n))%amplitude = definition%amplitude
               self%support(dof, self%place(n))%is_velocity = definition%is_velocity
               if (dof == 1) self%free_x(n) = 0_i1
               if (dof == 2) self%free_y(n) = 0_i1
            end do
         end do
         return
      end if
      call self%acting_index(definition, d, is_new)
      if (is_new) call self%spread(mesh, d)
      if (definition%kind == load_edges .and. .not. is_new) call self%press_exposed(mesh, definition)
      do i = d, self%n_acting
         if (.not. same_target(self%acting(i), definition)) cycle
         self%ramp(i)%to = definition%value
         self%ramp(i)%amplitude = definition%amplitude
         self%acting(i)%direction = definition%direction
         self%acting(i)%follow = definition%follow
      end do
      do i = 1, self%n_forces
         if (self%force(i)%definition /= d) cycle
         self%force(i)%ramp%to = definition%value*force_share(mesh, self%force(i)%node, definition)
         self%force(i)%ramp%amplitude = definition%amplitude
      end do
   end subroutine act

   !> The first place of a definition among those that act; a new one joins them.
   subroutine acting_index(self, definition, d, is_new)
      class(loads_t), intent(inout) :: self
      type(load_definition_t), intent(in) :: definition
      integer, intent(out) :: d
      !> none with that target was acting
      logical, intent(out) :: is_new
      do d = 1, self%n_acting
         if (same_target(self%acting(d), definition)) exit
      end do
      is_new = d > self%n_acting
      if (is_new) call self%join(definition)
   end subroutine acting_index

   !> One more definition that acts, with the value 0.
   subroutine join(self, definition)
      class(loads_t), intent(inout) :: self
      type(load_definition_t), intent(in) :: definition
      type(load_definition_t), allocatable :: acting(:)
      type(ramp_t), allocatable :: ramp(:)
      integer :: d
      d = self%n_acting + 1
      if (d > size(self%acting)) then
         allocate (acting(2*d), ramp(2*d))
         acting(:d - 1) = self%acting(:d - 1)
         ramp(:d - 1) = self%ramp(:d - 1)
         call move_alloc(acting, self%acting)
         call move_alloc(ramp, self%ramp)
      end if
      self%n_acting = d
      self%acting(d) = definition
      self%ramp(d) = ramp_t()
   end subroutine join

   !> A pressure on a set is stated again: where the boundary has edges of the set that it does not press on yet (others were
   !> taken out of the body), it begins there with the value 0.
   subroutine press_exposed(self, mesh, definition)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      type(load_definition_t), intent(in) :: definition
      logical, allocatable :: pressed(:)
      integer :: t, i
      allocate (pressed(0:self%n_tags), source=.false.)
      do t = 1, self%n_tags
         do i = self%tag_first(t), self%tag_first(t + 1) - 1
            pressed(t) = pressed(t) .or. same_target(self%acting(self%tag_member(i)), definition)
         end do
      end do
      if (.not. exposed()) return
      call self%join(definition)
      call self%tag_faces(mesh, self%n_acting, but_not=pressed)

   contains

      !> Whether there is such an edge.
      logical function exposed()
         integer :: e, k
         exposed = .true.
         do e = 1, mesh%n_elements
            do k = 1, 3
               if (mesh%neighbour(k, e) /= 0) cycle
               if (pressed(mesh%tag_at(k, e))) cycle
               if (has_both_ends(mesh, k, e, definition%set)) return
            end do
         end do
         exposed = .false.
      end function exposed

   end subroutine press_exposed

   !> Whether an edge has both ends in a node set.
   pure logical function has_both_ends(mesh, k, e, set)
      type(mesh_t), intent(in) :: mesh
      !> edge, element
      integer, intent(in) :: k, e, set
      has_both_ends = mesh%node_in_set(mesh%connectivity(k, e), set) .and. &
                      mesh%node_in_set(mesh%connectivity(next_corner(k), e), set)
   end function has_both_ends

   !> Faces that now lie on the boundary bear what will press on them by name. Crack faces sleep on.
   subroutine wake_faces(self, mesh)
      class(loads_t), intent(in) :: self
      type(mesh_t), intent(inout) :: mesh
      if (self%n_tags == 0) return
      associate (tag => mesh%face_tag(:, :mesh%n_elements), neighbour => mesh%neighbour(:, :mesh%n_elements))
         where (neighbour == 0) tag = abs(tag)
      end associate
   end subroutine wake_faces

   !> Find the element faces that the definitions of any step press on, before anything splits: while P1 to P3 mean what
   !> the user's node order says. From then on the faces carry their tags through every split; a face inside the body, which
   !> an excavation is to expose, carries the tag with a minus sign: it sleeps. Before or after prepare.
   subroutine know_faces(self, mesh, definitions, turned)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      !> of all steps
      type(load_definition_t), intent(in) :: definitions(:)
      !> the deck's element was clockwise: its corners 2 and 3 are exchanged, (elements)
      logical, intent(in) :: turned(:)
      integer :: i, d
      logical :: is_new
      call start_lists(self)
      do i = 1, size(definitions)
         if (definitions(i)%kind /= load_element_face) cycle
         call self%acting_index(definitions(i), d, is_new)
         if (is_new) call self%tag_faces(mesh, d, turned)
      end do
   end subroutine know_faces

   !> Part of the value that a node gets: copies of a deck node share it; a node named by itself takes part likewise.
   pure real(wp) function force_share(mesh, node, definition)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      type(load_definition_t), intent(in) :: definition
      force_share = 1
      if (definition%kind == load_force) force_share = mesh%share_of(node)
   end function force_share

   pure logical function same_target(a, b)
      type(load_definition_t), intent(in) :: a, b
      same_target = a%kind == b%kind .and. a%set == b%set .and. a%entity == b%entity .and. &
                    a%first_dof == b%first_dof .and. a%last_dof == b%last_dof
   end function same_target

   !> Find the nodes or faces of a new definition.
   subroutine spread(self, mesh, d)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: d
      integer :: n, first, last
      select case (self%acting(d)%kind)
      case (load_force)
         call in_question(self%acting(d)%entity, allocated(mesh%node_origin), mesh%n_nodes, first, last)
         do n = first, last
            if (acts_on_node(self%acting(d), mesh, n)) &
               call add_force(self, nodal_force_t(n, self%acting(d)%first_dof, d, ramp_t()))
         end do
      case (load_element_face, load_edges)
         call self%tag_faces(mesh, d)
      end select
   end subroutine spread

   subroutine add_force(self, force)
      class(loads_t), intent(inout) :: self
      type(nodal_force_t), intent(in) :: force
      type(nodal_force_t), allocatable :: larger(:)
      if (self%n_forces == size(self%force)) then
         allocate (larger(2*self%n_forces + 8))
         larger(:self%n_forces) = self%force
         call move_alloc(larger, self%force)
      end if
      self%n_forces = self%n_forces + 1
      self%force(self%n_forces) = force
   end subroutine add_force

   !> Tag the faces that a pressure acts on: edges of the boundary between nodes of a set, faces of elements anywhere.
   subroutine tag_faces(self, mesh, d, turned, but_not)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(inout) :: mesh
      integer, intent(in) :: d
      !> as in know_faces
      logical, intent(in), optional :: turned(:)
      !> faces with these tags are left as they are, (0:tags)
      logical, intent(in), optional :: but_not(0:)
      integer :: e, k, face, first, last
      logical :: hit
      call in_question(self%acting(d)%entity, allocated(mesh%element_origin), mesh%n_elements, first, last)
      do e = first, last
         do k = 1, 3
            if (self%acting(d)%kind == load_edges) then
               if (mesh%neighbour(k, e) /= 0) cycle
               if (present(but_not)) then
                  if (but_not(mesh%tag_at(k, e))) cycle
               end if
               hit = has_both_ends(mesh, k, e, self%acting(d)%set)
            else
               face = k
               if (present(turned)) face = merge(4 - k, k, turned(e))
               hit = face == self%acting(d)%first_dof .and. acts_on_element(self%acting(d), mesh, e)
            end if
            if (.not. hit) cycle
            call mesh%keep_tags()
            mesh%face_tag(k, e) = self%new_tag(abs(mesh%face_tag(k, e)), d)
            if (mesh%neighbour(k, e) /= 0) mesh%face_tag(k, e) = -mesh%face_tag(k, e)
         end do
      end do
   end subroutine tag_faces

   !> The tag of the faces that carry what tag `old` carries, and definition d.
   integer function new_tag(self, old, d) result(tag)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: old, d
      integer, allocatable :: members(:)
      allocate (members(0))
      if (old > 0) members = self%tag_member(self%tag_first(old):self%tag_first(old + 1) - 1)
      members = [members, d]
      do tag = 1, self%n_tags
         if (self%tag_first(tag + 1) - self%tag_first(tag) /= size(members)) cycle
         if (all(self%tag_member(self%tag_first(tag):self%tag_first(tag + 1) - 1) == members)) return
      end do
      self%n_tags = tag
      self%tag_member = [self%tag_member, members]
      self%tag_first = [self%tag_first, size(self%tag_member) + 1]
   end function new_tag

   !> Size of the loads: the larger of the 2-norms of applied forces and of those of the initial stress, which balance each
   !> other in an undisturbed rock (theory: eq. 13) [force].
   pure real(wp) function scale(self, n_nodes)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: n_nodes
      scale = 0
      if (size(self%px) == 0) return
      if (.not. allocated(self%applied)) then
         scale = sqrt(dot_product(self%px(:n_nodes), self%px(:n_nodes)) + dot_product(self%py(:n_nodes), self%py(:n_nodes)))
         return
      end if
      scale = sqrt(dot_product(self%applied(1, :n_nodes), self%applied(1, :n_nodes)) &
                   + dot_product(self%applied(2, :n_nodes), self%applied(2, :n_nodes)))
      scale = max(scale, norm2(self%initial(:, :n_nodes)))
   end function scale

   !> Value of a ramp.
   pure real(wp) function value_at(self, ramp, fraction, time)
      class(loads_t), intent(in) :: self
      type(ramp_t), intent(in) :: ramp
      real(wp), intent(in) :: fraction, time
      if (ramp%is_velocity) then
         value_at = ramp%from + ramp%to*time
         if (ramp%amplitude > 0) value_at = ramp%from + ramp%to*self%amplitudes(ramp%amplitude)%integral(time)
      else if (ramp%amplitude > 0) then
         value_at = ramp%to*self%amplitudes(ramp%amplitude)%at(time)
      else
         value_at = ramp%from + (ramp%to - ramp%from)*fraction
      end if
   end function value_at

   !> Applied forces, those of the initial stress, and prescribed displacements at a fraction of the step.
   subroutine apply(self, mesh, material, fraction, time)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> part of the step that is done [-], step time [time]
      real(wp), intent(in) :: fraction, time
      call self%apply_supports(mesh%n_nodes, fraction, time)
      call self%apply_forces(mesh, material, fraction, time)
   end subroutine apply

   !> Displacements of supports at a fraction of the step.
   subroutine apply_supports(self, n_nodes, fraction, time)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      !> part of the step that is done [-], step time [time]
      real(wp), intent(in) :: fraction, time
      integer :: n, dof
      do n = 1, n_nodes
         if (self%place(n) == 0) cycle
         do dof = 1, 2
            associate (ramp => self%support(dof, self%place(n)))
               if (self%is_held(dof, n)) self%displacement(dof, self%place(n)) = value_at(self, ramp, fraction, time)
               if (.not. ramp%is_velocity) cycle
               ramp%now = ramp%to
               if (ramp%amplitude > 0) ramp%now = ramp%to*self%amplitudes(ramp%amplitude)%at(time)
            end associate
         end do
      end do
   end subroutine apply_supports

   !> Displacement of a support at a fraction of the step [length].
   pure real(wp) function support_at(self, dof, node, fraction, time)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: dof, node
      !> part of the step that is done [-], step time [time]
      real(wp), intent(in) :: fraction, time
      support_at = value_at(self, self%support(dof, self%place(node)), fraction, time)
   end function support_at

   !> Displacement of a supported direction now [length].
   pure real(wp) function prescribed(self, dof, node)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: dof, node
      prescribed = self%displacement(dof, self%place(node))
   end function prescribed

   !> What a node has of a property of supports; zero where it has no support, or one that the property does not know yet.
   pure function at_support(self, values, node) result(value)
      class(loads_t), intent(in) :: self
      !> the property, (2, supported nodes)
      real(wp), intent(in) :: values(:, :)
      integer, intent(in) :: node
      real(wp) :: value(2)
      value = 0
      associate (place => self%place(node))
         if (place > 0 .and. place <= size(values, 2)) value = values(:, place)
      end associate
   end function at_support

   !> Applied forces at a fraction of the step.
   subroutine apply_forces(self, mesh, material, fraction, time)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> part of the step that is done [-], step time [time]
      real(wp), intent(in) :: fraction, time
      integer :: d, i
      do i = 1, self%n_forces
         self%force(i)%ramp%now = value_at(self, self%force(i)%ramp, fraction, time)
      end do
      do d = 1, self%n_acting
         self%ramp(d)%now = value_at(self, self%ramp(d), fraction, time)
      end do
      call self%gather(mesh, material)
      self%fraction = fraction
      self%time = time
   end subroutine apply_forces

   !> Sum up what acts, at its present values.
   subroutine gather(self, mesh, material)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      self%sums = self%sums + 1
      self%fraction = -huge(1.0_wp)
      if (self%any_force()) call self%keep_forces()
      if (size(self%px) == 0) return
      self%px(:mesh%n_nodes) = 0
      self%py(:mesh%n_nodes) = 0
      call self%add_nodal_forces()
      if (self%n_tags > 0) call self%add_pressures(mesh, material)
      if (self%any_gravity) call self%add_gravity(mesh, material)
      call add_crack_pressures(self, mesh, material)
      if (.not. allocated(self%initial)) return
      call grow(self%applied, size(self%px), 2)
      self%applied(1, :mesh%n_nodes) = self%px(:mesh%n_nodes)
      self%applied(2, :mesh%n_nodes) = self%py(:mesh%n_nodes)
      self%px(:mesh%n_nodes) = self%px(:mesh%n_nodes) - self%initial(1, :mesh%n_nodes)
      self%py(:mesh%n_nodes) = self%py(:mesh%n_nodes) - self%initial(2, :mesh%n_nodes)
   end subroutine gather

   !> Whether applied forces change with time when values without amplitude apply at once.
   pure logical function forces_vary(self)
      class(loads_t), intent(in) :: self
      forces_vary = any(self%ramp(:self%n_acting)%amplitude > 0) .or. any(self%force(:self%n_forces)%ramp%amplitude > 0)
   end function forces_vary

   !> Pressure in cracks, on the faces that they have now.
   subroutine add_crack_pressures(self, mesh, material)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      logical, allocatable :: pressed(:)
      integer :: d
      do d = 1, self%n_acting
         if (self%acting(d)%kind /= load_crack) cycle
         call pressed_segments(mesh, self%acting(d)%entity, self%acting(d)%follow, pressed)
         call press_segments(mesh, material, pressed, self%ramp(d)%now, self%px, self%py)
      end do
   end subroutine add_crack_pressures

   subroutine add_nodal_forces(self)
      class(loads_t), intent(inout) :: self
      integer :: i, n
      real(wp) :: f
      do i = 1, self%n_forces
         n = self%force(i)%node
         f = self%force(i)%ramp%now
         if (self%force(i)%dof == 1) self%px(n) = self%px(n) + f
         if (self%force(i)%dof == 2) self%py(n) = self%py(n) + f
      end do
   end subroutine add_nodal_forces

   !> Pressure pushes on the face from outside: half of it at each end.
   subroutine add_pressures(self, mesh, material)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      real(wp) :: pressure(self%n_tags), push(2)
      integer :: e, k, t, ends(2)
      do t = 1, self%n_tags
         pressure(t) = pressure_of(self, t)
      end do
      do e = 1, mesh%n_elements
         do k = 1, 3
            t = mesh%tag_at(k, e)
            if (t <= 0) cycle
            ends = mesh%connectivity([k, next_corner(k)], e)
            push = face_push(mesh, material, pressure(t), e, ends)
            self%px(ends) = self%px(ends) + push(1)
            self%py(ends) = self%py(ends) + push(2)
         end do
      end do
   end subroutine add_pressures

   !> Pressure on the faces with a tag now [stress].
   pure real(wp) function pressure_of(self, tag) result(pressure)
      class(loads_t), intent(in) :: self
      integer, intent(in) :: tag
      integer :: i
      pressure = 0
      do i = self%tag_first(tag), self%tag_first(tag + 1) - 1
         pressure = pressure + self%ramp(self%tag_member(i))%now
      end do
   end function pressure_of

   !> Gravity: a third of an element's weight at each corner.
   subroutine add_gravity(self, mesh, material)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      real(wp) :: weight(2)
      integer :: d, e
      do d = 1, self%n_acting
         if (self%acting(d)%kind /= load_gravity) cycle
         do e = 1, mesh%n_elements
            if (.not. acts_on_element(self%acting(d), mesh, e)) cycle
            weight = corner_weight(mesh, material, self%ramp(d)%now, self%acting(d)%direction, e)
            associate (corner => mesh%connectivity(:, e))
               self%px(corner) = self%px(corner) + weight(1)
               self%py(corner) = self%py(corner) + weight(2)
            end associate
         end do
      end do
   end subroutine add_gravity

   !> Loads follow a split: copies keep the supports of their node and share its forces; a midpoint of a boundary edge
   !> is supported where both ends are.
   subroutine adopt(self, changes)
      class(loads_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer :: i, n, a, b, dof
      logical :: held, bears
      real(wp) :: between(2)
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         call reserve_nodes(self, n)
         call inherit_ends(self, n, [a, b], changes%on_boundary(i))
         bears = self%place(a) > 0
         if (b > 0) bears = bears .and. changes%on_boundary(i) .and. self%place(max(1, b)) > 0
         if (bears) then
            call take_place(self, n, [0.0_wp, 0.0_wp])
            between = self%displacement(:, self%place(a))
            if (b > 0) between = 0.5_wp*(between + self%displacement(:, self%place(b)))
            self%displacement(:, self%place(n)) = between
         end if
         do dof = 1, 2
            held = bears .and. self%is_held(dof, a)
            if (bears) self%support(dof, self%place(n)) = self%support(dof, self%place(a))
            if (b > 0) then
               if (held) held = self%is_held(dof, b)
               if (held) self%support(dof, self%place(n)) = mean_ramp(self%support(dof, self%place(a)), &
                                                                      self%support(dof, self%place(b)))
            end if
            if (dof == 1) self%free_x(n) = merge(0_i1, 1_i1, held)
            if (dof == 2) self%free_y(n) = merge(0_i1, 1_i1, held)
         end do
      end do
      do i = 1, changes%n_nodes
         if (changes%parent(2, i) == 0) call share_forces(self, changes, i)
      end do
   end subroutine adopt

   !> A copy lies on the boundary edge that its node is the midpoint of; a midpoint of one remembers its ends.
   subroutine inherit_ends(self, node, parent, on_boundary)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: node, parent(2)
      logical, intent(in) :: on_boundary
      if (parent(2) > 0 .and. on_boundary) call grow(self%ends, size(self%place), 2)
      if (.not. allocated(self%ends)) return
      self%ends(:, node) = self%ends(:, parent(1))
      if (parent(2) > 0) self%ends(:, node) = merge(parent, 0, on_boundary)
   end subroutine inherit_ends

   !> Follow new numbers: forces on nodes that are gone go with them, and what means one node or element means its deputy.
   subroutine renumber(self, map)
      class(loads_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      integer :: i, n, d
      if (size(self%px) > 0) call carry(self%px, map%node_from)
      if (size(self%py) > 0) call carry(self%py, map%node_from)
      call carry(self%applied, map%node_from)
      call carry(self%initial, map%node_from)
      call carry(self%free_x, map%node_from)
      call carry(self%free_y, map%node_from)
      call carry(self%ends, map%node_from)
      call carry(self%place, map%node_from)
      do n = 1, size(self%place)                ! of nodes that are gone there may be places without a node
         if (n > map%n_nodes) self%place(n) = 0
         if (n > map%n_nodes .or. .not. allocated(self%ends)) cycle
         if (self%ends(1, n) == 0) cycle
         self%ends(:, n) = map%node(self%ends(:, n))
         if (any(self%ends(:, n) == 0)) self%ends(:, n) = 0
      end do
      n = 0
      do i = 1, self%n_forces
         if (map%node(self%force(i)%node) == 0) cycle
         n = n + 1
         self%force(n) = self%force(i)
         self%force(n)%node = map%node(self%force(n)%node)
      end do
      self%n_forces = n
      self%n_touched = 0
      do d = 1, self%n_acting
         call renumber_definition(self%acting(d), map)
      end do
   end subroutine renumber

   !> What a definition that names one node or element means in new numbers; nothing if all of it is gone.
   pure elemental subroutine renumber_definition(definition, map)
      type(load_definition_t), intent(inout) :: definition
      type(renumbering_t), intent(in) :: map
      if (definition%entity == 0) return
      select case (definition%kind)
      case (load_support, load_force)
         definition%entity = map%node_deputy(definition%entity)
      case (load_crack)      ! cracks keep their numbers
      case default
         definition%entity = map%element_deputy(definition%entity)
      end select
   end subroutine renumber_definition

   !> A force that is there now and falls to zero linearly over the step that begins next.
   subroutine add_falling(self, node, dof, value)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: node, dof
      !> [force]
      real(wp), intent(in) :: value
      call add_force(self, nodal_force_t(node, dof, 0, ramp_t(value, 0.0_wp, 0, value)))
   end subroutine add_falling

   pure type(ramp_t) function mean_ramp(a, b)
      type(ramp_t), intent(in) :: a, b
      mean_ramp = ramp_t(0.5_wp*(a%from + b%from), 0.5_wp*(a%to + b%to), a%amplitude, is_velocity=a%is_velocity)
   end function mean_ramp

   !> Forces of a node that was copied: the first of its copies in the list divides them among all.
   subroutine share_forces(self, changes, which)
      class(loads_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer, intent(in) :: which
      integer :: i, j, origin, copies, n
      type(nodal_force_t) :: force
      if (self%n_forces == 0) return
      origin = changes%parent(1, which)
      copies = 1
      do i = 1, changes%n_nodes
         if (changes%parent(1, i) /= origin .or. changes%parent(2, i) /= 0) cycle
         if (i < which) return
         copies = copies + 1
      end do
      n = self%n_forces
      do j = 1, n
         if (self%force(j)%node /= origin) cycle
         self%force(j)%ramp%from = self%force(j)%ramp%from/copies
         self%force(j)%ramp%to = self%force(j)%ramp%to/copies
         self%force(j)%ramp%now = self%force(j)%ramp%now/copies
         do i = which, changes%n_nodes
            if (changes%parent(1, i) /= origin .or. changes%parent(2, i) /= 0) cycle
            force = self%force(j)
            force%node = changes%node(i)
            call add_force(self, force)
         end do
      end do
   end subroutine share_forces

end module rf_loads
