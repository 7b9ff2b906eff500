!> Contact pairs that share nodes, where cracks meet: such a group of pairs is swept by Gauss-Seidel until its impulses stand.
!> Each step of a sweep waits for the one before, so that a group alone leaves the processor idle; here groups of equally many
!> pairs lie side by side in the lanes of vectors, as a bundle. No group feels its neighbours, nor shows them in its bits.
module rf_bundle_k
   use rf_kinds, only: wp
   use rf_step_k, only: lanes
   use rf_contact_blocks, only: property_normal, property_gain, property_friction, property_cohesion, property_slip, &
      property_gap, n_bundled_properties
   implicit none
   private
   public :: sweep_bundle, max_sweeps, most_bundled

   !> sweeps after which a group is left as it is until the next step
   integer, parameter :: max_sweeps = 30
   !> pairs in a group that is bundled
   integer, parameter :: most_bundled = 32

contains

   !> Impulses of the pairs of a bundle (theory: eqs. 17 to 21). Nodes are free or held in both directions, nothing softens.
   subroutine sweep_bundle(n, groups, pair, node, slot, along, across, tolerance, warm, b, ux, uy, vx, vy, impulse)
      !> pairs of each group; groups, one in each of the first lanes
      integer, intent(in) :: n, groups
      !> number among all pairs, nodes a and b of each; lanes without a group repeat the first
      integer, intent(in) :: pair(lanes, n), node(2, lanes, n)
      !> what each is, see rf_contact_blocks
      real(wp), intent(in) :: slot(lanes, n_bundled_properties, n)
      !> what a unit normal impulse of the second pair changes of gap (along) and slip (across) of the first; a tangential one
      !> of slip (along) and gap (-across) [length/impulse]
      real(wp), intent(in) :: along(lanes, n, n), across(lanes, n, n)
      !> largest change of an impulse in the last sweep, relative to the group's largest impulse
      real(wp), intent(in) :: tolerance
      !> part of the last step's impulses from which the sweeps start
      real(wp), intent(in) :: warm
      !> factor of r/m in the velocity update: a force F is the impulse b F
      real(wp), intent(in) :: b
      !> displacements and velocities after the update, without contact
      real(wp), intent(in) :: ux(*), uy(*), vx(*), vy(*)
      !> normal and tangential impulse of all pairs, (2, pairs)
      real(wp), intent(inout) :: impulse(2, *)
      !> gap and slip of each pair at the end of the step, its impulses
      real(wp) :: gap(lanes, most_bundled), slip(lanes, most_bundled), normal(lanes, most_bundled), tangent(lanes, most_bundled)
      !> changes of the impulses of a pair; largest change of the sweep, largest impulse
      real(wp) :: normal_change(lanes), tangent_change(lanes), change(lanes), largest(lanes)
      real(wp) :: pressing(lanes), sliding(lanes), bound(lanes), x, y
      !> 1 where the group is still swept, else 0
      real(wp) :: active(lanes)
      integer :: sweep, k, l, r
      do k = 1, n
         do l = 1, lanes
            x = ux(node(2, l, k)) - ux(node(1, l, k)) + (vx(node(2, l, k)) - vx(node(1, l, k)))
            y = uy(node(2, l, k)) - uy(node(1, l, k)) + (vy(node(2, l, k)) - vy(node(1, l, k)))
            gap(l, k) = slot(l, property_normal, k)*x + slot(l, property_normal + 1, k)*y - slot(l, property_gap, k)
            slip(l, k) = slot(l, property_normal, k)*y - slot(l, property_normal + 1, k)*x - slot(l, property_slip, k)
            normal(l, k) = warm*impulse(1, pair(l, k))
            tangent(l, k) = warm*impulse(2, pair(l, k))
         end do
      end do
      do k = 1, n
         do r = 1, n
            call add(normal(:, k), tangent(:, k), along(:, r, k), across(:, r, k), gap(:, r), slip(:, r))
         end do
      end do
      do l = 1, lanes
         active(l) = merge(1.0_wp, 0.0_wp, l <= groups)
      end do
      do sweep = 1, max_sweeps
         change = 0
         largest = 0
         do k = 1, n
            do l = 1, lanes
               pressing(l) = max(0.0_wp, normal(l, k) - gap(l, k)*slot(l, property_gain, k))
               bound(l) = slot(l, property_friction, k)*pressing(l) &
                          + b*slot(l, property_cohesion, k)*(0.5_wp + sign(0.5_wp, pressing(l) - tiny(bound)))      ! no branch
               sliding(l) = min(bound(l), max(-bound(l), tangent(l, k) - slip(l, k)*slot(l, property_gain + 1, k)))
               pressing(l) = merge(pressing(l), normal(l, k), active(l) > 0)
               sliding(l) = merge(sliding(l), tangent(l, k), active(l) > 0)
               normal_change(l) = pressing(l) - normal(l, k)
               tangent_change(l) = sliding(l) - tangent(l, k)
               normal(l, k) = pressing(l)
               tangent(l, k) = sliding(l)
               change(l) = max(change(l), max(abs(normal_change(l)), abs(tangent_change(l))))
               largest(l) = max(largest(l), pressing(l))
            end do
            do r = 1, n
               call add(normal_change, tangent_change, along(:, r, k), across(:, r, k), gap(:, r), slip(:, r))
            end do
         end do
         do l = 1, lanes
            active(l) = merge(active(l), 0.0_wp, change(l) > tolerance*largest(l))
         end do
         if (.not. any(active > 0)) exit
      end do
      do k = 1, n
         do l = 1, groups
            impulse(1, pair(l, k)) = normal(l, k)
            impulse(2, pair(l, k)) = tangent(l, k)
         end do
      end do

   contains

      !> Impulses of a pair of each group change gap and slip of another.
      subroutine add(normal_part, tangent_part, part_along, part_across, of_gap, of_slip)
         real(wp), intent(in) :: normal_part(lanes), tangent_part(lanes), part_along(lanes), part_across(lanes)
         real(wp), intent(inout) :: of_gap(lanes), of_slip(lanes)
         integer :: i
         !$omp simd
         do i = 1, lanes
            of_gap(i) = (of_gap(i) + part_along(i)*normal_part(i)) - part_across(i)*tangent_part(i)
            of_slip(i) = (of_slip(i) + part_across(i)*normal_part(i)) + part_along(i)*tangent_part(i)
         end do
      end subroutine add

   end subroutine sweep_bundle

end module rf_bundle_k
