!> How the pairs follow a split: those of the groups that it has touched are found anew and take their places among the others,
!> which only move. What grows with the number of pairs is one pass over their nodes and the moving of memory.
submodule(rf_contact) rf_contact_follow
   use rf_sort, only: ascending_once
   use rf_move, only: runs_t, move
   use rf_topology, only: elements_around, previous_corner, side_nodes
   implicit none

   !> places of the sieve through which nodes pass that a split may have touched, a power of two
   integer, parameter :: sieve = 4096

   !> What takes which place.
   type :: places_t
      !> pairs that share no node, and groups of those that do (counted from the first such), of before
      type(runs_t) :: lone, group
      !> place among them of each new one
      integer, allocatable :: new_lone(:), new_group(:)
   end type places_t

contains

   module subroutine follow(self, mesh, material, motion, changes)
      class(contact_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      type(changes_t), intent(in) :: changes
      type(contact_t) :: old, new
      integer, allocatable :: nodes(:), group(:)
      integer :: n, g, p
      call changes%corners(mesh, nodes, n)
      nodes = nodes(:n)
      call find_touched(self, nodes, group)
      call old%take_pairs(self, [((p, p=self%group_pair(group(g)), self%group_pair(group(g) + 1) - 1), g=1, size(group))])
      nodes = ascending_once([nodes, old%pair])
      call collect_around(new, mesh, material, nodes)
      call new%group_pairs()
      call new%inherit_pairs(old, motion, changes)
      call replace_groups(self, group, new)
   end subroutine follow

   !> Groups that have one of some nodes, ascending.
   subroutine find_touched(self, nodes, group)
      type(contact_t), intent(in) :: self
      !> ascending
      integer, intent(in) :: nodes(:)
      integer, allocatable, intent(out) :: group(:)
      logical :: passes(0:sieve - 1)
      integer :: p, g, n
      passes = .false.
      do p = 1, size(nodes)
         passes(iand(nodes(p), sieve - 1)) = .true.
      end do
      allocate (group(16))
      n = 0
      do p = 1, self%n_pairs
         if (.not. (passes(iand(self%pair(1, p), sieve - 1)) .or. passes(iand(self%pair(2, p), sieve - 1)))) cycle
         if (.not. (has(nodes, self%pair(1, p)) .or. has(nodes, self%pair(2, p)))) cycle
         g = p
         if (p > self%n_lone) g = group_of(self, p)
         if (n > 0) then
            if (group(n) == g) cycle
         end if
         n = n + 1
         call grow(group, n)
         group(n) = g
      end do
      group = group(:n)
   end subroutine find_touched

   !> Whether an ascending list has a number.
   pure logical function has(list, number)
      integer, intent(in) :: list(:), number
      integer :: low, high, middle
      low = 1
      high = size(list)
      do while (low < high)
         middle = (low + high)/2
         if (list(middle) < number) then
            low = middle + 1
         else
            high = middle
         end if
      end do
      has = .false.
      if (low <= size(list)) has = list(low) == number
   end function has

   !> Group of a pair that shares nodes.
   pure integer function group_of(self, p) result(low)
      type(contact_t), intent(in) :: self
      integer, intent(in) :: p
      integer :: high, middle
      low = self%n_lone + 1
      high = self%n_groups
      do while (low < high)
         middle = (low + high + 1)/2
         if (self%group_pair(middle) <= p) then
            low = middle
         else
            high = middle - 1
         end if
      end do
   end function group_of

   !> The pairs that have one of some nodes, from all their segments.
   subroutine collect_around(self, mesh, material, nodes)
      type(contact_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> ascending
      integer, intent(in) :: nodes(:)
      integer(i8), allocatable :: key(:)
      integer, allocatable :: segments(:), segment_of(:)
      integer :: i, j, n, ends(2, 2)
      call segments_at(mesh, nodes, segments)
      allocate (key(2*size(segments)), segment_of(2*size(segments)))
      n = 0
      do j = 1, size(segments)
         ends = side_nodes(mesh, segments(j))
         do i = 1, 2
            if (ends(i, 1) == ends(i, 2)) cycle
            if (.not. (has(nodes, ends(i, 1)) .or. has(nodes, ends(i, 2)))) cycle
            n = n + 1
            key(n) = self%pair_key(ends(i, 1), ends(i, 2))
            segment_of(n) = segments(j)
         end do
      end do
      call self%join_ends(mesh, material, key(:n), segment_of(:n))
   end subroutine collect_around

   !> Segments that begin or end at some nodes, ascending, each once.
   subroutine segments_at(mesh, nodes, segments)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: nodes(:)
      integer, allocatable, intent(out) :: segments(:)
      integer, allocatable :: around(:)
      integer :: i, j, k, s, n_around, n
      allocate (segments(64))
      n = 0
      do i = 1, size(nodes)
         call elements_around(mesh, nodes(i), around, n_around)
         do j = 1, n_around
            do k = 1, 3
               s = mesh%segment_at(k, around(j))
               if (s == 0 .or. mesh%connectivity(previous_corner(k), around(j)) == nodes(i)) cycle
               n = n + 1
               call grow(segments, n)
               segments(n) = s
            end do
         end do
      end do
      segments = ascending_once(segments(:n))
   end subroutine segments_at

   !> New groups take the place of old ones, in the order in which rebuild has them all: pairs that share no node by their
   !> keys, then groups by their lowest.
   subroutine replace_groups(self, gone, new)
      type(contact_t), intent(inout) :: self
      !> old groups that are no more, ascending
      integer, intent(in) :: gone(:)
      !> pairs that come, with their groups
      type(contact_t), intent(in) :: new
      type(places_t) :: places
      type(runs_t) :: pairs, linked, nodes
      !> first pair and node of each new group of pairs that share nodes; how far pairs and nodes of the others move
      integer, allocatable :: first(:, :), offset(:, :)
      !> place of each new pair
      integer, allocatable :: place(:)
      integer :: n_lone, n_groups, n_pairs, n_nodes, i
      call find_places(self, gone, new, places)
      n_lone = self%n_lone - count(gone <= self%n_lone) + new%n_lone
      n_groups = self%n_groups - size(gone) + new%n_groups
      pairs = places%lone
      call places%lone%scale(2, nodes)
      call find_linked(self, places, n_lone, new, linked, nodes, first, offset)
      do i = 1, linked%n
         call pairs%add(linked%run(1, i), linked%run(2, i), linked%run(3, i))
      end do
      n_pairs = self%n_pairs + new%n_pairs
      n_nodes = self%n_nodes + new%n_nodes
      do i = 1, size(gone)
         n_pairs = n_pairs - (self%group_pair(gone(i) + 1) - self%group_pair(gone(i)))
         n_nodes = n_nodes - (self%group_node(gone(i) + 1) - self%group_node(gone(i)))
      end do
      place = places_of_new(new, places%new_lone, first)
      call self%reserve_pairs(max(n_pairs, self%n_pairs))
      call merge_keys(self, linked, n_pairs - n_lone, new, place)
      call shift_pairs(self, pairs)
      call shift_groups(self, places%group, linked, nodes, offset, n_lone, n_groups)
      self%n_lone = n_lone
      self%n_pairs = n_pairs
      self%n_groups = n_groups
      self%n_nodes = n_nodes
      self%group_pair(n_groups + 1) = n_pairs + 1
      self%group_node(n_groups + 1) = n_nodes + 1
      call put_pairs(self, new, place, places%new_group, first)
   end subroutine replace_groups

   !> Where what stays goes, and what comes.
   subroutine find_places(self, gone, new, places)
      type(contact_t), intent(in) :: self, new
      integer, intent(in) :: gone(:)
      type(places_t), intent(out) :: places
      integer, allocatable :: before(:)
      integer :: g
      allocate (before(new%n_lone))
      do g = 1, new%n_lone
         before(g) = self%lone_before(self%pair_key(new%pair(1, g), new%pair(2, g))) + 1
      end do
      call merge_lists(self%n_lone, pack(gone, gone <= self%n_lone), before, places%lone, places%new_lone)
      deallocate (before)
      allocate (before(new%n_groups - new%n_lone))
      do g = new%n_lone + 1, new%n_groups
         before(g - new%n_lone) = group_after(self, key_of(new, g)) - self%n_lone
      end do
      call merge_lists(self%n_groups - self%n_lone, pack(gone, gone > self%n_lone) - self%n_lone, before, places%group, &
                       places%new_group)
   end subroutine find_places

   !> Lowest key of a group: that of its first pair.
   pure integer(i8) function key_of(self, group)
      type(contact_t), intent(in) :: self
      integer, intent(in) :: group
      key_of = self%pair_key(self%pair(1, self%group_pair(group)), self%pair(2, self%group_pair(group)))
   end function key_of

   !> The first group of pairs that share nodes whose lowest key is above another.
   pure integer function group_after(self, key) result(low)
      type(contact_t), intent(in) :: self
      integer(i8), intent(in) :: key
      integer :: high, middle
      low = self%n_lone + 1
      high = self%n_groups + 1
      do while (low < high)
         middle = (low + high)/2
         if (key_of(self, middle) <= key) then
            low = middle + 1
         else
            high = middle
         end if
      end do
   end function group_after

   !> Take entries out of a list and put new ones before others.
   subroutine merge_lists(n, gone, before, runs, place)
      !> entries of the list
      integer, intent(in) :: n
      !> those that go; those before which a new one comes (n + 1: at the end), both ascending
      integer, intent(in) :: gone(:), before(:)
      !> how what stays moves
      type(runs_t), intent(out) :: runs
      !> where the new ones are
      integer, allocatable, intent(out) :: place(:)
      integer :: from, to, stop_at, i, j
      call runs%clear()
      allocate (place(size(before)))
      from = 1
      to = 1
      i = 1
      j = 1
      do
         stop_at = n + 1
         if (i <= size(gone)) stop_at = min(stop_at, gone(i))
         if (j <= size(before)) stop_at = min(stop_at, max(from, before(j)))
         call runs%add(from, to, stop_at - from)
         to = to + stop_at - from
         from = stop_at
         if (j <= size(before)) then
            if (before(j) <= stop_at) then
               place(j) = to
               to = to + 1
               j = j + 1
               cycle
            end if
         end if
         if (i > size(gone)) exit
         from = stop_at + 1
         i = i + 1
      end do
   end subroutine merge_lists

   !> The same for pairs and nodes of the groups of pairs that share nodes.
   subroutine find_linked(self, places, n_lone, new, linked, nodes, first, offset)
      type(contact_t), intent(in) :: self, new
      type(places_t), intent(in) :: places
      !> pairs that share no node, as it will be
      integer, intent(in) :: n_lone
      !> runs of pairs; of nodes, which join those there are
      type(runs_t), intent(out) :: linked
      type(runs_t), intent(inout) :: nodes
      !> first pair and first node of each new group; how far pairs and nodes of each run of old groups move
      integer, allocatable, intent(out) :: first(:, :), offset(:, :)
      integer :: i, j, g, next(2), from(2), length(2)
      call linked%clear()
      allocate (first(2, size(places%new_group)), offset(2, places%group%n))
      next = [n_lone + 1, 2*n_lone + 1]
      i = 1
      j = 1
      do while (i <= places%group%n .or. j <= size(places%new_group))
         if (comes_next()) then
            g = new%n_lone + j
            first(:, j) = next
            next = next + [new%group_pair(g + 1) - new%group_pair(g), new%group_node(g + 1) - new%group_node(g)]
            j = j + 1
         else
            g = self%n_lone + places%group%run(1, i)
            from = [self%group_pair(g), self%group_node(g)]
            g = g + places%group%run(3, i)
            length = [self%group_pair(g), self%group_node(g)] - from
            call linked%add(from(1), next(1), length(1))
            call nodes%add(from(2), next(2), length(2))
            offset(:, i) = next - from
            next = next + length
            i = i + 1
         end if
      end do

   contains

      !> A new group stands before the next run of old ones.
      logical function comes_next()
         comes_next = i > places%group%n
         if (comes_next .or. j > size(places%new_group)) return
         comes_next = places%new_group(j) < places%group%run(2, i)
      end function comes_next

   end subroutine find_linked

   !> Keys of the pairs that share nodes: those of pairs that stay, in their new places, and of the new ones.
   subroutine merge_keys(self, linked, n, new, new_place)
      type(contact_t), intent(inout) :: self
      type(contact_t), intent(in) :: new
      type(runs_t), intent(in) :: linked
      !> how many there will be
      integer, intent(in) :: n
      !> of the new pairs
      integer, intent(in) :: new_place(:)
      integer, allocatable :: place(:), by_key(:)
      integer(i8), allocatable :: key(:)
      integer :: i, j, k, p
      allocate (place(self%n_lone + 1:self%n_pairs), by_key(n), key(n))
      place = 0
      do i = 1, linked%n
         do p = 0, linked%run(3, i) - 1
            place(linked%run(1, i) + p) = linked%run(2, i) + p
         end do
      end do
      j = 1
      k = 0
      do i = 1, size(self%key)
         if (place(self%by_key(i)) == 0) cycle
         do while (j <= size(new%key))
            if (new%key(j) > self%key(i)) exit
            call take_new()
         end do
         k = k + 1
         key(k) = self%key(i)
         by_key(k) = place(self%by_key(i))
      end do
      do while (j <= size(new%key))
         call take_new()
      end do
      call move_alloc(key, self%key)
      call move_alloc(by_key, self%by_key)

   contains

      subroutine take_new()
         k = k + 1
         key(k) = new%key(j)
         by_key(k) = new_place(new%by_key(j))
         j = j + 1
      end subroutine take_new

   end subroutine merge_keys

   !> Place of each new pair.
   function places_of_new(new, new_lone, first) result(place)
      type(contact_t), intent(in) :: new
      integer, intent(in) :: new_lone(:), first(:, :)
      integer, allocatable :: place(:)
      integer :: g, p
      allocate (place(new%n_pairs))
      place(:new%n_lone) = new_lone
      do g = new%n_lone + 1, new%n_groups
         do p = new%group_pair(g), new%group_pair(g + 1) - 1
            place(p) = first(1, g - new%n_lone) + p - new%group_pair(g)
         end do
      end do
   end function places_of_new

   !> What pairs know moves with them; what `weigh` and `arrange` find does not.
   subroutine shift_pairs(self, runs)
      type(contact_t), intent(inout) :: self
      type(runs_t), intent(in) :: runs
      call move(self%pair, runs)
      call move(self%normal, runs)
      call move(self%area, runs)
      call move(self%friction, runs)
      call move(self%cohesion, runs)
      call move(self%broken, runs)
      call move(self%slip_reference, runs)
      call move(self%gap_reference, runs)
      call move(self%friction_before, runs)
      call move(self%limit_before, runs)
      call move(self%impulse, runs)
      call self%cohesive%shift(runs, self%n_pairs)
   end subroutine shift_pairs

   !> Groups and their nodes move. Pairs, groups and nodes of pairs that share no node are numbered alike, so their numbers
   !> stay.
   subroutine shift_groups(self, groups, linked, nodes, offset, n_lone, n_groups)
      type(contact_t), intent(inout) :: self
      type(runs_t), intent(in) :: groups, linked, nodes
      integer, intent(in) :: offset(:, :)
      !> pairs that share no node and all groups, as it will be
      integer, intent(in) :: n_lone, n_groups
      type(runs_t) :: moved
      integer :: i, p, g
      call move(self%node, nodes)
      call move(self%pair_node, linked)
      call moved%clear()
      do i = 1, groups%n
         call moved%add(self%n_lone + groups%run(1, i), n_lone + groups%run(2, i), groups%run(3, i))
      end do
      call grow(self%group_pair, n_groups + 1)
      call grow(self%group_node, n_groups + 1)
      call move(self%group_pair, moved)
      call move(self%group_node, moved)
      do i = 1, groups%n
         g = n_lone + groups%run(2, i)
         self%group_pair(g:g + groups%run(3, i) - 1) = self%group_pair(g:g + groups%run(3, i) - 1) + offset(1, i)
         self%group_node(g:g + groups%run(3, i) - 1) = self%group_node(g:g + groups%run(3, i) - 1) + offset(2, i)
         do p = linked%run(2, i), linked%run(2, i) + linked%run(3, i) - 1      ! one run of pairs for each of groups
            self%pair_node(:, p) = self%pair_node(:, p) + offset(2, i)
         end do
      end do
      do p = self%n_lone + 1, n_lone
         self%pair_node(:, p) = [2*p - 1, 2*p]
         self%group_pair(p) = p
         self%group_node(p) = 2*p - 1
      end do
   end subroutine shift_groups

   !> The new pairs take their places.
   subroutine put_pairs(self, new, place, new_group, first)
      type(contact_t), intent(inout) :: self
      type(contact_t), intent(in) :: new
      !> of the new pairs; of their groups, and the first pair and node of these (find_places, find_linked)
      integer, intent(in) :: place(:), new_group(:), first(:, :)
      integer :: p, q, g, to, i
      do q = 1, new%n_pairs
         p = place(q)
         self%pair(:, p) = new%pair(:, q)
         self%normal(:, p) = new%normal(:, q)
         self%area(p) = new%area(q)
         self%friction(p) = new%friction(q)
         self%cohesion(p) = new%cohesion(q)
         self%broken(p) = new%broken(q)
         self%slip_reference(p) = new%slip_reference(q)
         self%gap_reference(p) = new%gap_reference(q)
         self%friction_before(p) = new%friction_before(q)
         self%limit_before(p) = new%limit_before(q)
         self%impulse(:, p) = new%impulse(:, q)
         call self%cohesive%put(p, new%cohesive, q)
         if (q <= new%n_lone) self%node(2*p - 1:2*p) = new%pair(:, q)
      end do
      do g = new%n_lone + 1, new%n_groups
         i = g - new%n_lone
         to = self%n_lone + new_group(i)
         self%group_pair(to) = first(1, i)
         self%group_node(to) = first(2, i)
         do q = new%group_pair(g), new%group_pair(g + 1) - 1
            self%pair_node(:, place(q)) = new%pair_node(:, q) + first(2, i) - new%group_node(g)
         end do
         do q = new%group_node(g), new%group_node(g + 1) - 1
            self%node(first(2, i) + q - new%group_node(g)) = new%node(q)
         end do
      end do
   end subroutine put_pairs

end submodule rf_contact_follow
