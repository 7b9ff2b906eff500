!> Contact impulses of node pairs, after Katona (1983): open, stick or slip, exact, no penalty. Pairs that share no node do
!> not feel each other: such a pair is solved at once (rf_direct_pair_k), most of them by the step kernel as soon as it has
!> moved their nodes; a group of connected pairs is swept by Gauss-Seidel to its own convergence. Pairs belong to the block of
!> nodes of their lowest node and are worked on by the thread that moved it, whose caches hold it. No result depends on the
!> number of threads.
module rf_contact_k
   use rf_kinds, only: wp, i1
   use rf_step_k, only: blocks_for_threads, lanes
   use rf_cohesive_k, only: cohesive_pair_t, solve_pair
   use rf_direct_pair_k, only: solve_direct
   implicit none
   private
   public :: contact_step, max_sweeps, most_coupled

   !> sweeps after which a group is left as it is until the next step
   integer, parameter :: max_sweeps = 30
   !> groups below which a second thread costs more than it brings: to wake and await it takes the time of some hundred pairs
   integer, parameter :: groups_for_threads = 256
   !> vectors that hold gaps and slips of a group; pairs in it for which they suffice
   integer, parameter :: most_vectors = 8, most_coupled = most_vectors*lanes/2

contains

   !> Impulses that keep all pairs from interpenetrating and within Coulomb friction (theory: eqs. 17 to 22), applied
   !> to velocities and new displacements; residuals of the contact nodes with the contact forces in.
   subroutine contact_step(n_blocks, direct_from, direct_to, direct_pair, direct_node, direct, swept_first, swept, group_pair, &
                           group_node, node, pair_node, normal, weight, gain, friction, cohesion, slip_reference, gap_reference, &
                           bonded, rigid, cap, critical, damage, mobility, counted, group_column, coupling, tolerance, warm, b, &
                           free_x, free_y, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, cohesive, separation, force, jump, &
                           kick, partial)
      integer, intent(in) :: n_blocks
      !> direct pairs of each block that are left to do, from the one to before the other, (blocks); see solve_direct
      integer, intent(in), contiguous :: direct_from(:), direct_to(:), direct_pair(:), direct_node(:, :)
      real(wp), intent(in), contiguous :: direct(:, :)
      !> groups that are swept, block by block: the first of each block, (blocks + 1); their numbers
      integer, intent(in), contiguous :: swept_first(:), swept(:)
      !> first pair and first contact node of each group, (groups + 1)
      integer, intent(in), contiguous :: group_pair(:), group_node(:)
      !> node of each contact node; contact nodes a and b of each pair, (2, pairs)
      integer, intent(in), contiguous :: node(:), pair_node(:, :)
      !> unit normal from a to b, (2, pairs)
      real(wp), intent(in), contiguous :: normal(:, :)
      !> w of eq. 19, normal and tangential, and 1/w; both 0 where both sides are held, (2, pairs)
      real(wp), intent(in), contiguous :: weight(:, :), gain(:, :)
      !> coefficient of friction [-], cohesive force [force], slip at which the friction force is zero-based [length]
      real(wp), intent(in), contiguous :: friction(:), cohesion(:), slip_reference(:)
      !> gap at which the faces touch, not above 0 [length], (pairs)
      real(wp), intent(in), contiguous :: gap_reference(:)
      !> the pair softens; it is new and bears what holds it together, (pairs)
      logical, intent(in), contiguous :: bonded(:), rigid(:)
      !> softening pairs: force of the full strength [force] and jump at which nothing is left [length], opening and slip,
      !> (2, pairs); largest separation of any accepted state [-], (pairs)
      real(wp), intent(in), contiguous :: cap(:, :), critical(:, :), damage(:)
      !> 1/m of each contact node, 0 in directions that are held, (2, contact nodes)
      real(wp), intent(in), contiguous :: mobility(:, :)
      !> parts of a contact node's residual that count as such and as reaction: 1 and 0, at held nodes 0 and 1, on loose
      !> pieces 0 and 0, (2, contact nodes)
      real(wp), intent(in), contiguous :: counted(:, :)
      !> first column of each group in `coupling`, 0: the group has none, (groups)
      integer, intent(in), contiguous :: group_column(:)
      !> what a unit impulse changes of gap and slip of each pair of its group: a column for each of the two impulses of each
      !> pair, filled up to whole vectors with zeros, (lanes, vectors) [length/impulse]
      real(wp), intent(in), contiguous :: coupling(:, :)
      !> largest change of an impulse in the last sweep, relative to the group's largest impulse
      real(wp), intent(in) :: tolerance
      !> part of the last step's impulses from which connected pairs start (others from none)
      real(wp), intent(in) :: warm
      !> factor of r/m in the velocity update: a force F is the impulse b F
      real(wp), intent(in) :: b
      !> per node: see relaxation_step
      integer(i1), intent(in), contiguous :: free_x(:), free_y(:)
      real(wp), intent(in), contiguous :: px(:), py(:), fx(:), fy(:), ux(:), uy(:)
      real(wp), intent(inout), contiguous :: wx(:), wy(:), vx(:), vy(:)
      !> normal and tangential impulse of each pair, (2, pairs)
      real(wp), intent(inout), contiguous :: impulse(:, :)
      !> softening pairs: the cohesive part of it, (2, pairs), and the separation, (pairs)
      real(wp), intent(inout), contiguous :: cohesive(:, :), separation(:)
      !> workspace of the groups: contact forces [force] and changes of velocity, (2, contact nodes); gap and slip that each
      !> pair would have without impulses, (2, pairs)
      real(wp), intent(inout), contiguous :: force(:, :), jump(:, :), kick(:, :)
      !> |r|^2 of the contact nodes over free and over supported directions, of each block, (2, blocks)
      real(wp), intent(inout), contiguous :: partial(:, :)
      integer :: k, to_do

      to_do = swept_first(n_blocks + 1) - 1 + sum(direct_to(:n_blocks) - direct_from(:n_blocks))
      !$omp parallel do default(none) schedule(static) if (n_blocks >= blocks_for_threads .and. to_do > groups_for_threads) &
      !$omp    shared(n_blocks, direct_from, direct_to, direct_pair, direct_node, direct, swept_first, swept, group_pair, &
      !$omp           group_node, node, pair_node, normal, weight, gain, friction, cohesion, slip_reference, gap_reference, &
      !$omp           bonded, rigid, cap, critical, damage, mobility, counted, group_column, coupling, tolerance, warm, b, &
      !$omp           free_x, free_y, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, cohesive, separation, force, jump, kick, &
      !$omp           partial) private(k)
      do k = 1, n_blocks
         partial(:, k) = 0
         call solve_direct(direct_from(k), direct_to(k) - 1, direct_pair, direct_node, direct, b, size(px) > 0, px, py, fx, fy, &
                           ux, uy, wx, wy, vx, vy, impulse, partial(:, k))
         call solve_groups(swept_first(k), swept_first(k + 1) - 1, swept, group_pair, group_node, node, pair_node, normal, &
                           weight, gain, friction, cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, &
                           damage, mobility, counted, group_column, coupling, tolerance, warm, b, free_x, free_y, &
                           size(px) > 0, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, cohesive, separation, force, jump, &
                           kick, partial(:, k))
      end do
      !$omp end parallel do
   end subroutine contact_step

   !> Groups of pairs one by one.
   subroutine solve_groups(first, last, swept, group_pair, group_node, node, pair_node, normal, weight, gain, friction, &
                           cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, mobility, counted, &
                           group_column, coupling, tolerance, warm, b, free_x, free_y, loaded, px, py, fx, fy, ux, uy, wx, wy, &
                           vx, vy, impulse, cohesive, separation, force, jump, kick, sums)
      !> the first and the last of them in the list of groups
      integer, intent(in) :: first, last, swept(*)
      !> see contact_step; without descriptors
      integer, intent(in) :: group_pair(*), group_node(*), node(*), pair_node(2, *), group_column(*)
      real(wp), intent(in) :: normal(2, *), weight(2, *), gain(2, *), friction(*), cohesion(*), slip_reference(*)
      real(wp), intent(in) :: gap_reference(*), cap(2, *), critical(2, *), damage(*), mobility(2, *), counted(2, *)
      real(wp), intent(in) :: coupling(lanes, *)
      logical, intent(in) :: bonded(*), rigid(*), loaded
      integer(i1), intent(in) :: free_x(*), free_y(*)
      real(wp), intent(in) :: tolerance, warm, b, px(*), py(*), fx(*), fy(*), ux(*), uy(*)
      real(wp), intent(inout) :: wx(*), wy(*), vx(*), vy(*), impulse(2, *), cohesive(2, *), separation(*)
      real(wp), intent(inout) :: force(2, *), jump(2, *), kick(2, *), sums(2)
      real(wp) :: from
      integer :: i, g
      do i = first, last
         g = swept(i)
         from = merge(warm, 0.0_wp, group_pair(g + 1) - group_pair(g) > 1)
         if (group_column(g) > 0) then
            call sweep_coupled(group_pair(g + 1) - group_pair(g), group_pair(g), node, pair_node, normal, gain, friction, &
                               cohesion, slip_reference, gap_reference, coupling(1, group_column(g)), tolerance, from, b, &
                               ux, uy, vx, vy, impulse)
         else
            call sweep_group(group_pair(g), group_pair(g + 1) - 1, group_node(g), group_node(g + 1) - 1, node, pair_node, normal, &
                             weight, gain, friction, cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, &
                             damage, mobility, tolerance, from, b, ux, uy, vx, vy, impulse, cohesive, separation, jump, kick)
         end if
         call move_nodes(group_pair(g), group_pair(g + 1) - 1, group_node(g), group_node(g + 1) - 1, node, pair_node, normal, &
                         mobility, counted, b, free_x, free_y, loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, &
                         force, sums)
      end do
   end subroutine solve_groups

   !> Sweep a group whose nodes are free or held in both directions and of which nothing softens: gaps and slips of all its
   !> pairs at once follow each change of an impulse.
   subroutine sweep_coupled(n, first, node, pair_node, normal, gain, friction, cohesion, slip_reference, gap_reference, &
                            coupling, tolerance, warm, b, ux, uy, vx, vy, impulse)
      !> pairs of the group, the first of them
      integer, intent(in) :: n, first
      !> see contact_step; without descriptors
      integer, intent(in) :: node(*), pair_node(2, *)
      real(wp), intent(in) :: normal(2, *), gain(2, *), friction(*), cohesion(*), slip_reference(*), gap_reference(*)
      real(wp), intent(in) :: coupling(lanes*((2*n - 1)/lanes + 1), 2, *), tolerance, warm, b, ux(*), uy(*), vx(*), vy(*)
      real(wp), intent(inout) :: impulse(2, *)
      !> gap and slip of each pair at the end of the step
      real(wp) :: jump(lanes*most_vectors)
      real(wp) :: change, largest, pressing, sliding, bound, normal_change, tangent_change, x, y
      integer :: sweep, k, last, p, i, j, rows
      rows = lanes*((2*n - 1)/lanes + 1)
      jump(rows - lanes + 1:rows) = 0
      do k = 1, n
         p = first + k - 1
         i = node(pair_node(1, p))
         j = node(pair_node(2, p))
         x = ux(j) - ux(i) + (vx(j) - vx(i))
         y = uy(j) - uy(i) + (vy(j) - vy(i))
         jump(2*k - 1) = normal(1, p)*x + normal(2, p)*y - gap_reference(p)
         jump(2*k) = normal(1, p)*y - normal(2, p)*x - slip_reference(p)
      end do
      do k = 1, n
         p = first + k - 1
         impulse(:, p) = warm*impulse(:, p)
         call add(k, impulse(1, p), impulse(2, p))
      end do
      last = n
      normal_change = 0
      tangent_change = 0
      do sweep = 1, max_sweeps
         change = 0
         largest = 0
         do k = 1, n
            p = first + k - 1
            ! this pair sees the last change at once, by a way shorter than through all gaps and slips
            x = jump(2*k - 1) + coupling(2*k - 1, 1, last)*normal_change + coupling(2*k - 1, 2, last)*tangent_change
            y = jump(2*k) + coupling(2*k, 1, last)*normal_change + coupling(2*k, 2, last)*tangent_change
            call add(last, normal_change, tangent_change)
            pressing = max(0.0_wp, impulse(1, p) - x*gain(1, p))
            bound = friction(p)*pressing + b*cohesion(p)*(0.5_wp + sign(0.5_wp, pressing - tiny(bound)))
            sliding = min(bound, max(-bound, impulse(2, p) - y*gain(2, p)))
            normal_change = pressing - impulse(1, p)
            tangent_change = sliding - impulse(2, p)
            last = k
            impulse(1, p) = pressing
            impulse(2, p) = sliding
            change = max(change, max(abs(normal_change), abs(tangent_change)))
            largest = max(largest, pressing)
         end do
         if (change <= tolerance*largest) exit
      end do

   contains

      !> Impulses of a pair change gaps and slips.
      subroutine add(pair, normal_part, tangent_part)
         integer, intent(in) :: pair
         real(wp), intent(in) :: normal_part, tangent_part
         integer :: v, l
         do v = 0, rows - 1, lanes
            do l = 1, lanes
               jump(v + l) = (jump(v + l) + coupling(v + l, 1, pair)*normal_part) + coupling(v + l, 2, pair)*tangent_part
            end do
         end do
      end subroutine add

   end subroutine sweep_coupled

   !> Sweep one group of pairs until its impulses stand. It works on what the impulses change of the velocities (kick).
   subroutine sweep_group(first, last, first_node, last_node, node, pair_node, normal, weight, gain, friction, cohesion, &
                          slip_reference, gap_reference, bonded, rigid, cap, critical, damage, mobility, tolerance, warm, b, &
                          ux, uy, vx, vy, impulse, cohesive, separation, jump, kick)
      !> pairs and contact nodes of the group
      integer, intent(in) :: first, last, first_node, last_node
      !> see contact_step; without descriptors
      integer, intent(in) :: node(*), pair_node(2, *)
      real(wp), intent(in) :: normal(2, *), weight(2, *), gain(2, *), friction(*), cohesion(*), slip_reference(*)
      real(wp), intent(in) :: gap_reference(*), cap(2, *), critical(2, *), damage(*), mobility(2, *), tolerance, warm, b
      logical, intent(in) :: bonded(*), rigid(*)
      real(wp), intent(in) :: ux(*), uy(*), vx(*), vy(*)
      real(wp), intent(inout) :: impulse(2, *), cohesive(2, *), separation(*), jump(2, *), kick(2, *)
      real(wp) :: change, largest, now, delta, bound, nx, ny, x, y
      integer :: sweep, p, i, j
      kick(:, first_node:last_node) = 0
      do p = first, last
         i = node(pair_node(1, p))
         j = node(pair_node(2, p))
         x = ux(j) - ux(i) + (vx(j) - vx(i))
         y = uy(j) - uy(i) + (vy(j) - vy(i))
         jump(1, p) = normal(1, p)*x + normal(2, p)*y - gap_reference(p)
         jump(2, p) = normal(1, p)*y - normal(2, p)*x
         impulse(:, p) = warm*impulse(:, p)
         nx = normal(1, p)*impulse(1, p) - normal(2, p)*impulse(2, p)
         ny = normal(2, p)*impulse(1, p) + normal(1, p)*impulse(2, p)
         call push(pair_node(1, p), pair_node(2, p), nx, ny)
      end do
      do sweep = 1, max_sweeps
         change = 0
         largest = 0
         do p = first, last
            i = pair_node(1, p)
            j = pair_node(2, p)
            nx = normal(1, p)
            ny = normal(2, p)
            x = kick(1, j) - kick(1, i)
            y = kick(2, j) - kick(2, i)
            if (bonded(p)) then
               call soften()
               cycle
            end if
            now = max(0.0_wp, impulse(1, p) - (jump(1, p) + nx*x + ny*y)*gain(1, p))
            delta = now - impulse(1, p)
            impulse(1, p) = now
            change = max(change, abs(delta))
            largest = max(largest, now)
            x = x + (mobility(1, i) + mobility(1, j))*nx*delta
            y = y + (mobility(2, i) + mobility(2, j))*ny*delta
            bound = friction(p)*now + merge(b*cohesion(p), 0.0_wp, now > 0)
            now = impulse(2, p) - (jump(2, p) + nx*y - ny*x - slip_reference(p))*gain(2, p)
            now = min(bound, max(-bound, now))
            x = nx*delta
            y = ny*delta
            delta = now - impulse(2, p)
            impulse(2, p) = now
            change = max(change, abs(delta))
            call push(i, j, x - ny*delta, y + nx*delta)       ! the tangent is (-ny, nx)
         end do
         if (change <= tolerance*largest .or. is_exact()) exit
      end do

   contains

      !> A pair that softens: both impulses at once.
      subroutine soften()
         type(cohesive_pair_t) :: pair
         real(wp) :: there(2), next(2)
         there = jump(:, p) + [nx*x + ny*y, nx*y - ny*x]
         pair%weight = weight(:, p)
         pair%free = there - pair%weight*impulse(:, p)
         pair%cap = b*cap(:, p)
         pair%critical = critical(:, p)
         pair%damage = damage(p)
         pair%rigid = rigid(p)
         pair%friction = friction(p)
         pair%bond = b*cohesion(p)
         pair%slip_reference = slip_reference(p)
         call solve_pair(pair, next, cohesive(:, p), separation(p))
         there = next - impulse(:, p)
         impulse(:, p) = next
         call push(i, j, nx*there(1) - ny*there(2), ny*there(1) + nx*there(2))
         change = max(change, maxval(abs(there)))
         largest = max(largest, maxval(abs(next)))
      end subroutine soften

      !> One sweep solves a lone pair whose nodes are equally free in both directions: its tangential impulse leaves the
      !> normal one as it is.
      logical function is_exact()
         is_exact = first == last
         if (is_exact) is_exact = all(abs(mobility(1, first_node:last_node) - mobility(2, first_node:last_node)) <= 0)
      end function is_exact

      !> An impulse on b, its opposite on a.
      subroutine push(a_side, b_side, jx, jy)
         integer, intent(in) :: a_side, b_side
         real(wp), intent(in) :: jx, jy
         kick(1, a_side) = kick(1, a_side) - mobility(1, a_side)*jx
         kick(2, a_side) = kick(2, a_side) - mobility(2, a_side)*jy
         kick(1, b_side) = kick(1, b_side) + mobility(1, b_side)*jx
         kick(2, b_side) = kick(2, b_side) + mobility(2, b_side)*jy
      end subroutine push

   end subroutine sweep_group

   !> Velocities and new displacements of a group's nodes, and their residuals with the contact forces in.
   subroutine move_nodes(first, last, first_node, last_node, node, pair_node, normal, mobility, counted, b, free_x, free_y, &
                         loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, force, sums)
      integer, intent(in) :: first, last, first_node, last_node, node(*), pair_node(2, *)
      integer(i1), intent(in) :: free_x(*), free_y(*)
      logical, intent(in) :: loaded
      real(wp), intent(in) :: normal(2, *), mobility(2, *), counted(2, *), b, px(*), py(*), fx(*), fy(*)
      real(wp), intent(in) :: ux(*), uy(*), impulse(2, *)
      real(wp), intent(inout) :: wx(*), wy(*), vx(*), vy(*), force(2, *), sums(2)
      real(wp) :: f(2), x, y
      integer :: p, c, i
      force(:, first_node:last_node) = 0
      do p = first, last
         f(1) = normal(1, p)*impulse(1, p) - normal(2, p)*impulse(2, p)
         f(2) = normal(2, p)*impulse(1, p) + normal(1, p)*impulse(2, p)
         force(:, pair_node(1, p)) = force(:, pair_node(1, p)) - f
         force(:, pair_node(2, p)) = force(:, pair_node(2, p)) + f
      end do
      do c = first_node, last_node
         i = node(c)
         vx(i) = vx(i) + mobility(1, c)*force(1, c)
         vy(i) = vy(i) + mobility(2, c)*force(2, c)
         wx(i) = ux(i) + vx(i)
         wy(i) = uy(i) + vy(i)
         force(:, c) = force(:, c)/b
         x = force(1, c) - fx(i)
         y = force(2, c) - fy(i)
         if (loaded) then
            x = x + px(i)
            y = y + py(i)
         end if
         sums(1) = sums(1) + (counted(1, c) + counted(2, c))*(free_x(i)*x*x + free_y(i)*y*y)
         sums(2) = sums(2) + (counted(1, c) + counted(2, c))*((1 - free_x(i))*x*x + (1 - free_y(i))*y*y)
      end do
   end subroutine move_nodes

end module rf_contact_k
