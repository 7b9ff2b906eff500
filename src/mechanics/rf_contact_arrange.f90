!> What the kernels must know of the pairs beside: which of them each block of nodes solves at once, which groups it sweeps,
!> and how the impulses of a group act on each other.
submodule(rf_contact) rf_contact_arrange
   use rf_step_k, only: block_size, lanes
   use rf_contact_k, only: most_coupled
   use rf_direct_pair_k, only: n_direct, direct_normal, direct_gain, direct_friction, direct_cohesion, direct_slip, direct_gap, &
      direct_mobility, direct_residual, direct_reaction
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
      call make_sums(self%partial, self%blocks%n)
      allocate (is_direct(self%n_groups), source=.false.)
      do p = 1, self%n_lone
         is_direct(p) = all(free_x(self%pair(:, p)) == free_y(self%pair(:, p))) .and. .not. self%cohesive%bonded(p)
      end do
      call list_direct(self, is_direct(:self%n_lone))
      call list_swept(self, is_direct)
      call list_touching(self)
      call couple(self)
   end subroutine arrange

   subroutine make_sums(sums, n_blocks)
      real(wp), allocatable, intent(inout) :: sums(:, :)
      integer, intent(in) :: n_blocks
      if (allocated(sums)) then
         if (size(sums, 2) /= n_blocks) deallocate (sums)
      end if
      if (.not. allocated(sums)) allocate (sums(2, n_blocks))
      sums = 0
   end subroutine make_sums

   !> Block of a node.
   elemental integer function block_of(node)
      integer, intent(in) :: node
      block_of = (node - 1)/block_size + 1
   end function block_of

   !> Pairs that are solved at once, block by block; in each those first whose nodes both lie in it.
   subroutine list_direct(self, is_direct)
      class(contact_t), intent(inout) :: self
      !> of the pairs that share no node; these stand in the order of their lower nodes
      logical, intent(in) :: is_direct(:)
      integer, allocatable :: home(:), away(:)
      integer :: p, d, k
      home = block_of(self%pair(1, :self%n_lone))
      away = block_of(self%pair(2, :self%n_lone))
      associate (blocks => self%blocks)
         blocks%direct_first = starts(pack(home, is_direct), blocks%n)
         blocks%direct_outer = starts(pack(home, is_direct .and. home == away), blocks%n)
         blocks%direct_outer = blocks%direct_first(:blocks%n) + blocks%direct_outer(2:) - blocks%direct_outer(:blocks%n)
         d = count(is_direct)
         call make_room(blocks, d)
         p = 1
         do k = 1, blocks%n
            d = blocks%direct_first(k)
            call take(k, same=.true.)
            call take(k, same=.false.)
            do while (p <= self%n_lone)
               if (home(p) > k) exit
               p = p + 1
            end do
         end do
      end associate

   contains

      !> The pairs from p on that have their lower node in a block, and the other in the same or in another one.
      subroutine take(block, same)
         integer, intent(in) :: block
         logical, intent(in) :: same
         integer :: q
         do q = p, self%n_lone
            if (home(q) > block) exit
            if (.not. is_direct(q) .or. ((away(q) == block) .neqv. same)) cycle
            self%blocks%direct_pair(d) = q
            self%blocks%direct_node(:, d) = self%pair(:, q)
            self%blocks%direct(:, d) = properties(self, q)
            d = d + 1
         end do
      end subroutine take

   end subroutine list_direct

   !> Room for direct pairs.
   subroutine make_room(blocks, n)
      type(contact_blocks_t), intent(inout) :: blocks
      integer, intent(in) :: n
      call grow(blocks%direct_pair, n)
      call grow(blocks%direct_node, n, 2)
      call grow(blocks%direct, n, n_direct)
   end subroutine make_room

   !> What a pair that is solved at once is, see n_direct.
   pure function properties(self, p) result(direct)
      class(contact_t), intent(in) :: self
      !> pair that shares no node
      integer, intent(in) :: p
      real(wp) :: direct(n_direct)
      integer :: c(2)
      c = self%pair_node(:, p)
      direct(direct_normal:direct_normal + 1) = self%normal(:, p)
      direct(direct_gain:direct_gain + 1) = self%gain(:, p)
      direct(direct_friction) = self%friction(p)
      direct(direct_cohesion) = self%cohesive_force(p)
      direct(direct_slip) = self%slip_reference(p)
      direct(direct_gap) = self%gap_reference(p)
      direct(direct_mobility:direct_mobility + 1) = self%mobility(1, c)
      direct(direct_residual:direct_residual + 1) = self%counted(1, c)
      direct(direct_reaction:direct_reaction + 1) = self%counted(2, c)
   end function properties

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
   subroutine list_touching(self)
      class(contact_t), intent(inout) :: self
      integer, allocatable :: next(:)
      integer :: c, k
      associate (blocks => self%blocks)
         blocks%touching_first = starts(block_of(self%node(:self%n_nodes)), blocks%n)
         next = blocks%touching_first
         call grow(blocks%touching, self%n_nodes)
         do c = 1, self%n_nodes
            k = block_of(self%node(c))
            blocks%touching(next(k)) = self%node(c)
            next(k) = next(k) + 1
         end do
      end associate
   end subroutine list_touching

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

   !> What unit impulses change of the gaps and slips of the pairs of their group, for connected groups without softening
   !> pairs whose nodes are equally free in both directions.
   subroutine couple(self)
      type(contact_t), intent(inout) :: self
      integer :: g, columns, vectors, n, p, q, first
      if (allocated(self%group_column)) deallocate (self%group_column)
      allocate (self%group_column(self%n_groups), source=0)
      columns = 0
      do g = self%n_lone + 1, self%n_groups
         n = self%group_pair(g + 1) - self%group_pair(g)
         if (n > most_coupled .or. any(self%cohesive%bonded(self%group_pair(g):self%group_pair(g + 1) - 1))) cycle
         associate (mobility => self%mobility(:, self%group_node(g):self%group_node(g + 1) - 1))
            if (any(abs(mobility(1, :) - mobility(2, :)) > 0)) cycle
         end associate
         vectors = (2*n - 1)/lanes + 1
         self%group_column(g) = columns + 1
         call grow(self%coupling, columns + 2*n*vectors, lanes)
         self%coupling(:, columns + 1:columns + 2*n*vectors) = 0
         first = self%group_pair(g)
         do q = 0, n - 1
            do p = 0, n - 1
               call add(2*p + 1, columns + 2*q*vectors, acted(first + p, first + q))
            end do
         end do
         columns = columns + 2*n*vectors
      end do
      if (.not. allocated(self%coupling)) allocate (self%coupling(lanes, 0))

   contains

      !> Entries of a pair (row: its gap) in the two columns of another.
      subroutine add(row, column, entries)
         integer, intent(in) :: row, column
         real(wp), intent(in) :: entries(2, 2)
         integer :: c, r, v
         do c = 1, 2
            do r = 1, 2
               v = column + (c - 1)*vectors + (row + r - 2)/lanes + 1
               self%coupling(mod(row + r - 2, lanes) + 1, v) = entries(r, c)
            end do
         end do
      end subroutine add

      !> Gap and slip of pair p by unit impulses, normal and tangential, of pair q.
      pure function acted(p, q)
         integer, intent(in) :: p, q
         real(wp) :: acted(2, 2), m
         integer :: i, j
         m = 0
         do i = 1, 2
            do j = 1, 2
               if (self%pair_node(i, p) == self%pair_node(j, q)) &
                  m = m + merge(1, -1, i == j)*self%mobility(1, self%pair_node(i, p))
            end do
         end do
         acted(1, 1) = m*dot_product(self%normal(:, p), self%normal(:, q))
         acted(2, 2) = acted(1, 1)
         acted(2, 1) = m*(self%normal(1, p)*self%normal(2, q) - self%normal(2, p)*self%normal(1, q))
         acted(1, 2) = -acted(2, 1)
      end function acted

   end subroutine couple

end submodule rf_contact_arrange
