!> Pairs and contact nodes of each block of nodes, as the kernels walk through them.
module rf_contact_blocks
   use rf_kinds, only: wp
   implicit none
   private
   public :: contact_blocks_t

   !> All `_first` have one entry more than there are blocks: what a block has ends where that of the next one begins.
   type :: contact_blocks_t
      !> blocks of nodes
      integer :: n = 0
      !> contact nodes
      integer, allocatable :: touching_first(:), touching(:)
      !> pairs that are solved at once (rf_direct_pair_k), in the block of their lower node; in each those first whose nodes
      !> both lie in it, then from direct_outer on, (blocks), those that wait for another block
      integer, allocatable :: direct_first(:), direct_outer(:)
      !> number among all pairs of each; its nodes, (2, direct pairs); what it is, (n_direct, direct pairs)
      integer, allocatable :: direct_pair(:), direct_node(:, :)
      real(wp), allocatable :: direct(:, :)
      !> groups of pairs that are swept, in the block of their lowest node; those of them that are swept one by one
      integer, allocatable :: swept_first(:), swept(:), single_first(:), single(:)
      !> the others side by side, in bundles (rf_bundle_k)
      integer, allocatable :: bundle_first(:)
      !> of each bundle: pairs of each of its groups, groups, first slot, first entry of along and across
      integer, allocatable :: bundle_pairs(:), bundle_groups(:), bundle_slot(:), bundle_entry(:)
      !> slots, one pair of each group: numbers of the pairs, (lanes, slots), their nodes a and b lane by lane, (2 x lanes, slots),
      !> and what they are, n_slot properties one after another, (lanes x n_slot, slots)
      integer, allocatable :: slot_pair(:, :), slot_node(:, :)
      real(wp), allocatable :: slot(:, :)
      !> how the pairs of a group act on one another, (lanes, entries)
      real(wp), allocatable :: along(:, :), across(:, :)
   end type contact_blocks_t

end module rf_contact_blocks
