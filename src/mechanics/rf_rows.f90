!> Node rows: the triangles turned into the paper's equation (4), f_i = sum_j K_ij (u_j - u_i) (theory: eq. 5), in blocks of
!> nodes whose rows lie in slices (rf_step_k). A split rebuilds the blocks of the nodes it touched, nothing else.
module rf_rows
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_sort, only: sorted_order
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, elements_around, corner_of, next_corner, sort_ascending
   use rf_material, only: material_t
   use rf_cst, only: gradients, stiffness_block, stiffness_skew
   use rf_step_k, only: block_size, lanes, slices
   implicit none
   private
   public :: rows_t

   !> safety of the fictitious mass over the Gershgorin bound of stability for dt = 1: m >= g/4 (theory: eq. 10)
   real(wp), parameter :: mass_factor = 1.05_wp/4.0_wp
   !> room for entries that a block gets when it must move
   real(wp), parameter :: block_margin = 1.25_wp
   !> part of the entries up to which those that are not symmetric are listed apart. Measured on three materials: each per cent
   !> of them costs 1.2 % of a step of 10,000 elements and 0.7 % of one of a million; the fourth coefficient 4 and 14 %.
   real(wp), parameter :: largest_skew_part = 0.1_wp
   !> numbers that a draft keeps of an entry
   integer, parameter :: parts = 5

   type :: rows_t
      integer :: n_blocks = 0
      !> first node and nodes of each block
      integer, allocatable :: first(:), count(:)
      !> first entry of each slice of each block, (slices + 1, block)
      integer, allocatable :: slice(:, :)
      !> node of each row, longest rows first; the last slice is filled up with the last node, (block_size, block)
      integer, allocatable :: order(:, :)
      !> neighbour of each entry; its stiffness [force/length], (lanes, entry)
      integer, allocatable :: column(:, :)
      real(wp), allocatable :: kxx(:, :), kxy(:, :), kyx(:, :), kyy(:, :)
      !> Elements of a section are all alike: then K_ij is symmetric across edges inside the body (theory: eq. 5a). Where few
      !> entries are not, kxy is the mean of kxy and kyx, kyx has size 0, and those entries stand in a list of their own.
      logical :: alike = .false.
      !> that list: first one and number of them in each block; node and neighbour, (2, list); half of kxy - kyx [force/length]
      integer, allocatable :: skew_start(:), skew_count(:), skew_edge(:, :)
      real(wp), allocatable :: skew(:)
      !> the row sums are kept: dynamic steps need them
      logical :: with_sums = .false.
      !> largest of the node's two Gershgorin row sums, summed over its elements [force/length], (nodes)
      real(wp), allocatable :: row_sum(:)
      !> 1/m of the fictitious mass m that makes every node just stable for dt = 1, (nodes)
      real(wp), allocatable :: inverse_mass(:)
      !> place and room of each block among the entries
      integer, allocatable, private :: start(:), room(:)
      !> room of each block in the list of entries that are not symmetric
      integer, allocatable, private :: skew_room(:)
      integer, private :: n_entries = 0, n_skew = 0, n_nodes = 0
   contains
      procedure :: build, update
      procedure, private :: build_row, place_block, place_skew, load_block, size_blocks
      procedure :: exchange
   end type rows_t

   !> rows of one block before they are laid out
   type :: draft_t
      integer :: valence(block_size) = 0
      !> neighbours of each node, (width, node)
      integer, allocatable :: column(:, :)
      !> xx, xy, yx, yy of their stiffness, and half of xy - yx as the list of entries that are not symmetric has it
      real(wp), allocatable :: k(:, :, :)
   end type draft_t

contains

   !> Rows of all nodes.
   subroutine build(self, mesh, material, alike)
      class(rows_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> list the entries that are not symmetric apart, where that is possible (absent: where it is faster)
      logical, intent(in), optional :: alike
      type(draft_t) :: draft
      integer, allocatable :: around(:)
      integer :: b, slot
      self%n_blocks = 0
      self%n_entries = 0
      self%n_skew = 0
      self%n_nodes = 0
      self%alike = .true.
      if (allocated(material%stiffness_factor)) &
         self%alike = all(abs(material%stiffness_factor(:mesh%n_elements) - material%stiffness_factor(1)) <= 0)
      if (present(alike)) then
         self%alike = self%alike .and. alike
      else if (self%alike) then
         self%alike = skew_part(mesh, material) <= largest_skew_part
      end if
      if (allocated(self%kyx)) deallocate (self%kyx)
      call grow(self%skew_edge, 0, 2)
      call grow(self%skew, 0)
      call self%size_blocks(mesh%n_nodes)
      call grow_entries(self, entries_of(mesh))
      allocate (draft%column(8, block_size), draft%k(parts, 8, block_size))
      do b = 1, self%n_blocks
         do slot = 1, self%count(b)
            call self%build_row(mesh, material, b, slot, draft, around)
         end do
         call self%place_block(b, draft)
      end do
   end subroutine build

   !> Part of the entries that are not symmetric, as long as elements of a section are all alike.
   real(wp) function skew_part(mesh, material)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      real(wp) :: skew(size(material%section))
      integer :: entries, skewed, e, k, s
      do s = 1, size(skew)
         skew(s) = material%section(s)%thickness*stiffness_skew(material%section(s)%law)
      end do
      entries = 0
      skewed = 0
      do e = 1, mesh%n_elements
         do k = 1, 3
            if (mesh%neighbour(k, e) == 0 .or. mesh%segment_at(k, e) > 0) then
               entries = entries + 2
               skewed = skewed + 2
            else
               entries = entries + 1
               if (abs(skew(mesh%section(e)) - skew(mesh%section(mesh%neighbour(k, e)))) > 0) skewed = skewed + 1
            end if
         end do
      end do
      skew_part = real(skewed, wp)/entries
   end function skew_part

   !> Entries that the rows of a whole mesh take; storage has room for them and no more until the first split.
   integer function entries_of(mesh) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: valence(:), order(:)
      integer :: e, k, base, last
      allocate (valence(mesh%n_nodes), source=0)
      do e = 1, mesh%n_elements
         do k = 1, 3
            if (mesh%neighbour(k, e) > e .and. mesh%segment_at(k, e) == 0) cycle         ! counted on the other side
            associate (from => mesh%connectivity(k, e), to => mesh%connectivity(next_corner(k), e))
               valence(from) = valence(from) + 1
               valence(to) = valence(to) + 1
            end associate
         end do
      end do
      n = 0
      do base = 1, mesh%n_nodes, block_size
         last = min(base + block_size - 1, mesh%n_nodes)
         order = sorted_order(-int(valence(base:last), i8))
         n = n + sum(valence(base - 1 + order(::lanes)))
      end do
   end function entries_of

   subroutine grow_entries(self, n)
      class(rows_t), intent(inout) :: self
      integer, intent(in) :: n
      call grow(self%column, n, lanes)
      call grow(self%kxx, n, lanes)
      call grow(self%kxy, n, lanes)
      call grow(self%kyx, merge(0, n, self%alike), lanes)
      call grow(self%kyy, n, lanes)
   end subroutine grow_entries

   !> Rebuild the rows of all nodes of changed elements; the other rows of their blocks are laid out anew as they are.
   subroutine update(self, mesh, material, changes)
      class(rows_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(changes_t), intent(in) :: changes
      type(draft_t) :: draft
      integer, allocatable :: node(:), around(:)
      integer :: n, i, block, before
      before = self%n_nodes
      call self%size_blocks(mesh%n_nodes)
      call changes%corners(mesh, node, n)
      allocate (draft%column(8, block_size), draft%k(parts, 8, block_size))
      do i = 1, n
         block = (node(i) - 1)/block_size + 1
         if (i == 1) then
            call self%load_block(block, before, draft)
         else if (block > (node(i - 1) - 1)/block_size + 1) then
            call self%load_block(block, before, draft)
         end if
         call self%build_row(mesh, material, block, node(i) - self%first(block) + 1, draft, around)
         if (i < n) then
            if ((node(i + 1) - 1)/block_size + 1 == block) cycle
         end if
         call self%place_block(block, draft)
      end do
   end subroutine update

   !> Divide the nodes into blocks of consecutive numbers; new nodes fill the last block, then start new ones.
   subroutine size_blocks(self, n_nodes)
      class(rows_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      integer :: b, n
      n = (n_nodes - 1)/block_size + 1
      call grow(self%first, n)
      call grow(self%count, n)
      call grow(self%start, n)
      call grow(self%room, n)
      call grow(self%skew_start, n)
      call grow(self%skew_count, n)
      call grow(self%skew_room, n)
      call grow(self%slice, n, slices + 1)
      call grow(self%order, n, block_size)
      if (self%with_sums) call grow(self%row_sum, n_nodes)
      call grow(self%inverse_mass, n_nodes)
      do b = max(1, self%n_blocks), n
         if (b > self%n_blocks) then
            self%first(b) = (b - 1)*block_size + 1
            self%room(b) = 0
            self%skew_start(b) = 1
            self%skew_count(b) = 0
            self%skew_room(b) = 0
         end if
         self%count(b) = min(block_size, n_nodes - self%first(b) + 1)
      end do
      self%n_blocks = n
      self%n_nodes = n_nodes
   end subroutine size_blocks

   !> Row of one node from the elements round it.
   subroutine build_row(self, mesh, material, block, slot, draft, around)
      class(rows_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: block, slot
      type(draft_t), intent(inout) :: draft
      !> list to work on
      integer, allocatable, intent(inout) :: around(:)
      integer :: n, node, i
      real(wp) :: sums(2)
      node = self%first(block) + slot - 1
      draft%valence(slot) = 0
      sums = 0
      call elements_around(mesh, node, around, n)
      call sort_ascending(around(:n))        ! sums do not depend on where the walk round the node began
      do i = 1, n
         call add_element(draft, slot, mesh, material, around(i), node, sums)
      end do
      call sort_row(draft, slot)
      if (self%alike) draft%k(2, :draft%valence(slot), slot) = 0.5_wp*(draft%k(2, :draft%valence(slot), slot) &
                                                                       + draft%k(3, :draft%valence(slot), slot))
      if (self%with_sums) self%row_sum(node) = maxval(sums)
      self%inverse_mass(node) = 1/(mass_factor*maxval(sums))
   end subroutine build_row

   !> The rows of a block as they lie in their slices.
   subroutine load_block(self, block, n_nodes, draft)
      class(rows_t), intent(in) :: self
      integer, intent(in) :: block
      !> nodes that had rows when the block was laid out
      integer, intent(in) :: n_nodes
      type(draft_t), intent(inout) :: draft
      integer :: row, lane, s, p, i, slot
      do row = 1, min(block_size, n_nodes - self%first(block) + 1)
         s = (row - 1)/lanes + 1
         lane = row - (s - 1)*lanes
         slot = self%order(row, block) - self%first(block) + 1
         i = 0
         do p = self%slice(s, block), self%slice(s + 1, block) - 1
            if (self%column(lane, p) == self%order(row, block)) exit        ! the rest fills the slice up
            i = i + 1
            if (i > size(draft%column, 1)) call widen(draft, 2*i)
            draft%column(i, slot) = self%column(lane, p)
            draft%k(1, i, slot) = self%kxx(lane, p)
            draft%k(2, i, slot) = self%kxy(lane, p)
            if (.not. self%alike) draft%k(3, i, slot) = self%kyx(lane, p)
            draft%k(4, i, slot) = self%kyy(lane, p)
            draft%k(5, i, slot) = 0
         end do
         draft%valence(slot) = i
      end do
      do p = self%skew_start(block), self%skew_start(block) + self%skew_count(block) - 1
         slot = self%skew_edge(1, p) - self%first(block) + 1
         do i = 1, draft%valence(slot)
            if (draft%column(i, slot) == self%skew_edge(2, p)) draft%k(5, i, slot) = self%skew(p)
         end do
      end do
   end subroutine load_block

   !> Add an element's stiffness to the row of one of its nodes.
   subroutine add_element(draft, slot, mesh, material, element, node, sums)
      type(draft_t), intent(inout) :: draft
      integer, intent(in) :: slot
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: element, node
      !> Gershgorin sums of the node's two directions
      real(wp), intent(inout) :: sums(2)
      real(wp) :: g(2, 3), area, factor, skew, k(2, 2), own(2, 2)
      integer :: c, other, s
      call gradients(mesh%x(:, mesh%connectivity(:, element)), g, area)
      c = corner_of(mesh, element, node)
      s = mesh%section(element)
      factor = area*material%section(s)%thickness*material%stiffness_of(element)
      skew = material%section(s)%thickness*material%stiffness_of(element)*stiffness_skew(material%section(s)%law)
      own = 0
      do other = 1, 3
         if (other == c) cycle
         k = factor*stiffness_block(material%section(s)%law, g(:, c), g(:, other))
         own = own - k
         sums = sums + abs(k(:, 1)) + abs(k(:, 2))
         call add_entry(draft, slot, mesh%connectivity(other, element), k, merge(skew, -skew, other == next_corner(c)))
      end do
      sums = sums + abs(own(:, 1)) + abs(own(:, 2))
   end subroutine add_element

   !> Add a stiffness to the entry of a neighbour, new or known.
   subroutine add_entry(draft, slot, column, k, skew)
      type(draft_t), intent(inout) :: draft
      integer, intent(in) :: slot, column
      real(wp), intent(in) :: k(2, 2), skew
      integer :: i, n
      n = draft%valence(slot)
      do i = 1, n
         if (draft%column(i, slot) == column) exit
      end do
      if (i > n) then
         if (i > size(draft%column, 1)) call widen(draft, 2*i)
         draft%valence(slot) = i
         draft%column(i, slot) = column
         draft%k(:, i, slot) = 0
      end if
      draft%k(:, i, slot) = draft%k(:, i, slot) + [k(1, 1), k(1, 2), k(2, 1), k(2, 2), skew]
   end subroutine add_entry

   !> Room for more neighbours in every row of the draft.
   subroutine widen(draft, width)
      type(draft_t), intent(inout) :: draft
      integer, intent(in) :: width
      integer, allocatable :: column(:, :)
      real(wp), allocatable :: k(:, :, :)
      integer :: old
      old = size(draft%column, 1)
      allocate (column(width, block_size), k(parts, width, block_size))
      column(:old, :) = draft%column
      k(:, :old, :) = draft%k
      call move_alloc(column, draft%column)
      call move_alloc(k, draft%k)
   end subroutine widen

   !> Neighbours in ascending order: the row does not depend on where a walk round the node began.
   subroutine sort_row(draft, slot)
      type(draft_t), intent(inout) :: draft
      integer, intent(in) :: slot
      integer :: i, j, column
      real(wp) :: k(parts)
      do i = 2, draft%valence(slot)
         column = draft%column(i, slot)
         k = draft%k(:, i, slot)
         do j = i - 1, 1, -1
            if (draft%column(j, slot) <= column) exit
            draft%column(j + 1, slot) = draft%column(j, slot)
            draft%k(:, j + 1, slot) = draft%k(:, j, slot)
         end do
         draft%column(j + 1, slot) = column
         draft%k(:, j + 1, slot) = k
      end do
   end subroutine sort_row

   !> Lay a block's rows out in slices.
   subroutine place_block(self, block, draft)
      class(rows_t), intent(inout) :: self
      integer, intent(in) :: block
      type(draft_t), intent(in) :: draft
      integer :: slot(block_size), n, s, k, p, depth
      n = self%count(block)
      slot(:n) = sorted_order(-int(draft%valence(:n), i8))
      slot(n + 1:) = slot(n)
      self%order(:, block) = self%first(block) - 1 + slot
      call reserve(sum(draft%valence(slot(1:n:lanes))))
      p = self%start(block)
      do s = 1, (n - 1)/lanes + 1
         self%slice(s, block) = p
         depth = draft%valence(slot((s - 1)*lanes + 1))
         do k = 1, lanes
            call fill_lane(k, p, depth, (s - 1)*lanes + k)
         end do
         p = p + depth
      end do
      self%slice((n - 1)/lanes + 2:, block) = p
      if (self%alike) call self%place_skew(block, draft)

   contains

      !> One row of a slice. Beyond its length, and in lanes beyond the last row, the node itself without stiffness.
      subroutine fill_lane(lane, from, depth, row)
         integer, intent(in) :: lane, from, depth, row
         integer :: d, i, length
         i = slot(row)
         length = draft%valence(i)
         if (row > n) length = 0
         do d = 1, depth
            self%column(lane, from + d - 1) = self%order(row, block)
            self%kxx(lane, from + d - 1) = 0
            self%kxy(lane, from + d - 1) = 0
            if (.not. self%alike) self%kyx(lane, from + d - 1) = 0
            self%kyy(lane, from + d - 1) = 0
            if (d > length) cycle
            self%column(lane, from + d - 1) = draft%column(d, i)
            self%kxx(lane, from + d - 1) = draft%k(1, d, i)
            self%kxy(lane, from + d - 1) = draft%k(2, d, i)
            if (.not. self%alike) self%kyx(lane, from + d - 1) = draft%k(3, d, i)
            self%kyy(lane, from + d - 1) = draft%k(4, d, i)
         end do
      end subroutine fill_lane

      !> A block whose entries no longer fit moves to the end of the storage, with a margin.
      subroutine reserve(entries)
         integer, intent(in) :: entries
         integer :: needed
         if (entries <= self%room(block)) return
         needed = entries
         if (self%room(block) > 0) needed = int(block_margin*entries)
         self%start(block) = self%n_entries + 1
         self%room(block) = needed
         self%n_entries = self%n_entries + needed
         call grow_entries(self, self%n_entries)
      end subroutine reserve

   end subroutine place_block

   !> List a block's entries that are not symmetric.
   subroutine place_skew(self, block, draft)
      class(rows_t), intent(inout) :: self
      integer, intent(in) :: block
      type(draft_t), intent(in) :: draft
      integer :: slot, i, p, n
      n = 0
      do slot = 1, self%count(block)
         n = n + count(abs(draft%k(5, :draft%valence(slot), slot)) > 0)
      end do
      if (n > self%skew_room(block)) then
         if (self%skew_room(block) > 0) n = int(block_margin*n)
         self%skew_start(block) = self%n_skew + 1
         self%skew_room(block) = n
         self%n_skew = self%n_skew + n
         call grow(self%skew_edge, self%n_skew, 2)
         call grow(self%skew, self%n_skew)
      end if
      p = self%skew_start(block)
      do slot = 1, self%count(block)
         do i = 1, draft%valence(slot)
            if (.not. abs(draft%k(5, i, slot)) > 0) cycle
            self%skew_edge(:, p) = [self%first(block) - 1 + slot, draft%column(i, slot)]
            self%skew(p) = draft%k(5, i, slot)
            p = p + 1
         end do
      end do
      self%skew_count(block) = p - self%skew_start(block)
   end subroutine place_skew

   !> To or from a checkpoint. All of it: rows that followed splits lie in another order than rows built anew.
   subroutine exchange(self, archive)
      class(rows_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n_blocks', self%n_blocks)
      call archive%exchange('first', self%first)
      call archive%exchange('count', self%count)
      call archive%exchange('slice', self%slice)
      call archive%exchange('order', self%order)
      call archive%exchange('column', self%column)
      call archive%exchange('kxx', self%kxx)
      call archive%exchange('kxy', self%kxy)
      call archive%exchange('kyx', self%kyx)
      call archive%exchange('kyy', self%kyy)
      call archive%exchange('with_sums', self%with_sums)
      call archive%exchange('row_sum', self%row_sum)
      call archive%exchange('inverse_mass', self%inverse_mass)
      call archive%exchange('start', self%start)
      call archive%exchange('room', self%room)
      call archive%exchange('alike', self%alike)
      call archive%exchange('skew_start', self%skew_start)
      call archive%exchange('skew_count', self%skew_count)
      call archive%exchange('skew_edge', self%skew_edge)
      call archive%exchange('skew', self%skew)
      call archive%exchange('skew_room', self%skew_room)
      call archive%exchange('n_skew', self%n_skew)
      call archive%exchange('n_entries', self%n_entries)
      call archive%exchange('n_nodes', self%n_nodes)
   end subroutine exchange

end module rf_rows
