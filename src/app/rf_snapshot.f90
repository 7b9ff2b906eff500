!> A state that a run can come back to: probes for the load of the first event are discarded with all they changed, and
!> a mechanism stops the run at the last equilibrium.
module rf_snapshot
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_model, only: model_t
   implicit none
   private
   public :: snapshot_t

   type :: snapshot_t
      !> the state fits the mesh as it is now
      logical :: valid = .false.
      !> part of the step that was done [-]
      real(wp) :: fraction = 0
      !> displacements [length], (nodes)
      real(wp), allocatable :: ux(:), uy(:)
      real(wp) :: largest_scale = 0
      !> of supports [force], (2, places among them); contact impulses, (2, pairs), and their factor
      real(wp), allocatable :: reaction(:, :), impulse(:, :)
      !> cracks that soften: cohesive impulses, (2, pairs), and separations, (pairs)
      real(wp), allocatable :: cohesive(:, :), separation(:)
      real(wp) :: b = 0.5_wp
   contains
      procedure :: take, restore, forget, interpolate, exchange
   end type snapshot_t

contains

   !> Remember the present state; the fraction is set by the caller.
   subroutine take(self, model)
      class(snapshot_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      self%ux = model%motion%ux(:model%mesh%n_nodes)
      self%uy = model%motion%uy(:model%mesh%n_nodes)
      self%largest_scale = model%relaxation%largest_scale
      self%reaction = model%reaction
      self%impulse = model%contact%impulse(:, :model%contact%n_pairs)
      self%cohesive = model%contact%cohesive%impulse(:, :model%contact%n_pairs)
      self%separation = model%contact%cohesive%separation(:model%contact%n_pairs)
      self%b = model%relaxation%b
      self%valid = .true.
   end subroutine take

   !> Go back to the state.
   subroutine restore(self, model)
      class(snapshot_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      model%motion%ux(:size(self%ux)) = self%ux
      model%motion%uy(:size(self%uy)) = self%uy
      model%relaxation%largest_scale = self%largest_scale
      model%reaction = self%reaction
      model%contact%impulse(:, :size(self%impulse, 2)) = self%impulse
      model%contact%cohesive%impulse(:, :size(self%cohesive, 2)) = self%cohesive
      model%contact%cohesive%separation(:size(self%separation)) = self%separation
      model%relaxation%b = self%b
   end subroutine restore

   !> The state is not needed any more.
   subroutine forget(self)
      class(snapshot_t), intent(inout) :: self
      self%valid = .false.
      if (.not. allocated(self%ux)) return
      deallocate (self%ux, self%uy, self%reaction, self%impulse, self%cohesive, self%separation)
   end subroutine forget

   !> Displacements on the line through two states, where it reaches a fraction of the step: the start of a relaxation
   !> (theory: eq. 16).
   subroutine interpolate(self, other, fraction, model)
      class(snapshot_t), intent(in) :: self
      type(snapshot_t), intent(in) :: other
      real(wp), intent(in) :: fraction
      type(model_t), intent(inout) :: model
      real(wp) :: part
      integer :: n, p
      n = size(self%ux)
      part = (fraction - self%fraction)/(other%fraction - self%fraction)
      model%motion%ux(:n) = self%ux + part*(other%ux - self%ux)
      model%motion%uy(:n) = self%uy + part*(other%uy - self%uy)
      if (part <= 1) return
      ! A piece that nothing holds as a whole is in balance wherever it is: it stays where it was, or it would coast on
      ! from increment to increment by the way that it once jumped.
      do n = 1, size(self%ux)
         p = model%pieces%of_node(n)
         if (model%pieces%loaded(p) .or. (model%pieces%supported(p) .and. .not. model%pieces%slides(p))) cycle
         model%motion%ux(n) = other%ux(n)
         model%motion%uy(n) = other%uy(n)
      end do
   end subroutine interpolate

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(snapshot_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('valid', self%valid)
      call archive%exchange('fraction', self%fraction)
      call archive%exchange('ux', self%ux)
      call archive%exchange('uy', self%uy)
      call archive%exchange('largest_scale', self%largest_scale)
      call archive%exchange('reaction', self%reaction)
      call archive%exchange('impulse', self%impulse)
      call archive%exchange('cohesive', self%cohesive)
      call archive%exchange('separation', self%separation)
      call archive%exchange('b', self%b)
   end subroutine exchange

end module rf_snapshot
