!> Contact pairs that are solved at once: pairs that share no node with another and do not soften, whose nodes are free or
!> held in both directions. The normal impulse makes no slip and the tangential one no gap (theory: eqs. 20, 21).
module rf_direct_pair_k
   use rf_kinds, only: wp
   use rf_contact_blocks, only: property_normal, property_gain, property_friction, property_cohesion, property_slip, &
      property_gap, property_mobility, property_residual, property_reaction, n_properties
   implicit none
   private
   public :: solve_direct

contains

   !> Impulses of pairs, applied to velocities and new displacements of their nodes; residuals of these with the contact
   !> forces in.
   subroutine solve_direct(first, last, pair, node, direct, b, loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, sums)
      !> the first and the last of them
      integer, intent(in) :: first, last
      !> number among all pairs of each; its nodes a and b
      integer, intent(in) :: pair(*), node(2, *)
      !> what each is, see rf_contact_blocks
      real(wp), intent(in) :: direct(n_properties, *)
      !> factor of r/m in the velocity update: a force F is the impulse b F
      real(wp), intent(in) :: b
      !> forces are applied to nodes; else px, py are not read
      logical, intent(in) :: loaded
      !> per node: see relaxation_step
      real(wp), intent(in) :: px(*), py(*), fx(*), fy(*), ux(*), uy(*)
      real(wp), intent(inout) :: wx(*), wy(*), vx(*), vy(*)
      !> normal and tangential impulse of all pairs, (2, pairs)
      real(wp), intent(inout) :: impulse(2, *)
      !> |r|^2 of the pairs' nodes over free and over supported directions is added here
      real(wp), intent(inout) :: sums(2)
      real(wp) :: nx, ny, x, y, pressing, sliding, bound, residual, reaction, per_b, of_a, of_b, p_a(2), p_b(2)
      integer :: d, i, j
      residual = 0
      reaction = 0
      per_b = 1/b
      p_a = 0
      p_b = 0
      do d = first, last
         i = node(1, d)
         j = node(2, d)
         nx = direct(property_normal, d)
         ny = direct(property_normal + 1, d)
         x = ux(j) - ux(i) + (vx(j) - vx(i))
         y = uy(j) - uy(i) + (vy(j) - vy(i))
         pressing = max(0.0_wp, (direct(property_gap, d) - (nx*x + ny*y))*direct(property_gain, d))
         bound = direct(property_friction, d)*pressing &
                 + b*direct(property_cohesion, d)*(0.5_wp + sign(0.5_wp, pressing - tiny(bound)))         ! no branch
         sliding = min(bound, max(-bound, (direct(property_slip, d) - (nx*y - ny*x))*direct(property_gain + 1, d)))
         impulse(1, pair(d)) = pressing
         impulse(2, pair(d)) = sliding
         x = nx*pressing - ny*sliding      ! the tangent is (-ny, nx)
         y = ny*pressing + nx*sliding
         vx(i) = vx(i) - direct(property_mobility, d)*x
         vy(i) = vy(i) - direct(property_mobility, d)*y
         vx(j) = vx(j) + direct(property_mobility + 1, d)*x
         vy(j) = vy(j) + direct(property_mobility + 1, d)*y
         wx(i) = ux(i) + vx(i)
         wy(i) = uy(i) + vy(i)
         wx(j) = ux(j) + vx(j)
         wy(j) = uy(j) + vy(j)
         if (loaded) then
            p_a = [px(i), py(i)]
            p_b = [px(j), py(j)]
         end if
         x = x*per_b
         y = y*per_b
         of_a = (p_a(1) - fx(i) - x)**2 + (p_a(2) - fy(i) - y)**2
         of_b = (p_b(1) - fx(j) + x)**2 + (p_b(2) - fy(j) + y)**2
         residual = residual + direct(property_residual, d)*of_a + direct(property_residual + 1, d)*of_b
         reaction = reaction + direct(property_reaction, d)*of_a + direct(property_reaction + 1, d)*of_b
      end do
      sums = sums + [residual, reaction]
   end subroutine solve_direct

end module rf_direct_pair_k
