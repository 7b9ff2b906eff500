!> Contact pairs that are solved at once: pairs that share no node with another and do not soften, whose nodes are free or
!> held in both directions. The normal impulse makes no slip and the tangential one no gap (theory: eqs. 20, 21).
module rf_direct_pair_k
   use rf_kinds, only: wp
   implicit none
   private
   public :: solve_direct
   public :: n_direct, direct_normal, direct_gain, direct_friction, direct_cohesion, direct_slip, direct_gap
   public :: direct_mobility, direct_residual, direct_reaction

   !> what a pair is, one after another, so that a pair is read from one place: unit normal from a to b (2), 1/w normal and
   !> tangential (2; eq. 19), coefficient of friction [-], cohesive force [force], slip at which the friction force is
   !> zero-based and gap at which the faces touch [length], 1/m of a and b, 0 where held (2), parts of the residuals of a
   !> and b that count as such (2) and as reaction (2)
   integer, parameter :: direct_normal = 1, direct_gain = 3, direct_friction = 5, direct_cohesion = 6, direct_slip = 7, &
      direct_gap = 8, direct_mobility = 9, direct_residual = 11, direct_reaction = 13, n_direct = 14

contains

   !> Impulses of pairs, applied to velocities and new displacements of their nodes; residuals of these with the contact
   !> forces in.
   subroutine solve_direct(first, last, pair, node, direct, b, loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, sums)
      !> the first and the last of them
      integer, intent(in) :: first, last
      !> number among all pairs of each; its nodes a and b
      integer, intent(in) :: pair(*), node(2, *)
      !> see n_direct
      real(wp), intent(in) :: direct(n_direct, *)
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
         nx = direct(direct_normal, d)
         ny = direct(direct_normal + 1, d)
         x = ux(j) - ux(i) + (vx(j) - vx(i))
         y = uy(j) - uy(i) + (vy(j) - vy(i))
         pressing = max(0.0_wp, (direct(direct_gap, d) - (nx*x + ny*y))*direct(direct_gain, d))
         bound = direct(direct_friction, d)*pressing &
                 + b*direct(direct_cohesion, d)*(0.5_wp + sign(0.5_wp, pressing - tiny(bound)))         ! no branch
         sliding = min(bound, max(-bound, (direct(direct_slip, d) - (nx*y - ny*x))*direct(direct_gain + 1, d)))
         impulse(1, pair(d)) = pressing
         impulse(2, pair(d)) = sliding
         x = nx*pressing - ny*sliding      ! the tangent is (-ny, nx)
         y = ny*pressing + nx*sliding
         vx(i) = vx(i) - direct(direct_mobility, d)*x
         vy(i) = vy(i) - direct(direct_mobility, d)*y
         vx(j) = vx(j) + direct(direct_mobility + 1, d)*x
         vy(j) = vy(j) + direct(direct_mobility + 1, d)*y
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
         residual = residual + direct(direct_residual, d)*of_a + direct(direct_residual + 1, d)*of_b
         reaction = reaction + direct(direct_reaction, d)*of_a + direct(direct_reaction + 1, d)*of_b
      end do
      sums = sums + [residual, reaction]
   end subroutine solve_direct

end module rf_direct_pair_k
