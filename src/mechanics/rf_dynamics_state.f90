!> The state that a checkpoint keeps of dynamics_t.
submodule(rf_dynamics) rf_dynamics_state
   implicit none

contains

   !> To or from a checkpoint.
   module subroutine exchange(self, archive)
      class(dynamics_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('wanted', self%wanted)
      call archive%exchange('velocity', self%velocity)
      call archive%exchange('initial', self%initial)
      call archive%exchange('time_step', self%time_step)
      call archive%exchange('last_time_step', self%last_time_step)
      call archive%exchange('safe', self%safe)
      call archive%exchange('mass', self%mass)
      call archive%exchange('damping', self%damping)
      call archive%exchange('inverse_mass', self%inverse_mass)
      call archive%exchange('keep', self%keep)
      call archive%exchange('ones', self%ones)
      call archive%exchange('partial', self%partial)
      call archive%exchange('special', self%special)
      call archive%exchange('forces_vary', self%forces_vary)
      call archive%exchange('damped', self%damped)
      call archive%exchange('changing', self%changing)
      call archive%exchange('starting', self%starting)
      call archive%exchange('n_moving', self%n_moving)
      call archive%exchange('moving', self%moving)
      call archive%exchange('target', self%target)
      call archive%exchange('old_moving', self%old_moving)
      call archive%exchange('moving_force', self%moving_force)
      call archive%exchange('old_contact', self%old_contact)
      call archive%exchange('old_x', self%old_x)
      call archive%exchange('old_y', self%old_y)
      call archive%exchange('booked_x', self%booked_x)
      call archive%exchange('booked_y', self%booked_y)
   end subroutine exchange

end submodule rf_dynamics_state
