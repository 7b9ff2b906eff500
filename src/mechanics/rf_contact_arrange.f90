!> What the kernels must know of the pairs beside: which of them each block of nodes solves at once, which groups it sweeps,
!> and how the impulses of a group act on each other.
submodule(rf_contact) rf_contact_arrange
   use rf_step_k, only: block_size, lanes
   use rf_contact_blocks, only: property_normal, property_gain, property_friction, property_cohesion, property_slip, &
      property_gap, property_mobility, property_residual, property_reaction, n_properties, n_bundled_properties
   use rf_bundle_k, only: most_bundled
   use rf_contact_k, only: contact_step
   implicit none

contains

   module subroutine arrange(self, n_nodes, inverse_mass, free_x, free_y, counted)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      real(wp), intent(in) :: inverse_mass(:), counted(:)
      integer(i1), intent(in) :: free_x(:), free_y(:)
      logical, allocatable :: is_direct(:)
      integer :: c, n, p
      do c = 1, self%n_nodes
         n = self%node(c)
         self%mobility(:, c) = [free_x(n), free_y(n)]*inverse_mass(n)
         self%counted(:, c) = [free_x(n), 1_i1 - free_x(n)]
         if (size(counted) > 0) self%counted(:, c) = counted(n)*self%counted(:, c)
      end do
      do p = 1, self%n_pairs
         self%gain(:, p) = 0
         where (self%weight(:, p) > 0) self%gain(:, p) = 1/self%weight(:, p)
      end do
      self%blocks%n = (n_nodes - 1)/block_size + 1
      call grow(self%partial, self%blocks%n, 2)
      allocate (is_direct(self%n_groups), source=.false.)
      do p = 1, self%n_lone
         is_direct(p) = all(free_x(self%pair(:, p)) == free_y(self%pair(:, p))) .and. .not. self%cohesive%bonded(p)
      end do
      call list_direct(self, is_direct(:self%n_lone))
      call list_swept(self, is_direct)
      call list_nodes(self)
      call list_bundles(self)
   end subroutine arrange

   !> Block of a node.
   elemental integer function block_of(node)
      integer, intent(in) :: node
      block_of = (node - 1)/block_size + 1
   end function block_of

   !> Pairs that are solved at once, block by block; in each those first whose nodes both lie in it.
   subroutine list_direct(self, is_direct)
      class(contact_t), intent(inout) :: self
      !> of the pairs that share no node
      logical, intent(in) :: is_direct(:)
      integer, allocatable :: pair(:), home(:), order(:), inner_first(:)
      logical, allocatable :: inner(:)
      integer :: d, p
      pair = pack([(p, p=1, self%n_lone)], is_direct)
      home = block_of(self%pair(1, pair))
      inner = home == block_of(self%pair(2, pair))
      allocate (order, source=sorted_order(2*int(home, i8) + merge(0, 1, inner)))
      associate (blocks => self%blocks)
         blocks%direct_first = starts(home, blocks%n)
         inner_first = starts(pack(home, inner), blocks%n)
         blocks%direct_outer = blocks%direct_first(:blocks%n) + inner_first(2:) - inner_first(:blocks%n)
         call make_room(blocks, size(pair))
         do d = 1, size(pair)
            p = pair(order(d))
            blocks%direct_pair(d) = p
            blocks%direct_node(:, d) = self%pair(:, p)
            blocks%direct(:, d) = properties(self, p)
         end do
      end associate
   end subroutine list_direct

   !> Room for direct pairs.
   subroutine make_room(blocks, n)
      type(contact_blocks_t), intent(inout) :: blocks
      integer, intent(in) :: n
      call grow(blocks%direct_pair, n)
      call grow(blocks%direct_node, n, 2)
      call grow(blocks%direct, n, n_properties)
   end subroutine make_room

   !> What a pair is, see rf_contact_blocks.
   pure function properties(self, p)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: p
      real(wp) :: properties(n_properties)
      integer :: c(2)
      c = self%pair_node(:, p)
      properties(property_normal:property_normal + 1) = self%normal(:, p)
      properties(property_gain:property_gain + 1) = self%gain(:, p)
      properties(property_friction) = self%friction(p)
      properties(property_cohesion) = self%cohesive_force(p)
      properties(property_slip) = self%slip_reference(p)
      properties(property_gap) = self%gap_reference(p)
      properties(property_mobility:property_mobility + 1) = self%mobility(1, c)
      properties(property_residual:property_residual + 1) = self%counted(1, c)
      properties(property_reaction:property_reaction + 1) = self%counted(2, c)
   end function properties

   module subroutine follow_references(self)
      class(contact_t), intent(inout) :: self
      integer :: d, s, lane, p
      associate (blocks => self%blocks)
         do d = 1, blocks%direct_first(blocks%n + 1) - 1
            p = blocks%direct_pair(d)
            blocks%direct(property_cohesion, d) = self%cohesive_force(p)
            blocks%direct(property_slip, d) = self%slip_reference(p)
            blocks%direct(property_gap, d) = self%gap_reference(p)
         end do
         do s = 1, slots_in(blocks)
            do lane = 1, lanes
               p = blocks%slot_pair(lane, s)
               blocks%slot(lane + (property_cohesion - 1)*lanes, s) = self%cohesive_force(p)
               blocks%slot(lane + (property_slip - 1)*lanes, s) = self%slip_reference(p)
               blocks%slot(lane + (property_gap - 1)*lanes, s) = self%gap_reference(p)
            end do
         end do
      end associate
   end subroutine follow_references

   !> Slots of all bundles.
   pure integer function slots_in(blocks)
      type(contact_blocks_t), intent(in) :: blocks
      integer :: last
      last = blocks%bundle_first(blocks%n + 1) - 1
      slots_in = 0
      if (last > 0) slots_in = blocks%bundle_slot(last) + blocks%bundle_pairs(last) - 1
   end function slots_in

   module subroutine step(self, direct_done, tolerance, warm, b, free_x, free_y, px, py, motion)
      class(contact_t), intent(inout) :: self
      logical, intent(in) :: direct_done
      real(wp), intent(in) :: tolerance, warm, b
      integer(i1), intent(in), contiguous :: free_x(:), free_y(:)
      real(wp), intent(in), contiguous :: px(:), py(:)
      type(motion_t), intent(inout) :: motion
      call contact_step(self%blocks, direct_done, self%group_pair, self%group_node, self%node, self%pair_node, self%normal, &
                        self%weight, self%gain, self%friction, self%cohesive_force, self%slip_reference, self%gap_reference, &
                        self%cohesive%bonded, self%cohesive%rigid, self%cohesive%cap, self%cohesive%critical, &
                        self%cohesive%damage, self%mobility, self%counted, tolerance, warm, b, free_x, free_y, px, py, &
                        motion%fx, motion%fy, motion%ux, motion%uy, motion%wx, motion%wy, motion%vx, motion%vy, self%impulse, &
                        self%cohesive%impulse, self%cohesive%separation, self%force, self%jump, self%kick, self%partial)
   end subroutine step

   !> Groups that are swept, block by block.
   subroutine list_swept(self, is_direct)
      class(contact_t), intent(inout) :: self
      !> of each group: it is a pair that is solved at once
      logical, intent(in) :: is_direct(:)
      integer, allocatable :: group(:), home(:), order(:)
      integer :: g, i
      group = pack([(g, g=1, self%n_groups)], .not. is_direct)
      allocate (home(size(group)))
      do i = 1, size(group)
         home(i) = block_of(minval(self%pair(1, self%group_pair(group(i)):self%group_pair(group(i) + 1) - 1)))
      end do
      allocate (order, source=sorted_order(int(home, i8)))
      self%blocks%swept_first = starts(home, self%blocks%n)
      self%blocks%swept = group(order)
   end subroutine list_swept

   !> Contact nodes block by block.
   subroutine list_nodes(self)
      class(contact_t), intent(inout) :: self
      integer, allocatable :: next(:)
      integer :: c, k
      associate (blocks => self%blocks)
         blocks%node_first = starts(block_of(self%node(:self%n_nodes)), blocks%n)
         next = blocks%node_first
         call grow(blocks%node, self%n_nodes)
         do c = 1, self%n_nodes
            k = block_of(self%node(c))
            blocks%node(next(k)) = self%node(c)
            next(k) = next(k) + 1
         end do
      end associate
   end subroutine list_nodes

   !> Where the items of each block begin in a list of them block by block, (blocks + 1).
   pure function starts(home, n_blocks)
      !> block of each item, in any order
      integer, intent(in) :: home(:), n_blocks
      integer, allocatable :: starts(:)
      integer :: i, k
      allocate (starts(n_blocks + 1), source=0)
      do i = 1, size(home)
         starts(home(i) + 1) = starts(home(i) + 1) + 1
      end do
      starts(1) = 1
      do k = 1, n_blocks
         starts(k + 1) = starts(k) + starts(k + 1)
      end do
   end function starts

   !> Which groups are swept one by one, and which side by side: those of a block that have equally many pairs.
   subroutine list_bundles(self)
      class(contact_t), intent(inout) :: self
      logical, allocatable :: fits(:)
      integer, allocatable :: group(:), home(:), order(:), home_of_bundle(:)
      integer :: i, n, next
      associate (blocks => self%blocks)
         allocate (fits(size(blocks%swept)), home(size(blocks%swept)))
         do n = 1, blocks%n
            home(blocks%swept_first(n):blocks%swept_first(n + 1) - 1) = n
         end do
         do i = 1, size(blocks%swept)
            fits(i) = fits_bundle(self, blocks%swept(i))
         end do
         blocks%single = pack(blocks%swept, .not. fits)
         blocks%single_first = starts(pack(home, .not. fits), blocks%n)
         group = pack(blocks%swept, fits)
         home = pack(home, fits)
         allocate (order, source=sorted_order([(place_of(self, home(i), group(i)), i=1, size(group))]))
         allocate (home_of_bundle(size(group)))
         n = 0
         i = 1
         do while (i <= size(group))
            next = i + 1
            do while (next <= min(size(group), i + lanes - 1))
               if (home(order(next)) /= home(order(i))) exit
               if (pairs_of(self, group(order(next))) /= pairs_of(self, group(order(i)))) exit
               next = next + 1
            end do
            n = n + 1
            home_of_bundle(n) = home(order(i))
            call put_bundle(self, n, group(order(i:next - 1)))
            i = next
         end do
         blocks%bundle_first = starts(home_of_bundle(:n), blocks%n)
      end associate
   end subroutine list_bundles

   !> Where a group stands among those of its block, ascending: beside others with as many pairs, and as many that are pressed, as
   !> these take many sweeps, and a bundle as many as the slowest of its groups.
   pure integer(i8) function place_of(self, home, group) result(place)
      class(contact_t), intent(in) :: self
      !> block of the group
      integer, intent(in) :: home, group
      integer :: pressed
      pressed = count(self%impulse(1, self%group_pair(group):self%group_pair(group + 1) - 1) > 0)
      place = ((most_bundled + 1)*int(home, i8) + pairs_of(self, group))*(most_bundled + 1) + pressed
   end function place_of

   !> Pairs of a group.
   pure integer function pairs_of(self, group)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: group
      pairs_of = self%group_pair(group + 1) - self%group_pair(group)
   end function pairs_of

   !> Whether a group may be swept beside others: nothing of it softens, and its nodes are free or held in both directions.
   pure logical function fits_bundle(self, group) result(fits)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: group
      fits = group > self%n_lone .and. pairs_of(self, group) <= most_bundled
      if (.not. fits) return
      associate (mobility => self%mobility(:, self%group_node(group):self%group_node(group + 1) - 1))
         fits = .not. any(abs(mobility(1, :) - mobility(2, :)) > 0)
      end associate
      fits = fits .and. .not. any(self%cohesive%bonded(self%group_pair(group):self%group_pair(group + 1) - 1))
   end function fits_bundle

   !> Write a bundle behind those before it.
   subroutine put_bundle(self, bundle, group)
      class(contact_t), intent(inout) :: self
      !> its number; its groups, of equally many pairs, no more than there are lanes
      integer, intent(in) :: bundle, group(:)
      integer :: n, slot, entry, lane, k, r, p, first
      real(wp) :: of_pair(n_properties)
      n = pairs_of(self, group(1))
      associate (blocks => self%blocks)
         slot = 1
         entry = 1
         if (bundle > 1) then
            slot = blocks%bundle_slot(bundle - 1) + blocks%bundle_pairs(bundle - 1)
            entry = blocks%bundle_entry(bundle - 1) + blocks%bundle_pairs(bundle - 1)**2
         end if
         call make_bundle_room(blocks, bundle, slot + n - 1, entry + n*n - 1)
         blocks%bundle_pairs(bundle) = n
         blocks%bundle_groups(bundle) = size(group)
         blocks%bundle_slot(bundle) = slot
         blocks%bundle_entry(bundle) = entry
         do lane = 1, lanes
            first = self%group_pair(group(merge(lane, 1, lane <= size(group))))
            do k = 1, n
               p = first + k - 1
               blocks%slot_pair(lane, slot + k - 1) = p
               blocks%slot_node(2*lane - 1:2*lane, slot + k - 1) = self%pair(:, p)
               of_pair = properties(self, p)
               blocks%slot(lane::lanes, slot + k - 1) = of_pair(:n_bundled_properties)
               do r = 1, n
                  call couple(self, first + r - 1, p, blocks%along(lane, entry + (k - 1)*n + r - 1), &
                              blocks%across(lane, entry + (k - 1)*n + r - 1))
               end do
            end do
         end do
      end associate
   end subroutine put_bundle

   subroutine make_bundle_room(blocks, bundles, slots, entries)
      type(contact_blocks_t), intent(inout) :: blocks
      integer, intent(in) :: bundles, slots, entries
      call grow(blocks%bundle_pairs, bundles)
      call grow(blocks%bundle_groups, bundles)
      call grow(blocks%bundle_slot, bundles)
      call grow(blocks%bundle_entry, bundles)
      call grow(blocks%slot_pair, slots, lanes)
      call grow(blocks%slot_node, slots, 2*lanes)
      call grow(blocks%slot, slots, lanes*n_bundled_properties)
      call grow(blocks%along, entries, lanes)
      call grow(blocks%across, entries, lanes)
   end subroutine make_bundle_room

   !> What unit impulses of pair q change of gap and slip of pair p of its group: of the normal one the gap (along) and the
   !> slip (across), of the tangential one the slip (along) and the gap (-across).
   pure subroutine couple(self, p, q, along, across)
      class(contact_t), intent(in) :: self
      integer, intent(in) :: p, q
      !> [length/impulse]
      real(wp), intent(out) :: along, across
      real(wp) :: m
      integer :: i, j
      m = 0
      do i = 1, 2
         do j = 1, 2
            if (self%pair_node(i, p) == self%pair_node(j, q)) m = m + merge(1, -1, i == j)*self%mobility(1, self%pair_node(i, p))
         end do
      end do
      along = m*dot_product(self%normal(:, p), self%normal(:, q))
      across = m*(self%normal(1, p)*self%normal(2, q) - self%normal(2, p)*self%normal(1, q))
   end subroutine couple

end submodule rf_contact_arrange
