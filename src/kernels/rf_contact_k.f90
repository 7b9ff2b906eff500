!> Contact impulses of node pairs by Gauss-Seidel, after Katona (1983): open, stick or slip, exact, no penalty.
!> Pairs that share no node do not feel each other; each group of connected pairs is swept by itself to its own
!> convergence, groups in parallel, with the same bits for any number of threads.
module rf_contact_k
   use rf_kinds, only: wp
   use rf_cohesive_k, only: cohesive_pair_t, solve_pair
   implicit none
   private
   public :: contact_step, max_sweeps

   !> sweeps after which a group is left as it is until the next step
   integer, parameter :: max_sweeps = 30
   !> groups below which a second thread costs more than it brings (a group of one pair takes some 50 ns, waking a thread
   !> 10 to 50 us)
   integer, parameter :: groups_for_threads = 1024

contains

   !> Impulses that keep all pairs from interpenetrating and within Coulomb friction (theory: eqs. 17 to 22), applied
   !> to velocities and new displacements; residuals of the contact nodes with the contact forces in.
   subroutine contact_step(n_groups, group_pair, group_node, node, pair_node, normal, normal_weight, tangent_weight, &
                           friction, cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, tolerance, b, &
                           counted, inverse_mass, free_x, free_y, ux, uy, wx, wy, vx, vy, rx, ry, impulse, cohesive, separation, &
                           force, partial)
      integer, intent(in) :: n_groups
      !> first pair and first contact node of each group, (groups + 1)
      integer, intent(in), contiguous :: group_pair(:), group_node(:)
      !> node of each contact node; contact nodes a and b of each pair, (2, pairs)
      integer, intent(in), contiguous :: node(:), pair_node(:, :)
      !> unit normal from a to b, (2, pairs)
      real(wp), intent(in), contiguous :: normal(:, :)
      !> n.(1/m_a + 1/m_b).n and the same for the tangent; 0 where both sides are held
      real(wp), intent(in), contiguous :: normal_weight(:), tangent_weight(:)
      !> coefficient of friction [-], cohesive force [force], slip at which the friction force is zero-based [length]
      real(wp), intent(in), contiguous :: friction(:), cohesion(:), slip_reference(:)
      !> gap at which the faces touch, not above 0 [length], (pairs)
      real(wp), intent(in), contiguous :: gap_reference(:)
      !> the pair softens; it is new and bears what holds it together, (pairs)
      logical, intent(in), contiguous :: bonded(:), rigid(:)
      !> softening pairs: force of the full strength [force] and jump at which nothing is left [length], opening and slip,
      !> (2, pairs); largest separation of any accepted state [-], (pairs)
      real(wp), intent(in), contiguous :: cap(:, :), critical(:, :), damage(:)
      !> largest change of an impulse in the last sweep, relative to the group's largest impulse
      real(wp), intent(in) :: tolerance
      !> factor of r/m in the velocity update: a force F is the impulse b F
      real(wp), intent(in) :: b
      !> per node: see relaxation_step
      real(wp), intent(in), contiguous :: counted(:), inverse_mass(:), free_x(:), free_y(:), ux(:), uy(:)
      real(wp), intent(inout), contiguous :: wx(:), wy(:), vx(:), vy(:)
      !> residuals without contact [force], (nodes)
      real(wp), intent(in), contiguous :: rx(:), ry(:)
      !> normal and tangential impulse of each pair, (2, pairs)
      real(wp), intent(inout), contiguous :: impulse(:, :)
      !> softening pairs: the cohesive part of it, (2, pairs), and the separation, (pairs)
      real(wp), intent(inout), contiguous :: cohesive(:, :), separation(:)
      !> contact force on each contact node [force], (2, contact nodes)
      real(wp), intent(inout), contiguous :: force(:, :)
      !> |r|^2 over free and over supported directions of each group, (2, groups)
      real(wp), intent(inout), contiguous :: partial(:, :)
      integer :: g

      !$omp parallel do default(none) schedule(static) if (n_groups >= groups_for_threads) &
      !$omp    shared(n_groups, group_pair, group_node, node, pair_node, normal, normal_weight, tangent_weight, friction, &
      !$omp           cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, tolerance, b, counted, &
      !$omp           inverse_mass, free_x, free_y, ux, uy, wx, wy, vx, vy, rx, ry, impulse, cohesive, separation, &
      !$omp           force, partial) private(g)
      do g = 1, n_groups
         call sweep_group(group_pair(g), group_pair(g + 1) - 1, node, pair_node, normal, normal_weight, tangent_weight, &
                          friction, cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, tolerance, b, &
                          inverse_mass, free_x, free_y, ux, uy, vx, vy, impulse, cohesive, separation)
         call add_forces(group_pair(g), group_pair(g + 1) - 1, group_node(g), group_node(g + 1) - 1, node, pair_node, &
                         normal, b, counted, free_x, free_y, ux, uy, wx, wy, vx, vy, rx, ry, impulse, force, partial(:, g))
      end do
      !$omp end parallel do
   end subroutine contact_step

   !> Sweep one group of pairs until its impulses stand.
   subroutine sweep_group(first, last, node, pair_node, normal, normal_weight, tangent_weight, friction, cohesion, &
                          slip_reference, gap_reference, bonded, rigid, cap, critical, damage, tolerance, b, inverse_mass, &
                          free_x, free_y, ux, uy, vx, vy, impulse, cohesive, separation)
      !> pairs of the group
      integer, intent(in) :: first, last
      !> see contact_step; without descriptors, which cost as much as the sweep of a lone pair
      integer, intent(in) :: node(*), pair_node(2, *)
      real(wp), intent(in) :: normal(2, *), normal_weight(*), tangent_weight(*), friction(*), cohesion(*)
      logical, intent(in) :: bonded(*), rigid(*)
      real(wp), intent(in) :: slip_reference(*), gap_reference(*), cap(2, *), critical(2, *), damage(*), tolerance, b
      real(wp), intent(in) :: inverse_mass(*)
      real(wp), intent(in) :: free_x(*), free_y(*), ux(*), uy(*)
      real(wp), intent(inout) :: vx(*), vy(*), impulse(2, *), cohesive(2, *), separation(*)
      real(wp) :: change, largest, now, before, bound, nx, ny, x, y
      integer :: sweep, p, i, j
      impulse(:, first:last) = 0
      do sweep = 1, max_sweeps
         change = 0
         largest = 0
         do p = first, last
            i = node(pair_node(1, p))
            j = node(pair_node(2, p))
            nx = normal(1, p)
            ny = normal(2, p)
            if (bonded(p)) then
               call soften()
               cycle
            end if
            x = ux(j) - ux(i) + (vx(j) - vx(i))
            y = uy(j) - uy(i) + (vy(j) - vy(i))
            if (normal_weight(p) > 0) then
               before = impulse(1, p)
               now = max(0.0_wp, before - (nx*x + ny*y - gap_reference(p))/normal_weight(p))
               impulse(1, p) = now
               call push(i, j, nx*(now - before), ny*(now - before))
               change = max(change, abs(now - before))
               largest = max(largest, now)
            end if
            if (tangent_weight(p) > 0) then      ! the tangent is (-ny, nx)
               x = ux(j) - ux(i) + (vx(j) - vx(i))
               y = uy(j) - uy(i) + (vy(j) - vy(i))
               bound = friction(p)*impulse(1, p)
               if (impulse(1, p) > 0) bound = bound + b*cohesion(p)
               before = impulse(2, p)
               now = before - (nx*y - ny*x - slip_reference(p))/tangent_weight(p)
               now = min(bound, max(-bound, now))
               impulse(2, p) = now
               call push(i, j, -ny*(now - before), nx*(now - before))
               change = max(change, abs(now - before))
            end if
         end do
         if (change <= tolerance*largest .or. is_exact()) exit
      end do

   contains

      !> A pair that softens: both impulses at once.
      subroutine soften()
         type(cohesive_pair_t) :: pair
         real(wp) :: jump(2), next(2)
         x = ux(j) - ux(i) + (vx(j) - vx(i))
         y = uy(j) - uy(i) + (vy(j) - vy(i))
         jump = [nx*x + ny*y - gap_reference(p), nx*y - ny*x]
         pair%weight = [normal_weight(p), tangent_weight(p)]
         pair%free = jump - pair%weight*impulse(:, p)
         pair%cap = b*cap(:, p)
         pair%critical = critical(:, p)
         pair%damage = damage(p)
         pair%rigid = rigid(p)
         pair%friction = friction(p)
         pair%bond = b*cohesion(p)
         pair%slip_reference = slip_reference(p)
         call solve_pair(pair, next, cohesive(:, p), separation(p))
         jump = next - impulse(:, p)
         impulse(:, p) = next
         call push(i, j, nx*jump(1) - ny*jump(2), ny*jump(1) + nx*jump(2))
         change = max(change, maxval(abs(jump)))
         largest = max(largest, maxval(abs(next)))
      end subroutine soften

      !> One sweep solves a lone pair whose nodes are equally free in both directions: its tangential impulse leaves the
      !> normal one as it is.
      logical function is_exact()
         is_exact = first == last
         if (is_exact) is_exact = abs(free_x(i) - free_y(i)) + abs(free_x(j) - free_y(j)) <= 0
      end function is_exact

      !> An impulse on b, its opposite on a.
      subroutine push(a_side, b_side, jx, jy)
         integer, intent(in) :: a_side, b_side
         real(wp), intent(in) :: jx, jy
         vx(a_side) = vx(a_side) - free_x(a_side)*inverse_mass(a_side)*jx
         vy(a_side) = vy(a_side) - free_y(a_side)*inverse_mass(a_side)*jy
         vx(b_side) = vx(b_side) + free_x(b_side)*inverse_mass(b_side)*jx
         vy(b_side) = vy(b_side) + free_y(b_side)*inverse_mass(b_side)*jy
      end subroutine push

   end subroutine sweep_group

   !> Contact forces of a group's nodes, their new displacements and residuals.
   subroutine add_forces(first, last, first_node, last_node, node, pair_node, normal, b, counted, free_x, free_y, &
                         ux, uy, wx, wy, vx, vy, rx, ry, impulse, force, sums)
      integer, intent(in) :: first, last, first_node, last_node, node(*), pair_node(2, *)
      real(wp), intent(in) :: normal(2, *), b, counted(*), free_x(*), free_y(*), ux(*), uy(*), vx(*), vy(*), rx(*), ry(*)
      real(wp), intent(in) :: impulse(2, *)
      real(wp), intent(inout) :: wx(*), wy(*), force(2, *)
      real(wp), intent(out) :: sums(2)
      real(wp) :: f(2), x, y
      integer :: p, c, i
      force(:, first_node:last_node) = 0
      do p = first, last
         f(1) = (normal(1, p)*impulse(1, p) - normal(2, p)*impulse(2, p))/b
         f(2) = (normal(2, p)*impulse(1, p) + normal(1, p)*impulse(2, p))/b
         force(:, pair_node(1, p)) = force(:, pair_node(1, p)) - f
         force(:, pair_node(2, p)) = force(:, pair_node(2, p)) + f
      end do
      sums = 0
      do c = first_node, last_node
         i = node(c)
         wx(i) = ux(i) + vx(i)
         wy(i) = uy(i) + vy(i)
         x = rx(i) + force(1, c)
         y = ry(i) + force(2, c)
         sums(1) = sums(1) + counted(i)*(free_x(i)*x*x + free_y(i)*y*y)
         sums(2) = sums(2) + counted(i)*((1 - free_x(i))*x*x + (1 - free_y(i))*y*y)
      end do
   end subroutine add_forces

end module rf_contact_k
