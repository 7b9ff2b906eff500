!> Loads follow a split at the cost of what it touched: only the nodes of changed elements are loaded anew. Sums at a node
!> run over the same terms in the same order as in `gather`, so that the bits are the same (a test compares).
submodule(rf_loads) rf_loads_follow
   use rf_topology, only: elements_around, sort_ascending
   implicit none

contains

   module subroutine follow(self, mesh, material, changes, fraction, time)
      class(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(changes_t), intent(in) :: changes
      real(wp), intent(in) :: fraction, time
      integer :: i, n, dof
      if (.not. can_follow(self, fraction, time)) then
         call self%apply(mesh, material, fraction, time)
         return
      end if
      do i = 1, changes%n_nodes
         n = changes%node(i)
         do dof = 1, 2
            if (self%is_held(dof, n)) self%displacement(dof, self%place(n)) = self%support_at(dof, n, fraction, time)
         end do
      end do
      do i = 1, self%n_forces
         self%force(i)%ramp%now = value_at(self, self%force(i)%ramp, fraction, time)
      end do
      call changes%corners(mesh, self%touched, self%n_touched)
      call load_touched(self, mesh, material)
   end subroutine follow

   !> Whether all other nodes bear what they bear at this moment of the step, from loads that act node by node or element by
   !> element.
   pure logical function can_follow(self, fraction, time)
      type(loads_t), intent(in) :: self
      real(wp), intent(in) :: fraction, time
      integer :: d
      can_follow = .not. (abs(fraction - self%fraction) > 0 .or. abs(time - self%time) > 0)
      do d = 1, self%n_acting
         can_follow = can_follow .and. any(self%acting(d)%kind == [load_force, load_element_face, load_edges, load_gravity])
      end do
   end function can_follow

   !> As `gather`, for the touched nodes.
   subroutine load_touched(self, mesh, material)
      type(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, allocatable :: around(:)
      integer :: i, node, n
      if (size(self%px) == 0) return
      associate (touched => self%touched(:self%n_touched))
         self%px(touched) = 0
         self%py(touched) = 0
         do i = 1, self%n_forces
            node = self%force(i)%node
            if (.not. any(touched == node)) cycle
            if (self%force(i)%dof == 1) self%px(node) = self%px(node) + self%force(i)%ramp%now
            if (self%force(i)%dof == 2) self%py(node) = self%py(node) + self%force(i)%ramp%now
         end do
         do i = 1, size(touched)
            node = touched(i)
            if (self%n_tags > 0 .or. self%any_gravity) then
               call elements_around(mesh, node, around, n)
               call sort_ascending(around(:n))
               if (self%n_tags > 0) call press_node(self, mesh, material, node, around(:n))
               if (self%any_gravity) call weigh_node(self, mesh, material, node, around(:n))
            end if
            if (.not. allocated(self%initial)) cycle
            self%applied(1, node) = self%px(node)
            self%applied(2, node) = self%py(node)
            self%px(node) = self%px(node) - self%initial(1, node)
            self%py(node) = self%py(node) - self%initial(2, node)
         end do
      end associate
   end subroutine load_touched

   !> Pressure on the faces at a node.
   subroutine press_node(self, mesh, material, node, around)
      type(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> the node, the elements round it in ascending order
      integer, intent(in) :: node, around(:)
      real(wp) :: push(2)
      integer :: i, k, ends(2)
      do i = 1, size(around)
         do k = 1, 3
            if (mesh%tag_at(k, around(i)) <= 0) cycle
            ends = mesh%connectivity([k, next_corner(k)], around(i))
            if (.not. any(ends == node)) cycle
            push = face_push(mesh, material, pressure_of(self, mesh%tag_at(k, around(i))), around(i), ends)
            self%px(node) = self%px(node) + push(1)
            self%py(node) = self%py(node) + push(2)
         end do
      end do
   end subroutine press_node

   !> Weight of the elements round a node.
   subroutine weigh_node(self, mesh, material, node, around)
      type(loads_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node, around(:)
      real(wp) :: weight(2)
      integer :: d, i
      do d = 1, self%n_acting
         if (self%acting(d)%kind /= load_gravity) cycle
         do i = 1, size(around)
            if (.not. acts_on_element(self%acting(d), mesh, around(i))) cycle
            weight = corner_weight(mesh, material, self%ramp(d)%now, self%acting(d)%direction, around(i))
            self%px(node) = self%px(node) + weight(1)
            self%py(node) = self%py(node) + weight(2)
         end do
      end do
   end subroutine weigh_node

end submodule rf_loads_follow
