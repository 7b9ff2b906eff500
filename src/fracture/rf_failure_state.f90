!> The state that a checkpoint keeps of failure_t.
submodule(rf_failure) rf_failure_state
   implicit none

contains

   !> To or from a checkpoint. (Derived: settings, strength, criterion follow from the deck; watch is of one process.)
   module subroutine exchange(self, archive)
      class(failure_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('watching', self%watching)
      call archive%exchange('keeps_stress', self%keeps_stress)
      call archive%exchange('no_split_node', self%no_split_node)
      call archive%exchange('no_split_element', self%no_split_element)
      call archive%exchange('exhausted', self%exhausted)
      call archive%exchange('shielded', self%shielded)
      call archive%exchange('soft_tip', self%soft_tip)
      call archive%exchange('tip_direction', self%tip_direction)
      call archive%exchange('shield_list', self%shield_list)
      call archive%exchange('n_shield_list', self%n_shield_list)
      call archive%exchange('stale', self%stale)
      call archive%exchange('element_stress', self%element_stress)
      call archive%exchange('element_utilisation', self%element_utilisation)
      call archive%exchange('stress', self%stress)
      call archive%exchange('utilisation', self%utilisation)
      call archive%exchange('deciding_material', self%deciding_material)
      call archive%exchange('mode', self%mode)
      call archive%exchange('largest', self%largest)
      call archive%exchange('largest_exhausted', self%largest_exhausted)
      call archive%exchange('n_exhausted', self%n_exhausted)
      call archive%exchange('out_of_plane_node', self%out_of_plane_node)
      call archive%exchange('element_bound', self%element_bound)
      call archive%exchange('block_bound', self%block_bound)
      call archive%exchange('screen', self%screen)
      call archive%exchange('ring', self%ring)
      call archive%exchange('screened', self%screened)
      call archive%exchange('looked_at', self%looked_at)
      call archive%exchange('n_screened', self%n_screened)
      call archive%exchange('n_looked_at', self%n_looked_at)
      call archive%exchange('all_screened', self%all_screened)
   end subroutine exchange

end submodule rf_failure_state
