!> Where the body fails next: utilisation of elements and nodes, the node with the largest, and the split that follows
!> from it. Reads the mesh, never changes it.
module rf_failure
   use rf_kinds, only: wp, i1
   use rf_archive, only: archive_t
   use rf_clock, only: stopwatch_t
   use rf_grow, only: grow
   use rf_sort, only: ascending_once
   use rf_mesh, only: mesh_t
   use rf_renumber, only: renumbering_t, carry
   use rf_topology, only: changes_t, side_nodes, elements_around
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_criterion, only: strength_t, strengths, principal, max_rays, mode_none, mode_tension
   use rf_criteria, only: criterion_item_t
   use rf_recovery, only: patch_work_t
   use rf_ray, only: split_t, choose_split, split_limits_t
   implicit none
   private
   public :: failure_t, fracture_settings_t
   public :: splitting_element, splitting_none, splitting_edge, select_worst, select_separated, select_all

   !> what *FRACTURE, SPLITTING= may say
   integer, parameter :: splitting_none = 0, splitting_element = 1, splitting_edge = 2
   !> what *FRACTURE, SELECT= may say: the nodes that split together, before the body is relaxed again
   integer, parameter :: select_worst = 1, select_separated = 2, select_all = 3
   !> ratio of the stress intensities of shear and opening over that of the mean stresses round a tip: the mean of the
   !> singular field over a circle is 0.76 K_I across the crack and 0.51 K_II along it
   real(wp), parameter :: mean_ratio = 1.5_wp
   !> utilisations closer than this tie
   real(wp), parameter :: tie = 1.0e-6_wp

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
      !> some step may break the body; if none does, what follows is there only as long as a frame needs it
      logical :: watching = .true.
      !> the stress of the elements is asked for at states without a frame
      logical :: keeps_stress = .false.
      !> time of looking and planning
      type(stopwatch_t) :: watch
      !> strength and criterion of each material
      type(strength_t), allocatable :: strength(:)
      type(criterion_item_t), allocatable :: criterion(:)
      !> regions that never break, (nodes), (elements)
      logical, allocatable :: no_split_node(:), no_split_element(:)
      !> the node has no admissible direction until its fan changes, (nodes)
      logical, allocatable :: exhausted(:)
      !> a crack that softens goes through the node or beside it: it does not fail until that is broken, (nodes); here and in
      !> the next two: not allocated if no material softens
      logical, allocatable :: shielded(:)
      !> the tip of a crack that softens, (nodes)
      logical, allocatable :: soft_tip(:)
      !> direction in which the ray that made it went on, unit vector, (2, nodes)
      real(wp), allocatable :: tip_direction(:, :)
      !> the nodes that `shielded` or `soft_tip` marks (and some that neither does)
      integer, allocatable, private :: shield_list(:)
      integer, private :: n_shield_list = 0
      !> elements round the node have changed since the last look: its stress is not known, (nodes)
      logical, allocatable, private :: stale(:)
      !> stresses of the elements, tension positive [stress], (3, elements)
      real(wp), allocatable :: element_stress(:, :)
      !> utilisation of the elements round the nodes that were planned, (elements)
      real(wp), allocatable :: element_utilisation(:)
      !> stress and utilisation of the nodes looked at, (3, nodes), (nodes); material and mode that decide
      real(wp), allocatable :: stress(:, :), utilisation(:)
      integer, allocatable :: deciding_material(:)
      integer(i1), allocatable :: mode(:)
      !> largest utilisation of the nodes that may fail, and of exhausted ones; how many those are
      real(wp) :: largest = 0, largest_exhausted = 0
      integer :: n_exhausted = 0
      !> a place where the out-of-plane stress is extreme and F >= 1 was found (id of the node, 0: none)
      integer :: out_of_plane_node = 0
      !> bound of the elements' utilisation by either branch of the criterion, (elements), and the largest of each block
      real(wp), allocatable, private :: element_bound(:), block_bound(:)
      !> the screen of the last look, (nodes): the largest bound in two rings of elements, and in one; 0 where it was not needed
      real(wp), allocatable, private :: screen(:), ring(:)
      !> nodes that have a screen (all: every node), nodes looked at
      integer, allocatable, private :: screened(:), looked_at(:)
      integer, private :: n_screened = 0, n_looked_at = 0
      logical, private :: all_screened = .true.
   contains
      procedure :: prepare, mark_regions, adopt, shield, renumber, look, look_everywhere, plan, plan_at, may_fail, aim
      procedure, private :: reserve, forget, look_at_node, note_out_of_plane, rays_of
      procedure :: exchange
   end type failure_t

   interface
      !> To or from a checkpoint.
      module subroutine exchange(self, archive)
         class(failure_t), intent(inout) :: self
         class(archive_t), intent(inout) :: archive
      end subroutine exchange

      !> Look at the criterion: stress and bound of every element, the screen of the nodes that can be the largest, their patches.
      module subroutine look(self, mesh, material, motion)
         class(failure_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         type(motion_t), intent(in) :: motion
      end subroutine look

      !> The same with the stress of every node, for output.
      module subroutine look_everywhere(self, mesh, material, motion)
         class(failure_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         type(motion_t), intent(in) :: motion
      end subroutine look_everywhere

      !> Stress, utilisation and mode of a node: one fit and one F for each material at it, the largest counts.
      module subroutine look_at_node(self, mesh, material, node, work)
         class(failure_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         integer, intent(in) :: node
         type(patch_work_t), intent(inout) :: work
      end subroutine look_at_node
   end interface

contains

   !> Room for the mesh, where some step may break it.
   subroutine prepare(self, mesh, material)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      if (.not. self%watching) then
         if (allocated(self%no_split_node)) deallocate (self%no_split_node, self%no_split_element)
         return
      end if
      if (any(material%section%fracture_energy(1) > 0) .or. any(material%section%fracture_energy(2) > 0)) then
         call grow(self%shielded, mesh%n_nodes)
         call grow(self%soft_tip, mesh%n_nodes)
         call grow(self%tip_direction, mesh%n_nodes, 2)
      end if
      call self%mark_regions(mesh)
      call self%reserve(mesh)
   end subroutine prepare

   !> Room for the regions that never break.
   subroutine mark_regions(self, mesh)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      call grow(self%no_split_node, mesh%n_nodes)
      call grow(self%no_split_element, mesh%n_elements)
   end subroutine mark_regions

   subroutine reserve(self, mesh)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      call grow(self%exhausted, mesh%n_nodes)
      call grow(self%stale, mesh%n_nodes)
      call grow(self%stress, mesh%n_nodes, 3)
      call grow(self%utilisation, mesh%n_nodes)
      call grow(self%deciding_material, mesh%n_nodes)
      call grow(self%mode, mesh%n_nodes)
      call grow(self%screen, mesh%n_nodes)
      call grow(self%ring, mesh%n_nodes)
      call grow(self%element_stress, mesh%n_elements, 3)
      call grow(self%element_utilisation, mesh%n_elements)
      call grow(self%element_bound, mesh%n_elements)
      if (.not. allocated(self%shielded)) return
      call grow(self%shielded, mesh%n_nodes)
      call grow(self%soft_tip, mesh%n_nodes)
      call grow(self%tip_direction, mesh%n_nodes, 2)
   end subroutine reserve

   !> Nothing can break: give back what only a frame needed.
   subroutine forget(self)
      class(failure_t), intent(inout) :: self
      if (.not. allocated(self%exhausted)) return
      deallocate (self%exhausted, self%stale, self%stress, self%utilisation, self%deciding_material, self%mode, self%screen, &
                  self%ring, self%element_utilisation, self%element_bound)
      if (.not. self%keeps_stress) deallocate (self%element_stress)
      self%all_screened = .true.
      self%n_looked_at = 0
   end subroutine forget

   !> Follow a split: regions that never break are inherited, nodes of changed elements may fail again.
   subroutine adopt(self, mesh, changes)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(changes_t), intent(in) :: changes
      integer :: i, n, a, b, k
      if (.not. allocated(self%no_split_node)) return
      call self%mark_regions(mesh)
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         self%no_split_node(n) = self%no_split_node(a) .and. self%no_split_node(b)
      end do
      do i = 1, changes%n_children
         self%no_split_element(changes%child(1, i)) = self%no_split_element(changes%child(2, i))
      end do
      if (.not. allocated(self%exhausted)) return
      call self%reserve(mesh)
      do i = 1, changes%n_nodes
         n = changes%node(i)
         self%utilisation(n) = 0
         self%mode(n) = mode_none
         self%screen(n) = 0
         self%ring(n) = 0
         self%exhausted(n) = .false.
         self%stale(n) = .true.
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
      call carry(self%ring, map%node_from)
      call carry(self%no_split_element, map%element_from)
      call carry(self%element_stress, map%element_from)
      call carry(self%element_utilisation, map%element_from)
      call carry(self%element_bound, map%element_from)
      self%all_screened = .true.
      call follow(self%looked_at, self%n_looked_at)
      call follow(self%shield_list, self%n_shield_list)
      if (allocated(self%exhausted)) self%exhausted(pack(exposed, exposed <= map%n_nodes)) = .false.

   contains

      !> Nodes of a list, of those that stay.
      subroutine follow(list, n)
         integer, allocatable, intent(inout) :: list(:)
         integer, intent(inout) :: n
         integer, allocatable :: kept(:)
         if (n == 0) return
         kept = map%node(list(:n))         ! not into the list itself: gfortran 12 allocates it anew before it is read
         list = pack(kept, kept > 0)
         n = size(list)
      end subroutine follow

   end subroutine renumber

   !> Nodes of a crack that cohesion still holds together, and those one ring beside it and before its tip, do not fail:
   !> the traction there is bounded by the strength already, and the recovered stress is that strength within its error,
   !> so that a second crack would run beside the first. The tip itself may fail.
   subroutine shield(self, mesh, bonds)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> pairs of nodes that cohesion holds together, (2, pairs)
      integer, intent(in) :: bonds(:, :)
      integer, allocatable :: around(:), segments(:)
      integer :: j, i, k, n, nodes(2, 2)
      if (.not. allocated(self%shielded)) return
      do i = 1, self%n_shield_list
         self%shielded(self%shield_list(i)) = .false.
         self%soft_tip(self%shield_list(i)) = .false.
      end do
      self%n_shield_list = 0
      call bonded_segments(mesh, bonds, segments)
      do j = 1, size(segments)
         nodes = side_nodes(mesh, segments(j))
         do i = 1, 4
            n = nodes(1 + mod(i, 2), 1 + mod(i/2, 2))
            self%soft_tip(n) = nodes(1 + mod(i, 2), 1) == nodes(1 + mod(i, 2), 2)
            call elements_around(mesh, n, around, k)
            do k = k, 1, -1
               call mark(mesh%connectivity(:, around(k)))
            end do
         end do
      end do
      do i = 1, self%n_shield_list
         n = self%shield_list(i)
         if (self%soft_tip(n)) self%shielded(n) = .false.
      end do

   contains

      !> Shield nodes, those of the segment's ends among them.
      subroutine mark(corner)
         integer, intent(in) :: corner(3)
         integer :: c
         do c = 1, 3
            if (self%shielded(corner(c))) cycle
            self%shielded(corner(c)) = .true.
            self%n_shield_list = self%n_shield_list + 1
            call grow(self%shield_list, self%n_shield_list)
            self%shield_list(self%n_shield_list) = corner(c)
         end do
      end subroutine mark

   end subroutine shield

   !> Segments with an end that is open and whose first side is a bonded node, ascending, each once.
   subroutine bonded_segments(mesh, bonds, segments)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: bonds(:, :)
      integer, allocatable, intent(out) :: segments(:)
      integer, allocatable :: around(:)
      integer :: i, j, k, n, s, n_around, found, nodes(2, 2)
      found = 0
      allocate (segments(2*size(bonds)))
      do i = 1, size(bonds)
         n = bonds(1 + mod(i, 2), (i + 1)/2)
         call elements_around(mesh, n, around, n_around)
         do j = 1, n_around
            do k = 1, 3
               s = mesh%segment_at(k, around(j))
               if (s == 0) cycle
               nodes = side_nodes(mesh, s)
               if (.not. any(nodes(:, 1) == n .and. nodes(:, 1) /= nodes(:, 2))) cycle
               found = found + 1
               call grow(segments, found)
               segments(found) = s
            end do
         end do
      end do
      segments = ascending_once(segments(:found))
   end subroutine bonded_segments

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
      if (out < s3 .or. (out > s1 .and. self%mode(node) /= mode_tension)) &
         self%out_of_plane_node = mesh%node_id(node)
   end subroutine note_out_of_plane

   !> The next split: the node with the largest utilisation that has an admissible direction. Nodes that have none are
   !> exhausted. split%node is 0 where nothing fails.
   subroutine plan(self, mesh, material, split)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(split_t), intent(out) :: split
      integer :: node
      if (.not. self%watching) return
      call self%watch%start()
      do
         node = largest_admissible(self, mesh)
         if (node == 0) exit
         call self%plan_at(mesh, material, node, split)
         if (split%node > 0) exit
      end do
      self%largest = largest_utilisation(self, mesh)
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
      integer :: n_rays
      type(split_limits_t) :: limits
      if (self%stale(node) .or. .not. self%may_fail(mesh, node)) return
      limits%max_level = self%settings%max_level
      limits%along_edges = self%settings%splitting == splitting_edge
      call know_triangles(self, mesh, material, node)
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

   !> Utilisation of the triangles of a node, from the stresses of the last look.
   subroutine know_triangles(self, mesh, material, node)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node
      integer, allocatable :: around(:)
      integer(i1) :: mode(1)
      real(wp) :: strength(3, 1)
      integer :: i, n, e, m
      call elements_around(mesh, node, around, n)
      do i = 1, n
         e = around(i)
         m = material%section(mesh%section(e))%material
         self%element_utilisation(e) = 0
         if (.not. self%strength(m)%given) cycle
         call strengths(self%strength(m), [material%strength_of(e)], strength)
         call self%criterion(m)%law%utilisation(1, self%element_stress(:, e:e), strength, self%element_utilisation(e:e), mode)
      end do
   end subroutine know_triangles

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
         if (.not. allocated(self%soft_tip) .or. self%mode(node) /= mode_tension) return
         if (.not. self%soft_tip(node)) return
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
      if (.not. allocated(self%tip_direction)) return
      do s = mesh%n_segments, 1, -1
         if (mesh%segment_event(s) /= event) exit       ! its segments are the last ones
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
      may_fail = .not. (self%exhausted(node) .or. self%no_split_node(node) .or. mesh%hinge(node))
      if (allocated(self%shielded)) may_fail = may_fail .and. .not. self%shielded(node)
   end function may_fail

   !> The failing node with the largest utilisation; of those that tie the one with the lowest id. 0: nothing fails.
   integer function largest_admissible(self, mesh) result(node)
      type(failure_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      real(wp) :: largest
      integer :: i
      node = 0
      largest = largest_utilisation(self, mesh)
      if (largest < 1) return
      do i = 1, self%n_looked_at
         associate (n => self%looked_at(i))
            if (self%stale(n) .or. .not. self%may_fail(mesh, n)) cycle
            if (self%utilisation(n) < max(1.0_wp, largest*(1 - tie))) cycle
            if (node == 0) node = n
            if (mesh%node_id(n) < mesh%node_id(node)) node = n
         end associate
      end do
   end function largest_admissible

   !> Largest utilisation of the nodes that may fail, of those that the last look was at and whose elements are still the
   !> same: the utilisation of all others is 0 or out of date.
   pure real(wp) function largest_utilisation(self, mesh) result(largest)
      type(failure_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer :: i
      largest = 0
      do i = 1, self%n_looked_at
         associate (n => self%looked_at(i))
            if (.not. self%stale(n) .and. self%may_fail(mesh, n)) largest = max(largest, self%utilisation(n))
         end associate
      end do
   end function largest_utilisation

end module rf_failure
