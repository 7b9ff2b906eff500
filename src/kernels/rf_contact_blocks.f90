!> Pairs and contact nodes of each block of nodes, as the kernels walk through them.
module rf_contact_blocks
   use rf_kinds, only: wp
   implicit none
   private
   public :: contact_blocks_t
   public :: property_normal, property_gain, property_friction, property_cohesion, property_slip, property_gap, &
      property_mobility, property_residual, property_reaction, n_properties, n_bundled_properties

   !> what a pair is, one after another, so that it is read from one place: unit normal from a to b (2), 1/w normal and
   !> tangential (2; eq. 19), coefficient of friction [-], cohesive force [force], slip at which the friction force is
   !> zero-based and gap at which the faces touch [length]; for pairs that are solved at once also 1/m of a and b, 0 where held
   !> (2), parts of the residuals of a and b that count as such (2) and as reaction (2)
   integer, parameter :: property_normal = 1, property_gain = 3, property_friction = 5, property_cohesion = 6, &
      property_slip = 7, property_gap = 8, n_bundled_properties = 8, property_mobility = 9, property_residual = 11, &
      property_reaction = 13, n_properties = 14

   !> All `_first` have one entry more than there are blocks: what a block has ends where that of the next one begins.
   type :: contact_blocks_t
      !> blocks of nodes
      integer :: n = 0
      !> contact nodes
      integer, allocatable :: node_first(:), node(:)
      !> pairs that are solved at once (rf_direct_pair_k), in the block of their lower node; in each those first whose nodes
      !> both lie in it, then those that wait for another block: the first of these, (blocks)
      integer, allocatable :: direct_first(:), direct_outer(:)
      !> number among all pairs of each; its nodes, (2, direct pairs); what it is, (n_properties, direct pairs)
      integer, allocatable :: direct_pair(:), direct_node(:, :)
      real(wp), allocatable :: direct(:, :)
      !> groups of pairs that are swept, in the block of their lowest node; those of them that are swept one by one
      integer, allocatable :: swept_first(:), swept(:), single_first(:), single(:)
      !> the others side by side, in bundles (rf_bundle_k)
      integer, allocatable :: bundle_first(:)
      !> of each bundle: pairs of each of its groups, groups, first slot, first entry of along and across
      integer, allocatable :: bundle_pairs(:), bundle_groups(:), bundle_slot(:), bundle_entry(:)
      !> slots, one pair of each group: numbers of the pairs, (lanes, slots), their nodes a and b lane by lane, (2 x lanes, slots),
      !> and what they are, one property after another, (lanes x n_bundled_properties, slots)
      integer, allocatable :: slot_pair(:, :), slot_node(:, :)
      real(wp), allocatable :: slot(:, :)
      !> how the pairs of a group act on one another, (lanes, entries)
      real(wp), allocatable :: along(:, :), across(:, :)
   end type contact_blocks_t

end module rf_contact_blocks
