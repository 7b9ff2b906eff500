!> The state that a checkpoint keeps of loads_t.
submodule(rf_loads) rf_loads_state
   implicit none

contains

   !> To or from a checkpoint. (Derived: amplitudes follow from the deck.)
   module subroutine exchange(self, archive)
      class(loads_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('px', self%px)
      call archive%exchange('py', self%py)
      call archive%exchange('applied', self%applied)
      call archive%exchange('initial', self%initial)
      call archive%exchange('free_x', self%free_x)
      call archive%exchange('free_y', self%free_y)
      call exchange_supports(self, archive)
      call archive%exchange('displacement', self%displacement)
      call archive%exchange('place', self%place)
      call archive%exchange('n_supported', self%n_supported)
      call archive%exchange('ends', self%ends)
      call archive%exchange('n_forces', self%n_forces)
      call exchange_forces(self, archive)
      call archive%exchange('n_acting', self%n_acting)
      call exchange_acting(self, archive)
      call archive%exchange('n_tags', self%n_tags)
      call archive%exchange('tag_first', self%tag_first)
      call archive%exchange('tag_member', self%tag_member)
      call archive%exchange('any_gravity', self%any_gravity)
      call archive%exchange('fraction', self%fraction)
      call archive%exchange('time', self%time)
      call archive%exchange('sums', self%sums)
      call archive%exchange('n_touched', self%n_touched)
      call archive%exchange('touched', self%touched)
   end subroutine exchange

   !> Forces of single nodes.
   subroutine exchange_forces(self, archive)
      class(loads_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      integer, allocatable :: node(:), dof(:), definition(:)
      integer :: n
      n = 0
      if (allocated(self%force)) n = size(self%force)
      call archive%exchange('force_room', n)
      if (archive%reading) call make_forces(self, n)
      allocate (node(n), dof(n), definition(n))
      node = self%force%node
      dof = self%force%dof
      definition = self%force%definition
      call archive%exchange('force_node', node)
      call archive%exchange('force_dof', dof)
      call archive%exchange('force_definition', definition)
      call exchange_ramps(archive, 'force_ramp', self%force%ramp)
      if (allocated(archive%error)) return
      self%force%node = node
      self%force%dof = dof
      self%force%definition = definition
   end subroutine exchange_forces

   subroutine make_forces(self, n)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: n
      if (allocated(self%force)) deallocate (self%force)
      allocate (self%force(n))
   end subroutine make_forces

   !> What acts, and how it runs.
   subroutine exchange_acting(self, archive)
      class(loads_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      integer, allocatable :: whole(:, :)
      real(wp), allocatable :: value(:, :)
      integer :: n, i
      n = 0
      if (allocated(self%acting)) n = size(self%acting)
      call archive%exchange('acting_room', n)
      if (archive%reading) call make_acting(self, n)
      allocate (whole(9, n), value(3, n))
      do i = 1, n
         associate (d => self%acting(i))
            whole(:, i) = [d%kind, d%step, d%set, d%entity, d%first_dof, d%last_dof, d%amplitude, &
                           merge(1, 0, d%is_velocity), merge(1, 0, d%follow)]
            value(:, i) = [d%value, d%direction]
         end associate
      end do
      call archive%exchange('acting_whole', whole)
      call archive%exchange('acting_value', value)
      call exchange_ramps(archive, 'acting_ramp', self%ramp)
      if (allocated(archive%error)) return
      do i = 1, n
         associate (w => whole(:, i))
            self%acting(i) = load_definition_t(kind=w(1), step=w(2), set=w(3), entity=w(4), first_dof=w(5), last_dof=w(6), &
                                               value=value(1, i), direction=value(2:3, i), amplitude=w(7), &
                                               is_velocity=w(8) == 1, follow=w(9) == 1)
         end associate
      end do
   end subroutine exchange_acting

   subroutine make_acting(self, n)
      class(loads_t), intent(inout) :: self
      integer, intent(in) :: n
      if (allocated(self%acting)) deallocate (self%acting, self%ramp)
      allocate (self%acting(n), self%ramp(n))
   end subroutine make_acting

   !> How each supported direction runs.
   subroutine exchange_supports(self, archive)
      class(loads_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      integer :: n
      n = 0
      if (allocated(self%support)) n = size(self%support, 2)
      call archive%exchange('support_room', n)
      if (archive%reading) then
         if (allocated(self%support)) deallocate (self%support)
         allocate (self%support(2, n))
      end if
      call exchange_ramps(archive, 'support_x', self%support(1, :))
      call exchange_ramps(archive, 'support_y', self%support(2, :))
   end subroutine exchange_supports

   !> As many ramps as there is room for.
   subroutine exchange_ramps(archive, name, ramps)
      class(archive_t), intent(inout) :: archive
      character(len=*), intent(in) :: name
      type(ramp_t), intent(inout) :: ramps(:)
      real(wp), allocatable :: value(:, :)
      integer, allocatable :: amplitude(:)
      logical, allocatable :: is_velocity(:)
      integer :: i
      allocate (value(3, size(ramps)), amplitude(size(ramps)), is_velocity(size(ramps)))
      do i = 1, size(ramps)
         value(:, i) = [ramps(i)%from, ramps(i)%to, ramps(i)%now]
      end do
      amplitude = ramps%amplitude
      is_velocity = ramps%is_velocity
      call archive%enter(name)
      call archive%exchange('value', value)
      call archive%exchange('amplitude', amplitude)
      call archive%exchange('is_velocity', is_velocity)
      call archive%leave()
      if (.not. archive%reading .or. allocated(archive%error)) return
      if (size(value, 2) /= size(ramps)) then
         call archive%fail(name//' has another number of ramps')
         return
      end if
      do i = 1, size(ramps)
         ramps(i)%from = value(1, i)
         ramps(i)%to = value(2, i)
         ramps(i)%now = value(3, i)
      end do
      ramps%amplitude = amplitude
      ramps%is_velocity = is_velocity
   end subroutine exchange_ramps

end submodule rf_loads_state
