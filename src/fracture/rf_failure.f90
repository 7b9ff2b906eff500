!> Where the body fails next: utilisation of elements and nodes, the node with the largest, and the split that follows
!> from it. Reads the mesh, never changes it.
module rf_failure
   use rf_kinds, only: wp, i1
   use rf_clock, only: stopwatch_t
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_renumber, only: renumbering_t, carry
   use rf_topology, only: changes_t, side_nodes, elements_around
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_stress_k, only: element_stresses, spread_largest
   use rf_criterion, only: strength_t, principal, max_rays, mode_none, mode_tension
   use rf_criteria, only: criterion_item_t
   use rf_recovery, only: patch_work_t, node_stress, materials_at_node
   use rf_ray, only: split_t, choose_split, split_limits_t
   implicit none
   private
   public :: failure_t, fracture_settings_t
   public :: splitting_element, splitting_none, splitting_edge, select_worst, select_separated, select_all

   !> what *FRACTURE, SPLITTING= may say
   integer, parameter :: splitting_none = 0, splitting_element = 1, splitting_edge = 2
   !> what *FRACTURE, SELECT= may say: the nodes that split together, before the body is relaxed again
   integer, parameter :: select_worst = 1, select_separated = 2, select_all = 3
   !> part of the largest screen value from which the node's patch is fitted
   real(wp), parameter :: screen_margin = 0.7_wp
   !> ratio of the stress intensities of shear and opening over that of the mean stresses round a tip: the mean of the
   !> singular field over a circle is 0.76 K_I across the crack and 0.51 K_II along it
   real(wp), parameter :: mean_ratio = 1.5_wp
   !> utilisations closer than this tie
   real(wp), parameter :: tie = 1.0e-6_wp
   !> materials that may meet at one node
   integer, parameter :: max_materials = 16
   !> utilisation of a node that has none: no strength given
   real(wp), parameter :: no_utilisation = 0.0_wp

   type :: fracture_settings_t
      logical :: on = .false.
      integer :: splitting = splitting_element
      integer :: selection = select_worst
      !> SEPARATED: smallest distance of nodes that split together [length] (0: ten mean edges)
      real(wp) :: distance = 0
      integer :: max_level = 2
      !> events a step may have (0: no limit)
      integer :: max_events = 0
      logical :: locate = .true.
      real(wp) :: overshoot = 1.0e-3_wp
      !> fall of the monitor's reaction that ends the step (0: none), and the monitor's name
      real(wp) :: stop_drop = 0
      character(len=80) :: monitor = ''
   end type fracture_settings_t

   type :: failure_t
      type(fracture_settings_t) :: settings
      !> time of looking and planning
      type(stopwatch_t) :: watch
      !> strength and criterion of each material
      type(strength_t), allocatable :: strength(:)
      type(criterion_item_t), allocatable :: criterion(:)
      !> regions that never break, (nodes), (elements)
      logical, allocatable :: no_split_node(:), no_split_element(:)
      !> the node has no admissible direction until its fan changes, (nodes)
      logical, allocatable :: exhausted(:)
      !> a crack that softens goes through the node or beside it: it does not fail until that is broken, (nodes)
      logical, allocatable :: shielded(:)
      !> the tip of a crack that softens, (nodes)
      logical, allocatable :: soft_tip(:)
      !> direction in which the ray that made it went on, unit vector, (2, nodes)
      real(wp), allocatable :: tip_direction(:, :)
      !> elements round the node have changed since the last look: its stress is not known, (nodes)
      logical, allocatable, private :: stale(:)
      !> tensile strength, cohesion, tangent of the friction angle of each element, (3, elements)
      real(wp), allocatable :: element_strength(:, :)
      !> stresses of the elements, tension positive [stress], (3, elements); their utilisation and mode
      real(wp), allocatable :: element_stress(:, :), element_utilisation(:)
      integer(i1), allocatable :: element_mode(:)
      !> stress and utilisation of the nodes looked at, (3, nodes), (nodes); material and mode that decide
      real(wp), allocatable :: stress(:, :), utilisation(:)
      integer, allocatable :: deciding_material(:)
      integer(i1), allocatable :: mode(:)
      !> largest utilisation of the nodes that may fail, and of exhausted ones; how many those are
      real(wp) :: largest = 0, largest_exhausted = 0
      integer :: n_exhausted = 0
      !> a place where the out-of-plane stress is extreme and F >= 1 was found (node, 0: none)
      integer :: out_of_plane_node = 0
      !> bound of the elements' utilisation by either branch of the criterion, (elements); the largest in the two rings of
      !> each node, (nodes)
      real(wp), allocatable, private :: element_bound(:), screen(:)
   contains
      procedure :: prepare, adopt, shield, renumber, look, look_everywhere, plan, plan_at, may_fail, aim
      procedure, private :: reserve, stress_of_elements, set_strength, look_at_node, candidates, find_largest, note_out_of_plane
      procedure, private :: rays_of
   end type failure_t

contains

   !> Room for the mesh; strength of every element.
   subroutine prepare(self, mesh, material)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer :: e
      call self%reserve(mesh)
      do e = 1, mesh%n_elements
         call self%set_strength(mesh, material, e)
      end do
   end subroutine prepare

   subroutine reserve(self, mesh)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      call grow(self%no_split_node, mesh%n_nodes)
      call grow(self%exhausted, mesh%n_nodes)
      call grow(self%shielded, mesh%n_nodes)
      call grow(self%soft_tip, mesh%n_nodes)
      call grow(self%tip_direction, mesh%n_nodes, 2)
      call grow(self%stale, mesh%n_nodes)
      call grow(self%stress, mesh%n_nodes, 3)
      call grow(self%utilisation, mesh%n_nodes)
      call grow(self%deciding_material, mesh%n_nodes)
      call grow(self%mode, mesh%n_nodes)
      call grow(self%screen, mesh%n_nodes)
      call grow(self%no_split_element, mesh%n_elements)
      call grow(self%element_strength, mesh%n_elements, 3)
      call grow(self%element_stress, mesh%n_elements, 3)
      call grow(self%element_utilisation, mesh%n_elements)
      call grow(self%element_bound, mesh%n_elements)
      call grow(self%element_mode, mesh%n_elements)
   end subroutine reserve

   subroutine set_strength(self, mesh, material, element)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: element
      integer :: m
      if (mesh%section(element) == 0) return      ! a deck with errors: its reading goes on
      m = material%section(mesh%section(element))%material
      self%element_strength(1, element) = self%strength(m)%tensile*material%strength_factor(element)
      self%element_strength(2, element) = self%strength(m)%cohesion*material%strength_factor(element)
      self%element_strength(3, element) = self%strength(m)%tan_friction
   end subroutine set_strength

   !> Follow a split: regions that never break are inherited, nodes of changed elements may fail again.
   subroutine adopt(self, mesh, material, changes)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(changes_t), intent(in) :: changes
      integer :: i, n, a, b, k
      call self%reserve(mesh)
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         self%no_split_node(n) = self%no_split_node(a) .and. self%no_split_node(b)
         self%exhausted(n) = .false.
         self%stale(n) = .true.
      end do
      do i = 1, changes%n_children
         self%no_split_element(changes%child(1, i)) = self%no_split_element(changes%child(2, i))
         call self%set_strength(mesh, material, changes%child(1, i))
      end do
      do i = 1, changes%n_elements
         do k = 1, 3
            self%exhausted(mesh%connectivity(k, changes%element(i))) = .false.
            self%stale(mesh%connectivity(k, changes%element(i))) = .true.
         end do
      end do
   end subroutine adopt

   !> Follow new numbers; exposed nodes may fail again.
   subroutine renumber(self, map, exposed)
      class(failure_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      !> nodes that lost elements, new numbers
      integer, intent(in) :: exposed(:)
      call carry(self%no_split_node, map%node_from)
      call carry(self%exhausted, map%node_from)
      call carry(self%shielded, map%node_from)
      call carry(self%soft_tip, map%node_from)
      call carry(self%tip_direction, map%node_from)
      call carry(self%stale, map%node_from)
      call carry(self%stress, map%node_from)
      call carry(self%utilisation, map%node_from)
      call carry(self%deciding_material, map%node_from)
      call carry(self%mode, map%node_from)
      call carry(self%screen, map%node_from)
      call carry(self%no_split_element, map%element_from)
      call carry(self%element_strength, map%element_from)
      call carry(self%element_stress, map%element_from)
      call carry(self%element_utilisation, map%element_from)
      call carry(self%element_bound, map%element_from)
      call carry(self%element_mode, map%element_from)
      self%exhausted(pack(exposed, exposed <= map%n_nodes)) = .false.
      if (self%out_of_plane_node > 0) self%out_of_plane_node = map%node(self%out_of_plane_node)
   end subroutine renumber

   !> Nodes of a crack that cohesion still holds together, and those one ring beside it and before its tip, do not fail:
   !> the traction there is bounded by the strength already, and the recovered stress is that strength within its error,
   !> so that a second crack would run beside the first. The tip itself may fail.
   subroutine shield(self, mesh, bonds)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> pairs of nodes that cohesion holds together, (2, pairs)
      integer, intent(in) :: bonds(:, :)
      integer, allocatable :: around(:)
      logical, allocatable :: bonded(:)
      integer :: s, i, k, n, nodes(2, 2)
      self%shielded(:mesh%n_nodes) = .false.
      self%soft_tip(:mesh%n_nodes) = .false.
      if (size(bonds, 2) == 0) return
      allocate (bonded(mesh%n_nodes), source=.false.)
      do i = 1, size(bonds, 2)
         bonded(bonds(:, i)) = .true.
      end do
      do s = 1, mesh%n_segments
         nodes = side_nodes(mesh, s)
         if (.not. any(bonded(nodes(:, 1)) .and. nodes(:, 1) /= nodes(:, 2))) cycle
         do i = 1, 4
            n = nodes(1 + mod(i, 2), 1 + mod(i/2, 2))
            self%soft_tip(n) = nodes(1 + mod(i, 2), 1) == nodes(1 + mod(i, 2), 2)
            call elements_around(mesh, n, around, k)
            do k = k, 1, -1
               self%shielded(mesh%connectivity(:, around(k))) = .true.
            end do
         end do
      end do
      where (self%soft_tip(:mesh%n_nodes)) self%shielded(:mesh%n_nodes) = .false.
   end subroutine shield

   !> Stresses and utilisation of all elements.
   subroutine stress_of_elements(self, mesh, material, motion)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      real(wp), allocatable :: f(:), limit(:)
      integer(i1), allocatable :: mode(:)
      integer :: m, e
      self%stale(:mesh%n_nodes) = .false.
      call element_stresses(mesh%n_elements, mesh%connectivity, mesh%x, motion%ux, motion%uy, mesh%section, &
                            material%section%law%direct, material%section%law%lateral, material%section%law%shear, &
                            material%stiffness_factor, self%element_stress)
      if (material%initial%given) self%element_stress([1, 2, 3], :mesh%n_elements) = &
         self%element_stress([1, 2, 3], :mesh%n_elements) + material%initial%stress([1, 2, 4], :mesh%n_elements)
      self%element_utilisation(:mesh%n_elements) = no_utilisation
      self%element_mode(:mesh%n_elements) = mode_none
      self%element_bound(:mesh%n_elements) = no_utilisation
      if (size(self%strength) == 1 .and. self%strength(1)%given) then
         call self%criterion(1)%law%utilisation(mesh%n_elements, self%element_stress, self%element_strength, &
                                                self%element_utilisation, self%element_mode)
         call self%criterion(1)%law%bound(mesh%n_elements, self%element_stress, self%element_strength, &
                                          self%element_utilisation, self%element_bound)
         return
      end if
      allocate (f(mesh%n_elements), limit(mesh%n_elements), mode(mesh%n_elements))
      do m = 1, size(self%strength)
         if (.not. self%strength(m)%given) cycle
         call self%criterion(m)%law%utilisation(mesh%n_elements, self%element_stress, self%element_strength, f, mode)
         call self%criterion(m)%law%bound(mesh%n_elements, self%element_stress, self%element_strength, f, limit)
         do e = 1, mesh%n_elements
            if (material%section(mesh%section(e))%material /= m) cycle
            self%element_utilisation(e) = f(e)
            self%element_mode(e) = mode(e)
            self%element_bound(e) = limit(e)
         end do
      end do
   end subroutine stress_of_elements

   !> Look at the criterion: a screen from the elements, then the patches of the nodes that can be the largest.
   subroutine look(self, mesh, material, motion)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      call self%watch%start()
      call self%stress_of_elements(mesh, material, motion)
      self%largest = 0
      if (self%settings%on) then
         call spread_largest(mesh%n_elements, mesh%n_nodes, mesh%connectivity, self%element_bound, self%screen)
         call self%candidates(mesh, material, everywhere=.false.)
      end if
      call self%watch%stop()
   end subroutine look

   !> The same with the stress of every node, for output.
   subroutine look_everywhere(self, mesh, material, motion)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      call self%watch%start()
      call self%stress_of_elements(mesh, material, motion)
      call spread_largest(mesh%n_elements, mesh%n_nodes, mesh%connectivity, self%element_bound, self%screen)
      call self%candidates(mesh, material, everywhere=.true.)
      call self%watch%stop()
   end subroutine look_everywhere

   !> Fit the patches and find the largest utilisations.
   subroutine candidates(self, mesh, material, everywhere)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      logical, intent(in) :: everywhere
      logical, allocatable :: wanted(:)
      real(wp) :: threshold
      integer :: n
      allocate (wanted(mesh%n_nodes))
      do n = 1, mesh%n_nodes
         wanted(n) = .not. (self%no_split_node(n) .or. self%exhausted(n) .or. self%shielded(n) .or. mesh%hinge(n))
      end do
      threshold = screen_margin*min(1.0_wp, maxval(self%screen(:mesh%n_nodes), wanted))
      do n = 1, mesh%n_nodes
         wanted(n) = everywhere .or. self%exhausted(n) .or. &
                     (wanted(n) .and. self%screen(n) > 0 .and. self%screen(n) >= threshold)
      end do
      self%utilisation(:mesh%n_nodes) = 0
      self%mode(:mesh%n_nodes) = mode_none
      call look_at_nodes(self, mesh, material, wanted)
      if (.not. everywhere) then
         ! the node that the screen puts first may come out lower: those that could still be above what was found
         call self%find_largest(mesh)
         do n = 1, mesh%n_nodes
            wanted(n) = .not. (wanted(n) .or. self%no_split_node(n) .or. self%exhausted(n) .or. self%shielded(n) .or. &
                               mesh%hinge(n)) .and. &
                        self%screen(n) > 0 .and. self%screen(n) >= screen_margin*min(1.0_wp, self%largest)
         end do
         if (any(wanted)) call look_at_nodes(self, mesh, material, wanted)
      end if
      call self%find_largest(mesh)
   end subroutine candidates

   !> Look at the wanted nodes, on all threads.
   subroutine look_at_nodes(self, mesh, material, wanted)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      logical, intent(in) :: wanted(:)
      !$omp parallel default(none) shared(self, mesh, material, wanted)
      call look_at_wanted(self, mesh, material, wanted)
      !$omp end parallel
   end subroutine look_at_nodes

   !> Largest utilisations of the nodes looked at.
   subroutine find_largest(self, mesh)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer :: n
      self%largest = 0
      self%largest_exhausted = 0
      self%n_exhausted = 0
      do n = 1, mesh%n_nodes
         if (self%exhausted(n)) then
            self%n_exhausted = self%n_exhausted + 1
            self%largest_exhausted = max(self%largest_exhausted, self%utilisation(n))
         else if (.not. (self%no_split_node(n) .or. self%shielded(n) .or. mesh%hinge(n))) then
            self%largest = max(self%largest, self%utilisation(n))
         end if
      end do
   end subroutine find_largest

   !> Look at all wanted nodes; a thread's part of the loop, with its own work lists (in a procedure of its own because
   !> OpenMP's private does not initialise a derived type reliably).
   subroutine look_at_wanted(self, mesh, material, wanted)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      logical, intent(in) :: wanted(:)
      type(patch_work_t) :: work
      integer :: n
      !$omp do schedule(dynamic, 64)
      do n = 1, mesh%n_nodes
         if (wanted(n)) call self%look_at_node(mesh, material, n, work)
      end do
      !$omp end do
   end subroutine look_at_wanted

   !> Stress, utilisation and mode of a node: one fit and one F for each material at it, the largest counts.
   subroutine look_at_node(self, mesh, material, node, work)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node
      type(patch_work_t), intent(inout) :: work
      integer :: list(max_materials), n, i, attempt
      real(wp) :: stress(3, 1), strength(3, 1), f(1)
      integer(i1) :: mode(1)
      call materials_at_node(mesh, material, node, work, list, n)
      do i = 1, n
         do attempt = 1, 2
            call node_stress(mesh, material, self%element_stress, self%element_strength, node, list(i), attempt == 1, work, &
                             stress(:, 1), strength(:, 1))
            f = no_utilisation
            mode = mode_none
            if (self%strength(list(i))%given) call self%criterion(list(i))%law%utilisation(1, stress, strength, f, mode)
            ! a plane that says so much more than all elements of its patch is no recovery but an artefact of extrapolation
            ! (teeth of a rough boundary, debris); this also makes the screen a bound
            if (f(1) <= self%screen(node)/screen_margin) exit
         end do
         if (i > 1 .and. .not. f(1) > self%utilisation(node)) cycle
         self%stress(:, node) = stress(:, 1)
         self%utilisation(node) = f(1)
         self%mode(node) = mode(1)
         self%deciding_material(node) = list(i)
      end do
   end subroutine look_at_node

   !> Remember the first node that breaks while the stress out of the plane is the extreme one. In tension only a larger
   !> tension out of the plane would matter.
   subroutine note_out_of_plane(self, mesh, material, node)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node
      real(wp) :: s1, s3, out
      if (self%out_of_plane_node > 0) return
      call principal(self%stress(:, node), s1, s3)
      associate (section => material%section(mesh%section(mesh%element_of(node))))
         if (.not. section%plane_strain) return
      end associate
      out = -material%out_of_plane(mesh%section(mesh%element_of(node)), mesh%element_of(node), self%stress(:, node))
      if (out < s3 .or. (out > s1 .and. self%mode(node) /= mode_tension)) self%out_of_plane_node = node
   end subroutine note_out_of_plane

   !> The next split: the node with the largest utilisation that has an admissible direction. Nodes that have none are
   !> exhausted. split%node is 0 where nothing fails.
   subroutine plan(self, mesh, material, split)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(split_t), intent(out) :: split
      integer :: node
      call self%watch%start()
      do
         node = largest_admissible(self, mesh)
         if (node == 0) exit
         call self%plan_at(mesh, material, node, split)
         if (split%node > 0) exit
      end do
      self%largest = 0
      do node = 1, mesh%n_nodes
         if (self%may_fail(mesh, node)) self%largest = max(self%largest, self%utilisation(node))
      end do
      call self%watch%stop()
   end subroutine plan

   !> The split at a node that fails, on the mesh as it is, from the stresses of the last look. split%node is 0 where the
   !> node has no admissible direction (then it is exhausted), may not fail, or where the elements round it have changed
   !> since that look (then the next one tells).
   subroutine plan_at(self, mesh, material, node, split)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node
      type(split_t), intent(out) :: split
      real(wp) :: ray(2, max_rays)
      integer :: n_rays, m
      type(split_limits_t) :: limits
      if (self%stale(node) .or. .not. self%may_fail(mesh, node)) return
      limits%max_level = self%settings%max_level
      limits%along_edges = self%settings%splitting == splitting_edge
      m = self%deciding_material(node)
      call self%rays_of(node, ray, n_rays)
      call choose_split(mesh, node, ray(:, :n_rays), limits, self%element_utilisation, self%no_split_node, &
                        self%no_split_element, split)
      if (split%node > 0) then
         split%mode = self%mode(node)
         split%utilisation = self%utilisation(node)
         call principal(self%stress(:, node), split%sigma1, split%sigma3)
         call self%note_out_of_plane(mesh, material, node)
      else
         self%exhausted(node) = .true.
         self%n_exhausted = self%n_exhausted + 1
         self%largest_exhausted = max(self%largest_exhausted, self%utilisation(node))
      end if
   end subroutine plan_at

   !> Directions that a failed node may break in. Ahead of a crack that softens both principal stresses may be tensions of
   !> about the same size, which point nowhere or along the crack's normal; there the crack turns by what the shear along
   !> it asks for, as at the tip of a sharp crack (theory: eq. 30a).
   subroutine rays_of(self, node, ray, n_rays)
      class(failure_t), intent(in) :: self
      integer, intent(in) :: node
      real(wp), intent(out) :: ray(:, :)
      integer, intent(out) :: n_rays
      real(wp) :: d(2), normal, shear, ratio, turn, s1, s3
      associate (m => self%deciding_material(node), s => self%stress(:, node))
         call self%criterion(m)%law%directions(s, self%strength(m)%tan_friction, self%mode(node), ray, n_rays)
         if (.not. self%soft_tip(node) .or. self%mode(node) /= mode_tension) return
         d = self%tip_direction(:, node)
         call principal(s, s1, s3)
         if (.not. (norm2(d) > 0 .and. s1 < 0)) return
         normal = s(1)*d(2)**2 + s(2)*d(1)**2 - 2*s(3)*d(1)*d(2)
         shear = (s(2) - s(1))*d(1)*d(2) + s(3)*(d(1)**2 - d(2)**2)
         if (.not. normal > 0) return
         ratio = mean_ratio*shear/normal
         turn = 0
         if (abs(ratio) > 0) turn = 2*atan((1 - sqrt(1 + 8*ratio**2))/(4*ratio))
         n_rays = 1
         ray(:, 1) = [d(1)*cos(turn) - d(2)*sin(turn), d(2)*cos(turn) + d(1)*sin(turn)]
      end associate
   end subroutine rays_of

   !> The tips that an event made remember where its ray was going.
   subroutine aim(self, mesh, event, start, direction)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: event
      !> where the ray began [length]; its direction, unit vector
      real(wp), intent(in) :: start(2), direction(2)
      integer :: s, i, nodes(2, 2)
      real(wp) :: chord(2)
      do s = mesh%n_segments, 1, -1
         if (mesh%segment_event(s) /= event) cycle
         nodes = side_nodes(mesh, s)
         do i = 1, 2
            if (nodes(i, 1) /= nodes(i, 2)) cycle
            ! half of it the way that the crack took, else the turns would add up on a path that does not follow them
            chord = mesh%x(:, nodes(i, 1)) - start
            if (.not. dot_product(chord, direction) > 0) cycle
            chord = chord/norm2(chord) + direction
            self%tip_direction(:, nodes(i, 1)) = chord/norm2(chord)
         end do
      end do
   end subroutine aim

   !> Whether a node may fail at all: not in a region that never breaks, not exhausted, no hinge.
   pure logical function may_fail(self, mesh, node)
      class(failure_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      may_fail = .not. (self%exhausted(node) .or. self%shielded(node) .or. self%no_split_node(node) .or. mesh%hinge(node))
   end function may_fail

   !> The failing node with the largest utilisation; of those that tie the one with the lowest id. 0: nothing fails.
   integer function largest_admissible(self, mesh) result(node)
      type(failure_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      real(wp) :: largest
      integer :: n
      largest = 0
      do n = 1, mesh%n_nodes
         if (self%may_fail(mesh, n)) largest = max(largest, self%utilisation(n))
      end do
      node = 0
      if (largest < 1) return
      do n = 1, mesh%n_nodes
         if (.not. self%may_fail(mesh, n) .or. self%utilisation(n) < max(1.0_wp, largest*(1 - tie))) cycle
         if (node == 0) node = n
         if (mesh%node_id(n) < mesh%node_id(node)) node = n
      end do
   end function largest_admissible

end module rf_failure
