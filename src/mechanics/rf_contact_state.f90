!> The state that a checkpoint keeps of contact_t.
submodule(rf_contact) rf_contact_state
   implicit none

contains

   !> To or from a checkpoint. The work space too: a relaxation may be left in its midst.
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
      call archive%enter('blocks')
      call exchange_blocks(self%blocks, archive)
      call archive%leave()
      call archive%exchange('partial', self%partial)
      call archive%exchange('jump', self%jump)
      call archive%exchange('kick', self%kick)
      call archive%exchange('key', self%key)
      call archive%exchange('by_key', self%by_key)
   end subroutine exchange

   subroutine exchange_blocks(blocks, archive)
      type(contact_blocks_t), intent(inout) :: blocks
      class(archive_t), intent(inout) :: archive
      call archive%exchange('n', blocks%n)
      call archive%exchange('direct_first', blocks%direct_first)
      call archive%exchange('direct_outer', blocks%direct_outer)
      call archive%exchange('direct_pair', blocks%direct_pair)
      call archive%exchange('direct_node', blocks%direct_node)
      call archive%exchange('direct', blocks%direct)
      call archive%exchange('swept_first', blocks%swept_first)
      call archive%exchange('swept', blocks%swept)
      call archive%exchange('touching_first', blocks%touching_first)
      call archive%exchange('touching', blocks%touching)
      call archive%exchange('single_first', blocks%single_first)
      call archive%exchange('single', blocks%single)
      call archive%exchange('bundle_first', blocks%bundle_first)
      call archive%exchange('bundle_pairs', blocks%bundle_pairs)
      call archive%exchange('bundle_groups', blocks%bundle_groups)
      call archive%exchange('bundle_slot', blocks%bundle_slot)
      call archive%exchange('bundle_entry', blocks%bundle_entry)
      call archive%exchange('slot_pair', blocks%slot_pair)
      call archive%exchange('slot_node', blocks%slot_node)
      call archive%exchange('slot', blocks%slot)
      call archive%exchange('along', blocks%along)
      call archive%exchange('across', blocks%across)
   end subroutine exchange_blocks

end submodule rf_contact_state
