!> Pairs from cracked edges: their normals, areas, friction and what softens, and their groups.
submodule(rf_contact) rf_contact_pairs
   use rf_disjoint, only: singletons, find_root, unite
   use rf_topology, only: side_nodes
   implicit none

   !> mode of a crack segment that came by tension
   integer, parameter :: segment_tension = 1

contains

   module subroutine collect_pairs(self, mesh, material)
      type(contact_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer(i8), allocatable :: key(:)
      integer, allocatable :: segment_of(:)
      integer :: s, i, n, nodes(2, 2)
      allocate (key(2*mesh%n_segments), segment_of(2*mesh%n_segments))
      n = 0
      do s = 1, mesh%n_segments
         nodes = side_nodes(mesh, s)
         do i = 1, 2
            if (nodes(i, 1) == nodes(i, 2)) cycle
            n = n + 1
            key(n) = pair_key(nodes(i, 1), nodes(i, 2))
            segment_of(n) = s
         end do
      end do
      call self%join_ends(mesh, material, key(:n), segment_of(:n))
   end subroutine collect_pairs

   module subroutine join_ends(self, mesh, material, key, segment_of)
      class(contact_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer(i8), intent(in) :: key(:)
      integer, intent(in) :: segment_of(:)
      integer, allocatable :: order(:)
      integer :: i, n, p
      n = size(key)
      allocate (order, source=sorted_order(key))
      call self%reserve_pairs(n)
      p = 0
      do i = 1, n
         if (i == 1) then
            call start_pair(key(order(i)))
         else if (key(order(i)) /= key(order(i - 1))) then
            call start_pair(key(order(i)))
         end if
         call add_segment(segment_of(order(i)))
      end do
      self%n_pairs = p
      do p = 1, self%n_pairs
         self%normal(:, p) = self%normal(:, p)/norm2(self%normal(:, p))
         if (.not. self%cohesive%area(p) > 0) cycle
         self%cohesive%energy(:, p) = self%cohesive%energy(:, p)/self%cohesive%area(p)
         self%cohesive%strength(:, p) = self%cohesive%strength(:, p)/self%cohesive%area(p)
      end do

   contains

      subroutine start_pair(k)
         integer(i8), intent(in) :: k
         p = p + 1
         self%pair(:, p) = [int(k/2_i8**32), int(mod(k, 2_i8**32))]
         self%normal(:, p) = 0
         self%area(p) = 0
         self%friction(p) = huge(1.0_wp)
         self%cohesion(p) = huge(1.0_wp)
         self%cohesive%area(p) = 0
         self%cohesive%energy(:, p) = 0
         self%cohesive%strength(:, p) = 0
      end subroutine start_pair

      !> Half the segment belongs to the pair. Friction and cohesion are those of the crack if it has its own, else those of
      !> the material; of several the smaller count.
      subroutine add_segment(s)
         integer, intent(in) :: s
         integer :: ends(2, 2), side, e, crack
         real(wp) :: along(2), sense, area
         ends = side_nodes(mesh, s)
         along = mesh%x(:, ends(2, 1)) - mesh%x(:, ends(1, 1))
         sense = merge(1.0_wp, -1.0_wp, any(ends(:, 1) == self%pair(1, p)))
         ! the outward normal of the first side points to the second
         self%normal(:, p) = self%normal(:, p) + sense*[along(2), -along(1)]
         crack = mesh%segment_crack(s)
         do side = 1, 2
            e = mesh%section(mesh%segment_element(side, s))
            if (material%surface_given(crack)) cycle
            self%friction(p) = min(self%friction(p), material%section(e)%friction)
            self%cohesion(p) = min(self%cohesion(p), material%section(e)%cohesion)
         end do
         if (material%surface_given(crack)) then
            self%friction(p) = min(self%friction(p), material%surface(crack)%friction)
            self%cohesion(p) = min(self%cohesion(p), material%surface(crack)%cohesion)
         end if
         area = 0.5_wp*norm2(along)*material%section(e)%thickness
         self%area(p) = self%area(p) + area
         ! what was a crack before the run has nothing to soften
         if (crack == 0) call soften_segment(s, mesh%segment_straight(s)*area)
      end subroutine add_segment

      !> A segment that softens: of two materials the smaller fracture energy and strength count; the pair gets means over
      !> its segments.
      subroutine soften_segment(s, area)
         integer, intent(in) :: s
         !> the pair's part, along the ray that the segment stands for [length^2]
         real(wp), intent(in) :: area
         real(wp) :: energy(2), strength(2)
         integer :: side, e
         energy = huge(1.0_wp)
         strength = huge(1.0_wp)
         do side = 1, 2
            e = mesh%segment_element(side, s)
            associate (section => material%section(mesh%section(e)))
               energy = min(energy, section%fracture_energy)
               if (all(section%strength > 0)) strength = min(strength, section%strength*material%strength_of(e))
            end associate
         end do
         if (.not. all(energy > 0) .or. all(strength >= huge(1.0_wp))) return
         ! a crack that came by tension follows the mesh in zigzag: its jump is opening to the body, whatever the segment's
         ! direction, so its slip must not meet more resistance
         if (mesh%segment_mode(s) == segment_tension) strength(2) = min(strength(1), strength(2))
         self%cohesive%area(p) = self%cohesive%area(p) + area
         self%cohesive%energy(:, p) = self%cohesive%energy(:, p) + area*energy
         self%cohesive%strength(:, p) = self%cohesive%strength(:, p) + area*strength
      end subroutine soften_segment

   end subroutine join_ends

   module subroutine group_pairs(self)
      class(contact_t), intent(inout) :: self
      integer, allocatable :: root(:), order(:), group(:), members(:)
      integer(i8), allocatable :: nodes(:)
      integer :: n, p, i

      n = self%n_pairs
      allocate (nodes(2*n))
      nodes(1:2*n - 1:2) = self%pair(1, :n)
      nodes(2:2*n:2) = self%pair(2, :n)
      allocate (order, source=sorted_order(nodes))
      allocate (root, source=singletons(n))
      allocate (group(n), members(n))
      do i = 2, size(order)                                ! pairs that hold the same node belong together
         if (nodes(order(i)) /= nodes(order(i - 1))) cycle
         call unite(root, (order(i) + 1)/2, (order(i - 1) + 1)/2)
      end do
      members = 0
      do p = 1, n
         group(p) = find_root(root, p)
         members(group(p)) = members(group(p)) + 1
      end do
      self%n_lone = count(members == 1)
      deallocate (order)
      allocate (order, source=sorted_order(merge(int(group, i8), int(group, i8) + n, members(group) == 1)))
      call permute_pairs(self, order)
      group = group(order)
      call number_nodes(self, group)
      call self%sort_keys()
   end subroutine group_pairs

   subroutine permute_pairs(self, order)
      class(contact_t), intent(inout) :: self
      integer, intent(in) :: order(:)
      integer :: n
      n = size(order)
      self%pair(:, :n) = self%pair(:, order)
      self%normal(:, :n) = self%normal(:, order)
      self%area(:n) = self%area(order)
      self%friction(:n) = self%friction(order)
      self%cohesion(:n) = self%cohesion(order)
      call self%cohesive%permute(order)
   end subroutine permute_pairs

   !> Contact nodes group by group, and where each group begins.
   subroutine number_nodes(self, group)
      class(contact_t), intent(inout) :: self
      !> group of each pair; pairs of a group stand together
      integer, intent(in) :: group(:)
      integer :: p, i, c, g
      call grow(self%group_pair, self%n_pairs + 1)
      call grow(self%group_node, self%n_pairs + 1)
      g = 0
      self%n_nodes = 0
      do p = 1, self%n_pairs
         if (p == 1) then
            call open_group()
         else if (group(p) /= group(p - 1)) then
            call open_group()
         end if
         do i = 1, 2
            do c = self%group_node(g), self%n_nodes
               if (self%node(c) == self%pair(i, p)) exit
            end do
            if (c > self%n_nodes) self%n_nodes = c
            self%node(c) = self%pair(i, p)
            self%pair_node(i, p) = c
         end do
      end do
      self%n_groups = g
      self%group_pair(g + 1) = self%n_pairs + 1
      self%group_node(g + 1) = self%n_nodes + 1
      self%force(:, :self%n_nodes) = 0

   contains

      subroutine open_group()
         g = g + 1
         self%group_pair(g) = p
         self%group_node(g) = self%n_nodes + 1
      end subroutine open_group

   end subroutine number_nodes

end submodule rf_contact_pairs
