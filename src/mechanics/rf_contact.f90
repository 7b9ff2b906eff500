!> Contact of crack faces: pairs of nodes that were one, with Coulomb friction (Qiu & Ding 2007, section 2.1, after
!> Katona 1983). Here is what a pair knows and keeps over splits. Its submodules find pairs from cracked edges, follow a split,
!> and lay them out for the kernels, which find the impulses (rf_direct_pair_k, rf_bundle_k, rf_contact_k).
module rf_contact
   use rf_kinds, only: wp, i1, i8
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t
   use rf_renumber, only: renumbering_t, carry
   use rf_topology, only: changes_t
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_cohesive, only: cohesive_t
   use rf_contact_blocks, only: contact_blocks_t
   implicit none
   private
   public :: contact_t, pair_open, pair_slip, pair_stick

   !> states of a pair
   integer, parameter :: pair_open = 0, pair_slip = 1, pair_stick = 2
   !> friction force, relative to its limit, from which a pair counts as slipping
   real(wp), parameter :: slip_threshold = 1.0_wp - 1.0e-9_wp

   type :: contact_t
      !> the first n_lone pairs share no node with another; each is a group. They stand in the order of their nodes
      integer :: n_pairs = 0, n_nodes = 0, n_groups = 0, n_lone = 0
      !> nodes a < b of each pair, (2, pairs); pairs that share nodes stand together (groups)
      integer, allocatable :: pair(:, :)
      !> unit normal from a to b, (2, pairs)
      real(wp), allocatable :: normal(:, :)
      !> crack area that belongs to the pair [length^2]
      real(wp), allocatable :: area(:)
      !> coefficient of friction [-], cohesion [stress] and the force it bears while the pair is unbroken [force]
      real(wp), allocatable :: friction(:), cohesion(:), cohesive_force(:)
      !> the pair has slipped or opened at a converged state: its cohesion is gone
      logical, allocatable :: broken(:)
      !> what cracks that soften bear
      type(cohesive_t) :: cohesive
      !> slip from which friction is measured: that of the last converged state [length]
      real(wp), allocatable :: slip_reference(:)
      !> gap at which the faces touch: 0, less where a split gave displaced faces a new normal by which they overlap
      !> already. Pushing them apart at once would create energy; the overlap can shrink only (theory: eq. 17) [length]
      real(wp), allocatable :: gap_reference(:)
      !> friction force on b at the last accepted state, and the limit that it had there (huge: the pair is younger) [force]
      real(wp), allocatable, private :: friction_before(:), limit_before(:)
      !> normal and tangential impulse of the last step, (2, pairs): where the next step of a relaxation begins
      real(wp), allocatable :: impulse(:, :)
      !> n.(1/m_a + 1/m_b).n and the same for the tangent, fixed directions counting 0; their inverse, 0 for 0, (2, pairs)
      real(wp), allocatable :: weight(:, :), gain(:, :)
      !> node of each contact node; contact nodes of each pair, (2, pairs)
      integer, allocatable :: node(:), pair_node(:, :)
      !> contact force on each contact node, after sum_forces [force], (2, contact nodes)
      real(wp), allocatable :: force(:, :)
      !> 1/m of each contact node, 0 in directions that are held; parts of its residual that count, see contact_step,
      !> (2, contact nodes)
      real(wp), allocatable :: mobility(:, :), counted(:, :)
      !> first pair and first contact node of each group, (groups + 1)
      integer, allocatable :: group_pair(:), group_node(:)
      !> what the kernels walk through
      type(contact_blocks_t) :: blocks
      !> sums of each block, (2, blocks)
      real(wp), allocatable :: partial(:, :)
      !> workspace of the kernel: gap and slip without impulses, (2, pairs); changes of velocity, (2, contact nodes)
      real(wp), allocatable :: jump(:, :), kick(:, :)
      !> keys of the pairs that share nodes in ascending order and their numbers, to find them by
      integer(i8), allocatable, private :: key(:)
      integer, allocatable, private :: by_key(:)
   contains
      procedure :: rebuild, follow, renumber, node_force, weigh, find_pair, gap, slip, opening, settle, follow_overlap, traction
      procedure :: state
      procedure :: arrange, follow_references, step, sum_forces, bonds, softens
      procedure, private :: take_pairs, inherit_pairs, join_ends, group_pairs, sort_keys, reserve_pairs, lone_before
      procedure, private, nopass :: pair_key
      procedure :: exchange
   end type contact_t

   interface
      !> Pairs across all crack segments: one for each two nodes that face each other, normals weighted by length.
      module subroutine collect_pairs(self, mesh, material)
         type(contact_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
      end subroutine collect_pairs

      !> Pairs from open ends of segments, in the order of their keys. The sums of each pair are in the order of the ends.
      module subroutine join_ends(self, mesh, material, key, segment_of)
         class(contact_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         !> key of the pair and segment of each end
         integer(i8), intent(in) :: key(:)
         integer, intent(in) :: segment_of(:)
      end subroutine join_ends

      !> Put pairs that share nodes together, in the order of the lowest pair of each group, behind those that share none, and
      !> number their nodes.
      module subroutine group_pairs(self)
         class(contact_t), intent(inout) :: self
      end subroutine group_pairs

      !> What the kernels must know beside: what each block of nodes has to do, and of each contact node. It copies what pairs
      !> are: where that changes before it is called again, follow_references. After weigh.
      module subroutine arrange(self, n_nodes, inverse_mass, free_x, free_y, counted)
         class(contact_t), intent(inout) :: self
         !> nodes of the mesh
         integer, intent(in) :: n_nodes
         !> see weigh; 1 where a node's residual counts, else 0, (nodes; of size 0: 1 everywhere)
         real(wp), intent(in) :: inverse_mass(:), counted(:)
         integer(i1), intent(in) :: free_x(:), free_y(:)
      end subroutine arrange

      !> The kernels' copies of slip and gap references and cohesive forces, after a time step.
      module subroutine follow_references(self)
         class(contact_t), intent(inout) :: self
      end subroutine follow_references

      !> Impulses of the pairs in a step, applied to velocities and new displacements, see contact_step. After arrange.
      module subroutine step(self, direct_done, tolerance, warm, b, free_x, free_y, px, py, motion)
         class(contact_t), intent(inout) :: self
         !> the step kernel has solved the direct pairs within each block
         logical, intent(in) :: direct_done
         !> largest change of an impulse in the last sweep, relative to the group's largest impulse; part of the last step's
         !> impulses from which connected pairs start; factor of r/m in the velocity update
         real(wp), intent(in) :: tolerance, warm, b
         !> supports and applied forces, see relaxation_step
         integer(i1), intent(in), contiguous :: free_x(:), free_y(:)
         real(wp), intent(in), contiguous :: px(:), py(:)
         type(motion_t), intent(inout) :: motion
      end subroutine step

      !> To or from a checkpoint. (Derived: blocks from arrange.)
      module subroutine exchange(self, archive)
         class(contact_t), intent(inout) :: self
         class(archive_t), intent(inout) :: archive
      end subroutine exchange

      !> Follow a split: the pairs there are now, as rebuild would find them, where it has touched the body.
      module subroutine follow(self, mesh, material, motion, changes)
         class(contact_t), intent(inout) :: self
         type(mesh_t), intent(in) :: mesh
         type(material_t), intent(in) :: material
         type(motion_t), intent(in) :: motion
         type(changes_t), intent(in) :: changes
      end subroutine follow
   end interface

contains

   !> Find all pairs anew from the crack segments. Pairs that were there keep what they know; new ones measure friction
   !> from the slip there is now, which is that of a converged state.
   subroutine rebuild(self, mesh, material, motion, changes)
      class(contact_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      !> what the split changed (absent at the start)
      type(changes_t), intent(in), optional :: changes
      type(contact_t) :: old
      integer :: p
      if (self%n_pairs > 0) call old%take_pairs(self, [(p, p=1, self%n_pairs)])
      call collect_pairs(self, mesh, material)
      call self%group_pairs()
      call self%inherit_pairs(old, motion, changes)
   end subroutine rebuild

   !> Copies of pairs with what they know, to be found by their nodes; not as segments see them.
   subroutine take_pairs(self, from, pairs)
      class(contact_t), intent(inout) :: self
      type(contact_t), intent(in) :: from
      !> their numbers
      integer, intent(in) :: pairs(:)
      self%n_pairs = size(pairs)
      self%n_lone = 0
      self%pair = from%pair(:, pairs)
      self%normal = from%normal(:, pairs)
      self%broken = from%broken(pairs)
      self%slip_reference = from%slip_reference(pairs)
      self%gap_reference = from%gap_reference(pairs)
      self%friction_before = from%friction_before(pairs)
      self%limit_before = from%limit_before(pairs)
      self%impulse = from%impulse(:, pairs)
      call self%cohesive%take(from%cohesive, pairs)
      call self%sort_keys()
   end subroutine take_pairs

   !> What pairs know: of themselves, if they were there before, or from pairs that they lie between.
   subroutine inherit_pairs(self, old, motion, changes)
      class(contact_t), intent(inout) :: self
      !> the pairs before
      type(contact_t), intent(in) :: old
      type(motion_t), intent(in) :: motion
      !> what the split changed (absent at the start)
      type(changes_t), intent(in), optional :: changes
      integer :: p, q, i, ancestor(2)
      do p = 1, self%n_pairs
         q = old%find_pair(self%pair(1, p), self%pair(2, p))
         self%slip_reference(p) = self%slip(motion, p)
         self%gap_reference(p) = min(0.0_wp, self%gap(motion, p))
         self%broken(p) = .false.
         self%impulse(:, p) = 0
         self%friction_before(p) = 0
         self%limit_before(p) = merge(huge(1.0_wp), 0.0_wp, present(changes))
         if (q > 0) then
            self%broken(p) = old%broken(q)
            self%impulse(:, p) = carried_impulse(self, p, old, q)
            self%friction_before(p) = old%friction_before(q)
            self%limit_before(p) = old%limit_before(q)
            if (all(abs(old%normal(:, q) - self%normal(:, p)) <= epsilon(1.0_wp))) then
               self%slip_reference(p) = old%slip_reference(q)
               self%gap_reference(p) = old%gap_reference(q)
            end if
            call self%cohesive%inherit(p, old%cohesive, [q])
            self%cohesive%rigid(p) = old%cohesive%rigid(q)
            cycle
         end if
         ancestor = 0
         if (present(changes)) ancestor = ancestors(old, changes, self%pair(:, p))
         do i = 1, 2
            if (ancestor(i) > 0) self%broken(p) = self%broken(p) .or. old%broken(ancestor(i))
         end do
         if (all(ancestor == 0)) then
            call self%cohesive%start(p, rigid=present(changes))
         else
            call self%cohesive%inherit(p, old%cohesive, ancestor)
         end if
      end do
   end subroutine inherit_pairs

   !> The impulse of a pair that was there before. Where it lost area or its normal turned, what is left of its cohesion with
   !> the area, the same force in the directions of now: a removal balances the rest of the body by it.
   pure function carried_impulse(self, p, old, q) result(impulse)
      type(contact_t), intent(in) :: self, old
      !> the pair now and before
      integer, intent(in) :: p, q
      real(wp) :: impulse(2), ratio, r(2)
      impulse = old%impulse(:, q)
      ratio = 1
      if (old%cohesive%area(q) > 0) ratio = min(1.0_wp, self%cohesive%area(p)/old%cohesive%area(q))
      if (ratio >= 1 .and. all(abs(old%normal(:, q) - self%normal(:, p)) <= epsilon(1.0_wp))) return
      if (.not. old%cohesive%area(q) > 0) return
      r = impulse - (1 - ratio)*old%cohesive%impulse(:, q)
      r = old%normal(:, q)*r(1) + [-old%normal(2, q), old%normal(1, q)]*r(2)
      impulse = [dot_product(self%normal(:, p), r), self%normal(1, p)*r(2) - self%normal(2, p)*r(1)]
   end function carried_impulse

   !> The old pairs that a pair of new nodes lies on or between: the same one twice for copies, one for each end of a
   !> bisected crack edge (0: a tip); none on a new crack.
   function ancestors(old, changes, pair) result(found)
      type(contact_t), intent(in) :: old
      type(changes_t), intent(in) :: changes
      integer, intent(in) :: pair(2)
      integer :: found(2)
      integer :: i, q, from(2, 2), side
      from(:, 1) = pair(1)
      from(:, 2) = pair(2)
      do i = changes%n_nodes, 1, -1      ! a copy's parent may be new itself
         do side = 1, 2
            where (from(:, side) == changes%node(i))
               from(:, side) = merge(changes%parent(1, i), changes%parent(:, i), changes%parent(2, i) == 0)
            end where
         end do
      end do
      found = 0
      do i = 1, 2
         do side = 1, 2
            q = old%find_pair(from(i, 1), from(side, 2))
            if (q > 0) found(i) = q
         end do
      end do
   end function ancestors

   pure integer(i8) function pair_key(a, b)
      integer, intent(in) :: a, b
      pair_key = int(min(a, b), i8)*2_i8**32 + int(max(a, b), i8)
   end function pair_key

   subroutine reserve_pairs(self, n)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: n
      call grow(self%pair, n, 2)
      call grow(self%normal, n, 2)
      call grow(self%area, n)
      call grow(self%friction, n)
      call grow(self%cohesion, n)
      call grow(self%cohesive_force, n)
      call grow(self%broken, n)
      call grow(self%slip_reference, n)
      call grow(self%gap_reference, n)
      call grow(self%friction_before, n)
      call grow(self%limit_before, n)
      call grow(self%impulse, n, 2)
      call grow(self%weight, n, 2)
      call grow(self%gain, n, 2)
      call grow(self%jump, n, 2)
      call grow(self%pair_node, n, 2)
      call grow(self%node, 2*n)
      call grow(self%force, 2*n, 2)
      call grow(self%kick, 2*n, 2)
      call grow(self%mobility, 2*n, 2)
      call grow(self%counted, 2*n, 2)
      call self%cohesive%reserve(n)
   end subroutine reserve_pairs

   !> Keys of the pairs that share nodes in ascending order; those that share none stand in it themselves.
   subroutine sort_keys(self)
      class(contact_t), intent(inout) :: self
      integer :: p
      if (allocated(self%key)) deallocate (self%key)
      if (allocated(self%by_key)) deallocate (self%by_key)
      allocate (self%key(self%n_pairs - self%n_lone))
      do p = self%n_lone + 1, self%n_pairs
         self%key(p - self%n_lone) = pair_key(self%pair(1, p), self%pair(2, p))
      end do
      allocate (self%by_key, source=sorted_order(self%key))
      self%key = self%key(self%by_key)
      self%by_key = self%n_lone + self%by_key
   end subroutine sort_keys

   !> Number of the pair of two nodes, 0 if there is none.
   pure integer function find_pair(self, a, b) result(p)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: a, b
      integer(i8) :: key
      integer :: low
      p = 0
      key = pair_key(a, b)
      low = self%lone_before(key)
      if (low > 0) then
         if (pair_key(self%pair(1, low), self%pair(2, low)) == key) p = low
      end if
      if (p > 0 .or. self%n_lone == self%n_pairs) return
      low = last_below(self%key, key)
      if (low > 0) then
         if (self%key(low) == key) p = self%by_key(low)
      end if
   end function find_pair

   !> The last of the pairs that share no node whose key is not above another; 0: none.
   pure integer function lone_before(self, key) result(low)
      class(contact_t), intent(in) :: self
      integer(i8), intent(in) :: key
      integer :: high, middle
      low = 0
      high = self%n_lone
      do while (low < high)
         middle = (low + high + 1)/2
         if (pair_key(self%pair(1, middle), self%pair(2, middle)) <= key) then
            low = middle
         else
            high = middle - 1
         end if
      end do
   end function lone_before

   !> The last of ascending keys that is not above another; 0: none.
   pure integer function last_below(keys, key) result(low)
      integer(i8), intent(in) :: keys(:), key
      integer :: high, middle
      low = 0
      high = size(keys)
      do while (low < high)
         middle = (low + high + 1)/2
         if (keys(middle) <= key) then
            low = middle
         else
            high = middle - 1
         end if
      end do
   end function last_below

   !> Follow new numbers of the nodes: pairs that lost one are forgotten. Then rebuild finds what is left.
   subroutine renumber(self, map)
      class(contact_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      integer, allocatable :: stay(:)
      integer :: p, n
      n = self%n_pairs
      if (n == 0) return
      do p = 1, n
         self%pair(:, p) = map%node(self%pair(:, p))
      end do
      allocate (stay, source=pack([(p, p=1, n)], [(all(self%pair(:, p) > 0), p=1, n)]))
      call carry(self%pair, stay)
      call carry(self%normal, stay)
      call carry(self%area, stay)
      call carry(self%friction, stay)
      call carry(self%cohesion, stay)
      call carry(self%cohesive_force, stay)
      call carry(self%broken, stay)
      call carry(self%slip_reference, stay)
      call carry(self%gap_reference, stay)
      call carry(self%friction_before, stay)
      call carry(self%limit_before, stay)
      call carry(self%impulse, stay)
      call carry(self%weight, stay)
      call carry(self%gain, stay)
      call carry(self%pair_node, stay)
      call self%cohesive%keep(stay)
      self%n_pairs = size(stay)
      self%n_lone = 0              ! the pairs do not stand in the order of their keys any more
      do p = 1, self%n_pairs
         if (self%pair(1, p) < self%pair(2, p)) cycle
         self%pair(:, p) = self%pair([2, 1], p)       ! gap and slip are the same seen from the other side
         self%normal(:, p) = -self%normal(:, p)
      end do
      call self%sort_keys()
   end subroutine renumber

   !> Sum of the contact forces on each node [force], (2, nodes).
   function node_force(self, n_nodes, b) result(force)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: n_nodes
      !> factor of the residual in the last step's update
      real(wp), intent(in) :: b
      real(wp), allocatable :: force(:, :)
      real(wp) :: pull(2), f(2)
      integer :: p
      allocate (force(2, n_nodes), source=0.0_wp)
      do p = 1, self%n_pairs
         pull = self%traction(p, b)
         f = self%normal(:, p)*pull(1) + [-self%normal(2, p), self%normal(1, p)]*pull(2)
         force(:, self%pair(2, p)) = force(:, self%pair(2, p)) + f
         force(:, self%pair(1, p)) = force(:, self%pair(1, p)) - f
      end do
   end function node_force

   !> Compliances of the pairs for the masses and supports there are.
   subroutine weigh(self, inverse_mass, free_x, free_y)
      class(contact_t), intent(inout) :: self
      !> 1/m, and 1 where a direction is free, else 0, (nodes)
      real(wp), intent(in) :: inverse_mass(:)
      integer(i1), intent(in) :: free_x(:), free_y(:)
      integer :: p, a, b
      real(wp) :: sx, sy
      do p = 1, self%n_pairs
         a = self%pair(1, p)
         b = self%pair(2, p)
         sx = free_x(a)*inverse_mass(a) + free_x(b)*inverse_mass(b)
         sy = free_y(a)*inverse_mass(a) + free_y(b)*inverse_mass(b)
         self%cohesive_force(p) = merge(0.0_wp, self%cohesion(p)*self%area(p), self%broken(p))
         self%weight(1, p) = self%normal(1, p)**2*sx + self%normal(2, p)**2*sy
         self%weight(2, p) = self%normal(2, p)**2*sx + self%normal(1, p)**2*sy
         ! Where supports leave both nodes the same single direction, that motion opens and slides at once: one unknown
         ! cannot bear two conditions (they would push each other up without end), and not interpenetrating comes first.
         if (.not. (sx > 0 .and. sy > 0)) self%weight(2, p) = 0
      end do
      call self%cohesive%weigh(self%n_pairs, self%weight)
   end subroutine weigh

   !> Contact force on each contact node after a step.
   subroutine sum_forces(self, b)
      class(contact_t), intent(inout) :: self
      !> factor of the residual in the step's update
      real(wp), intent(in) :: b
      real(wp) :: pull(2), f(2)
      integer :: p
      if (self%n_pairs == 0) return
      self%force(:, :self%n_nodes) = 0
      do p = 1, self%n_pairs
         pull = self%traction(p, b)
         f = self%normal(:, p)*pull(1) + [-self%normal(2, p), self%normal(1, p)]*pull(2)
         self%force(:, self%pair_node(1, p)) = self%force(:, self%pair_node(1, p)) - f
         self%force(:, self%pair_node(2, p)) = self%force(:, self%pair_node(2, p)) + f
      end do
   end subroutine sum_forces

   !> Pairs that cohesion still holds together, (2, pairs). After weigh.
   pure function bonds(self)
      class(contact_t), intent(in) :: self
      integer, allocatable :: bonds(:, :)
      integer :: p, n
      if (.not. self%softens()) then
         allocate (bonds(2, 0))
         return
      end if
      allocate (bonds(2, count(self%cohesive%bonded(:self%n_pairs))))
      n = 0
      do p = 1, self%n_pairs
         if (.not. self%cohesive%bonded(p)) cycle
         n = n + 1
         bonds(:, n) = self%pair(:, p)
      end do
   end function bonds

   !> Whether any pair has or had something to soften.
   pure logical function softens(self)
      class(contact_t), intent(in) :: self
      softens = self%n_pairs > 0
      if (softens) softens = any(self%cohesive%area(:self%n_pairs) > 0)
   end function softens

   !> Opening of a pair [length].
   pure real(wp) function gap(self, motion, p)
      class(contact_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: p
      gap = self%normal(1, p)*(motion%ux(self%pair(2, p)) - motion%ux(self%pair(1, p))) &
            + self%normal(2, p)*(motion%uy(self%pair(2, p)) - motion%uy(self%pair(1, p)))
   end function gap

   !> Slip of a pair, b against a along the tangent (-n_y, n_x) [length].
   pure real(wp) function slip(self, motion, p)
      class(contact_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: p
      slip = self%normal(1, p)*(motion%uy(self%pair(2, p)) - motion%uy(self%pair(1, p))) &
             - self%normal(2, p)*(motion%ux(self%pair(2, p)) - motion%ux(self%pair(1, p)))
   end function slip

   !> State of a pair after a step.
   pure integer function state(self, p, b)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: p
      !> factor of the residual in the step's update
      real(wp), intent(in) :: b
      real(wp) :: cap
      if (self%cohesive%is_held(p)) then
         state = pair_stick
         return
      else if (.not. self%impulse(1, p) > 0) then
         state = pair_open
         return
      end if
      cap = self%friction(p)*self%impulse(1, p)
      cap = cap + b*self%cohesive_force(p)
      state = merge(pair_slip, pair_stick, abs(self%impulse(2, p) - self%cohesive%impulse(2, p)) >= slip_threshold*cap)
   end function state

   !> Traction forces of a pair: normal (pressing; negative where cohesion pulls) and tangential on b [force].
   pure function traction(self, p, b) result(force)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: p
      !> factor of the residual in the step's update
      real(wp), intent(in) :: b
      real(wp) :: force(2)
      force = self%impulse(:, p)/b
   end function traction

   !> A converged state is accepted: slipping and open pairs measure friction from here on, and have lost their
   !> cohesion (theory: eq. 23); what softens is damaged to where it is.
   !> Returns the work done against friction since the last one (theory: eq. 40).
   subroutine settle(self, motion, b, friction_work)
      class(contact_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> factor of the residual in the step's update
      real(wp), intent(in) :: b
      !> [force length]
      real(wp), intent(out) :: friction_work
      integer :: p, how
      real(wp) :: s, friction
      friction_work = 0
      self%cohesive%stored = 0
      do p = 1, self%n_pairs
         how = self%state(p, b)
         s = self%slip(motion, p)
         call self%cohesive%settle(p, [self%opening(motion, p), s])
         call self%follow_overlap(motion, p)
         friction = (self%impulse(2, p) - self%cohesive%impulse(2, p))/b
         if (how /= pair_stick) then
            friction_work = friction_work - mean_friction(self, p, how, friction)*(s - self%slip_reference(p))
            self%slip_reference(p) = s
            self%broken(p) = .true.
         end if
         self%friction_before(p) = friction
         self%limit_before(p) = self%friction(p)*max(0.0_wp, self%impulse(1, p))/b
         if (self%impulse(1, p) > 0) self%limit_before(p) = self%limit_before(p) + self%cohesive_force(p)
      end do
   end subroutine settle

   !> Friction under which a pair has slipped since the last accepted state [force]. One that was at its limit there slid all the
   !> way, under the mean of that limit and of this one; one that was far below stuck till this one; between them by the part of
   !> its limit that it bore (theory: eq. 39).
   pure real(wp) function mean_friction(self, p, how, friction) result(mean)
      type(contact_t), intent(in) :: self
      !> pair, its state now
      integer, intent(in) :: p, how
      !> on b, now [force]
      real(wp), intent(in) :: friction
      real(wp) :: part
      mean = friction
      if (how /= pair_slip .or. friction*self%friction_before(p) < 0) return
      part = 1
      if (self%limit_before(p) > 0) part = min(1.0_wp, abs(self%friction_before(p))/self%limit_before(p))
      mean = friction + 0.5_wp*part*(sign(self%limit_before(p), friction) - friction)
   end function mean_friction

   !> Opening of a pair from where its faces touch [length].
   pure real(wp) function opening(self, motion, p)
      class(contact_t), intent(in) :: self
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: p
      opening = self%gap(motion, p) - self%gap_reference(p)
   end function opening

   !> Faces that overlapped when they were born touch where they are now, once they have moved apart.
   subroutine follow_overlap(self, motion, p)
      class(contact_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: p
      if (.not. self%gap_reference(p) < 0 .or. self%impulse(1, p) > 0 .or. self%cohesive%bonded(p)) return
      self%gap_reference(p) = min(0.0_wp, max(self%gap_reference(p), self%gap(motion, p)))
   end subroutine follow_overlap

end module rf_contact
