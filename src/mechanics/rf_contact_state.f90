!> The state that a checkpoint keeps of contact_t.
submodule(rf_contact) rf_contact_state
   implicit none

contains

   !> To or from a checkpoint. The work space too: a relaxation may be left in its midst. (Derived: blocks from arrange.)
   module subroutine exchange(self, archive)
      class(contact_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n_pairs', self%n_pairs)
      call archive%exchange('n_nodes', self%n_nodes)
      call archive%exchange('n_groups', self%n_groups)
      call archive%exchange('n_lone', self%n_lone)
      call archive%exchange('pair', self%pair)
      call archive%exchange('normal', self%normal)
      call archive%exchange('area', self%area)
      call archive%exchange('friction', self%friction)
      call archive%exchange('cohesion', self%cohesion)
      call archive%exchange('cohesive_force', self%cohesive_force)
      call archive%exchange('broken', self%broken)
      call archive%enter('cohesive')
      call self%cohesive%exchange(archive)
      call archive%leave()
      call archive%exchange('slip_reference', self%slip_reference)
      call archive%exchange('gap_reference', self%gap_reference)
      call archive%exchange('friction_before', self%friction_before)
      call archive%exchange('limit_before', self%limit_before)
      call archive%exchange('impulse', self%impulse)
      call archive%exchange('weight', self%weight)
      call archive%exchange('gain', self%gain)
      call archive%exchange('node', self%node)
      call archive%exchange('pair_node', self%pair_node)
      call archive%exchange('force', self%force)
      call archive%exchange('mobility', self%mobility)
      call archive%exchange('counted', self%counted)
      call archive%exchange('group_pair', self%group_pair, used=self%n_groups + 1)
      call archive%exchange('group_node', self%group_node, used=self%n_groups + 1)
      call archive%exchange('partial', self%partial)
      call archive%exchange('jump', self%jump)
      call archive%exchange('kick', self%kick)
      call archive%exchange('key', self%key)
      call archive%exchange('by_key', self%by_key)
   end subroutine exchange

end submodule rf_contact_state
