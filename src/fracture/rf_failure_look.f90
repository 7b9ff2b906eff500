!> The look at the criterion (theory: section 6). One pass over the elements gives their stresses and bounds of their
!> utilisation. What a node can reach is screened by the bounds in two rings round it, but only from the elements that can
!> matter: so a look costs that pass, and the patches of the few nodes that come near the largest.
submodule(rf_failure) rf_failure_look
   use rf_stress_k, only: element_stresses, spread_largest
   use rf_recovery, only: node_stress, materials_at_node
   implicit none

   !> part of the largest screen value from which the node's patch is fitted
   real(wp), parameter :: screen_margin = 0.7_wp
   !> elements of a block, and blocks below which a second thread costs more than it brings
   integer, parameter :: look_block = 256, blocks_for_threads = 16
   !> nodes below which their patches are not worth a second thread
   integer, parameter :: nodes_for_threads = 16
   !> how far the screen is lowered where nothing that it shows may fail
   real(wp), parameter :: lowering = 0.25_wp
   !> materials that may meet at one node
   integer, parameter :: max_materials = 16
   !> utilisation of a point that has none: no strength given
   real(wp), parameter :: no_utilisation = 0.0_wp

contains

   module subroutine look(self, mesh, material, motion)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      call self%watch%start()
      self%largest = 0
      if (.not. self%watching) call self%forget()
      if (self%watching .or. self%keeps_stress) call look_at_elements(self, mesh, material, motion)
      if (self%watching) then
         call clear_nodes(self, mesh)
         if (self%settings%on) call look_at_candidates(self, mesh, material)
      end if
      call self%watch%stop()
   end subroutine look

   module subroutine look_everywhere(self, mesh, material, motion)
      class(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      integer :: n
      call self%watch%start()
      call self%reserve(mesh)
      call look_at_elements(self, mesh, material, motion)
      call clear_nodes(self, mesh)
      call spread_largest(mesh%n_elements, mesh%n_nodes, mesh%connectivity, self%element_bound, self%screen)
      self%all_screened = .true.
      call grow(self%looked_at, mesh%n_nodes)
      self%n_looked_at = mesh%n_nodes
      do n = 1, mesh%n_nodes
         self%looked_at(n) = n
      end do
      call look_at_nodes(self, mesh, material, 1)
      call find_largest(self, mesh)
      call self%watch%stop()
   end subroutine look_everywhere

   !> Stresses of all elements and bounds of their utilisation.
   subroutine look_at_elements(self, mesh, material, motion)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      real(wp), allocatable :: direct(:), lateral(:), shear(:)
      integer :: b, n_blocks
      direct = material%section%law%direct
      lateral = material%section%law%lateral
      shear = material%section%law%shear
      n_blocks = (mesh%n_elements - 1)/look_block + 1
      call grow(self%element_stress, mesh%n_elements, 3)
      call grow(self%block_bound, n_blocks)
      if (allocated(self%stale)) self%stale(:mesh%n_nodes) = .false.
      !$omp parallel do default(none) schedule(static) if (n_blocks >= blocks_for_threads) &
      !$omp    shared(self, mesh, material, motion, n_blocks, direct, lateral, shear) private(b)
      do b = 1, n_blocks
         call look_at_block(self, mesh, material, motion, b, direct, lateral, shear)
      end do
      !$omp end parallel do
   end subroutine look_at_elements

   !> Stresses and bounds of one block of elements.
   subroutine look_at_block(self, mesh, material, motion, block, direct, lateral, shear)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      integer, intent(in) :: block
      !> plane elasticity of the sections [stress]
      real(wp), intent(in), contiguous :: direct(:), lateral(:), shear(:)
      real(wp) :: factor(look_block), strength(3, look_block), limit(look_block)
      integer :: m, i, n, first, last
      first = (block - 1)*look_block + 1
      last = min(mesh%n_elements, first + look_block - 1)
      n = last - first + 1
      factor = 1
      if (allocated(material%stiffness_factor)) factor(:n) = material%stiffness_factor(first:last)
      call element_stresses(n, mesh%connectivity(:, first:last), mesh%x, motion%ux, motion%uy, mesh%section(first:last), direct, &
                            lateral, shear, factor, self%element_stress(:, first:last))
      if (material%initial%given) self%element_stress(:, first:last) = self%element_stress(:, first:last) &
                                                                       + material%initial%stress([1, 2, 4], first:last)
      if (.not. allocated(self%element_bound)) return
      self%element_bound(first:last) = no_utilisation
      if (allocated(material%stiffness_factor)) factor = 1
      if (allocated(material%strength_factor)) factor(:n) = material%strength_factor(first:last)
      do m = 1, size(self%strength)
         if (.not. self%strength(m)%given) cycle
         call strengths(self%strength(m), factor(:n), strength)
         call self%criterion(m)%law%bound(n, self%element_stress(:, first:last), strength, limit)
         if (size(self%strength) == 1) self%element_bound(first:last) = limit(:n)
         if (size(self%strength) == 1) exit
         do i = 1, n
            if (material%section(mesh%section(first + i - 1))%material == m) self%element_bound(first + i - 1) = limit(i)
         end do
      end do
      self%block_bound(block) = maxval(self%element_bound(first:last))
   end subroutine look_at_block

   !> Forget what the last look said of the nodes.
   subroutine clear_nodes(self, mesh)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      if (self%all_screened) then
         self%screen(:mesh%n_nodes) = 0
         self%ring(:mesh%n_nodes) = 0
         self%utilisation(:mesh%n_nodes) = 0
         self%mode(:mesh%n_nodes) = mode_none
      else
         associate (screened => self%screened(:self%n_screened), looked_at => self%looked_at(:self%n_looked_at))
            self%screen(screened) = 0
            self%ring(screened) = 0
            self%utilisation(looked_at) = 0
            self%mode(looked_at) = mode_none
         end associate
      end if
      call grow(self%screened, 0)
      call grow(self%looked_at, 0)
      self%all_screened = .false.
      self%n_screened = 0
      self%n_looked_at = 0
   end subroutine clear_nodes

   !> Fit the patches of the nodes that can have the largest utilisation, and of exhausted ones.
   subroutine look_at_candidates(self, mesh, material)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      real(wp) :: level, first_level, top, largest_bound
      integer :: n
      largest_bound = maxval(self%block_bound(:(mesh%n_elements - 1)/look_block + 1))
      call screen_from(self, mesh, huge(1.0_wp), screen_margin*min(1.0_wp, largest_bound), level)
      top = largest_screen(self, mesh)
      do while (top <= 0 .and. level > 0)      ! what it shows may not fail
         call screen_from(self, mesh, level, merge(lowering*level, 0.0_wp, level > tiny(1.0_wp)), level)
         top = largest_screen(self, mesh)
      end do
      first_level = screen_margin*min(1.0_wp, top)
      call screen_from(self, mesh, level, first_level, level)
      do n = 1, mesh%n_nodes
         if (.not. self%exhausted(n)) cycle
         if (.not. self%screen(n) > 0) call screen_alone(self, mesh, n)
         call add(self%looked_at, self%n_looked_at, n)
      end do
      call add_candidates(self, mesh, first_level, huge(1.0_wp))
      call look_at_nodes(self, mesh, material, 1)
      call find_largest(self, mesh)
      ! the node that the screen puts first may come out lower: those that could still be above what was found
      if (.not. self%largest < min(1.0_wp, top)) return
      n = self%n_looked_at
      call screen_from(self, mesh, level, screen_margin*min(1.0_wp, self%largest), level)
      call add_candidates(self, mesh, screen_margin*min(1.0_wp, self%largest), first_level)
      call look_at_nodes(self, mesh, material, n + 1)
      call find_largest(self, mesh)
   end subroutine look_at_candidates

   !> Lower the level down to which the screen is known: the elements whose bounds lie between raise that of the nodes within
   !> two rings. A node's screen is right where it reaches the level, 0 or less than it elsewhere.
   subroutine screen_from(self, mesh, known, wanted, level)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      !> level so far, level wanted (nothing is done unless it is lower)
      real(wp), value :: known, wanted
      !> level now
      real(wp), intent(inout) :: level
      integer, allocatable :: seed(:), around(:)
      integer :: n_seeds, b, e, k, i, n
      level = min(known, wanted)
      if (.not. wanted < known) return
      n_seeds = 0
      allocate (seed(64))
      do b = 1, (mesh%n_elements - 1)/look_block + 1
         if (self%block_bound(b) < wanted) cycle
         do e = (b - 1)*look_block + 1, min(mesh%n_elements, b*look_block)
            associate (bound => self%element_bound(e))
               if (bound < wanted .or. bound >= known .or. bound <= 0) cycle
               do k = 1, 3
                  n = mesh%connectivity(k, e)
                  if (.not. self%ring(n) > 0) call add(seed, n_seeds, n)
                  self%ring(n) = max(self%ring(n), bound)
               end do
            end associate
         end do
      end do
      do i = 1, n_seeds
         if (mesh%hinge(seed(i))) cycle
         call elements_around(mesh, seed(i), around, n)
         do k = 1, n
            call raise(self, mesh%connectivity(:, around(k)), self%ring(seed(i)))
         end do
      end do
      if (n_seeds == 0) return
      if (any(mesh%hinge(seed(:n_seeds)))) call screen_through_hinges(self, mesh)
   end subroutine screen_from

   !> The second ring beyond the points at which parts of the body hang together.
   subroutine screen_through_hinges(self, mesh)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer :: e, k
      do e = 1, mesh%n_elements
         do k = 1, 3
            associate (n => mesh%connectivity(k, e))
               if (mesh%hinge(n) .and. self%ring(n) > 0) call raise(self, mesh%connectivity(:, e), self%ring(n))
            end associate
         end do
      end do
   end subroutine screen_through_hinges

   !> Raise the screen of nodes to a value, a positive one.
   subroutine raise(self, nodes, value)
      type(failure_t), intent(inout) :: self
      integer, intent(in) :: nodes(3)
      real(wp), intent(in) :: value
      integer :: k
      do k = 1, 3
         if (.not. self%screen(nodes(k)) > 0) call add(self%screened, self%n_screened, nodes(k))
         self%screen(nodes(k)) = max(self%screen(nodes(k)), value)
      end do
   end subroutine raise

   !> The screen of one node.
   subroutine screen_alone(self, mesh, node)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      integer, allocatable :: around(:), beyond(:)
      integer :: i, k, j, n, n_beyond
      call add(self%screened, self%n_screened, node)
      call elements_around(mesh, node, around, n)
      self%screen(node) = self%element_bound(around(1))
      do i = 1, n
         do k = 1, 3
            call elements_around(mesh, mesh%connectivity(k, around(i)), beyond, n_beyond)
            do j = 1, n_beyond
               self%screen(node) = max(self%screen(node), self%element_bound(beyond(j)))
            end do
         end do
      end do
   end subroutine screen_alone

   !> One more entry of a list.
   subroutine add(list, n, entry)
      integer, allocatable, intent(inout) :: list(:)
      integer, intent(inout) :: n
      integer, intent(in) :: entry
      n = n + 1
      call grow(list, n)
      list(n) = entry
   end subroutine add

   !> Largest screen of the nodes that may fail; 0 if there is none.
   real(wp) function largest_screen(self, mesh) result(top)
      type(failure_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      integer :: i
      top = 0
      do i = 1, self%n_screened
         if (self%may_fail(mesh, self%screened(i))) top = max(top, self%screen(self%screened(i)))
      end do
   end function largest_screen

   !> Add the nodes that may fail and whose screen lies between two levels to those that are looked at.
   subroutine add_candidates(self, mesh, level, below)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: level, below
      integer :: i
      do i = 1, self%n_screened
         associate (n => self%screened(i))
            if (self%screen(n) < level .or. self%screen(n) >= below) cycle
            if (self%may_fail(mesh, n)) call add(self%looked_at, self%n_looked_at, n)
         end associate
      end do
   end subroutine add_candidates

   !> Look at the nodes of the list from one place on, on all threads.
   subroutine look_at_nodes(self, mesh, material, first)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: first
      !$omp parallel default(none) shared(self, mesh, material, first) if (self%n_looked_at - first >= nodes_for_threads)
      call look_at_part(self, mesh, material, first)
      !$omp end parallel
   end subroutine look_at_nodes

   !> A thread's part of the nodes, with its own work lists (in a procedure of its own because OpenMP's private does not
   !> initialise a derived type reliably).
   subroutine look_at_part(self, mesh, material, first)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: first
      type(patch_work_t) :: work
      integer :: i
      !$omp do schedule(dynamic, 64)
      do i = first, self%n_looked_at
         call self%look_at_node(mesh, material, self%looked_at(i), work)
      end do
      !$omp end do
   end subroutine look_at_part

   !> Largest utilisations of the nodes looked at.
   subroutine find_largest(self, mesh)
      type(failure_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      integer :: i
      self%largest = 0
      self%largest_exhausted = 0
      self%n_exhausted = 0
      do i = 1, self%n_looked_at
         associate (n => self%looked_at(i))
            if (self%exhausted(n)) then
               self%n_exhausted = self%n_exhausted + 1
               self%largest_exhausted = max(self%largest_exhausted, self%utilisation(n))
            else if (allocated(self%no_split_node)) then
               if (self%may_fail(mesh, n)) self%largest = max(self%largest, self%utilisation(n))
            end if
         end associate
      end do
   end subroutine find_largest

   module subroutine look_at_node(self, mesh, material, node, work)
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
            call node_stress(mesh, material, self%element_stress, self%strength(list(i)), node, list(i), attempt == 1, work, &
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

end submodule rf_failure_look
