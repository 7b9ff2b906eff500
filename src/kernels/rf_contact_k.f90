!> Contact impulses of node pairs, after Katona (1983): open, stick or slip, exact, no penalty. Pairs that share no node do
!> not feel each other: such a pair is solved at once (rf_direct_pair_k), most of them by the step kernel as soon as it has
!> moved their nodes; a group of connected pairs is swept by Gauss-Seidel to its own convergence. Pairs belong to the block of
!> nodes of their lowest node and are worked on by the thread that moved it, whose caches hold it. No result depends on the
!> number of threads.
module rf_contact_k
   use rf_kinds, only: wp, i1
   use rf_step_k, only: blocks_for_threads
   use rf_contact_blocks, only: contact_blocks_t
   use rf_cohesive_k, only: cohesive_pair_t, solve_pair
   use rf_direct_pair_k, only: solve_direct
   use rf_bundle_k, only: sweep_bundle, max_sweeps
   implicit none
   private
   public :: contact_step, groups_for_threads

   !> groups below which a second thread costs more than it brings: to wake and await it takes the time of some hundred pairs
   integer, parameter :: groups_for_threads = 256

contains

   !> Impulses that keep all pairs from interpenetrating and within Coulomb friction (theory: eqs. 17 to 22), applied
   !> to velocities and new displacements; residuals of the contact nodes with the contact forces in.
   subroutine contact_step(blocks, direct_done, group_pair, group_node, node, pair_node, normal, weight, gain, friction, &
                           cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, mobility, counted, &
                           tolerance, warm, b, free_x, free_y, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, cohesive, &
                           separation, force, jump, kick, partial)
      !> what each block of nodes has to do
      type(contact_blocks_t), intent(in) :: blocks
      !> the step kernel has solved the direct pairs within each block
      logical, intent(in) :: direct_done
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
      !> |r|^2 of the contact nodes that are solved here over free and over supported directions, of each block, (2, blocks)
      real(wp), intent(inout), contiguous :: partial(:, :)
      integer :: k, from, to_do

      to_do = size(blocks%swept) + blocks%direct_first(blocks%n + 1) - 1
      if (direct_done) to_do = to_do - sum(blocks%direct_outer - blocks%direct_first(:blocks%n))
      !$omp parallel do default(none) schedule(static) if (blocks%n >= blocks_for_threads .and. to_do > groups_for_threads) &
      !$omp    shared(blocks, direct_done, group_pair, group_node, node, pair_node, normal, weight, gain, friction, cohesion, &
      !$omp           slip_reference, gap_reference, bonded, rigid, cap, critical, damage, mobility, counted, tolerance, warm, &
      !$omp           b, free_x, free_y, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, cohesive, separation, force, jump, &
      !$omp           kick, partial) private(k, from)
      do k = 1, blocks%n
         partial(:, k) = 0
         from = merge(blocks%direct_outer(k), blocks%direct_first(k), direct_done)
         call solve_direct(from, blocks%direct_first(k + 1) - 1, blocks%direct_pair, blocks%direct_node, blocks%direct, b, &
                           size(px) > 0, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, partial(:, k))
         call sweep_bundles(blocks, k, tolerance, warm, b, ux, uy, vx, vy, impulse)
         call sweep_singles(blocks%single_first(k), blocks%single_first(k + 1) - 1, blocks%single, group_pair, group_node, node, &
                            pair_node, normal, weight, gain, friction, cohesion, slip_reference, gap_reference, bonded, rigid, &
                            cap, critical, damage, mobility, tolerance, warm, b, ux, uy, vx, vy, impulse, cohesive, &
                            separation, jump, kick)
         call move_groups(blocks%swept_first(k), blocks%swept_first(k + 1) - 1, blocks%swept, group_pair, group_node, node, &
                          pair_node, normal, mobility, counted, b, free_x, free_y, size(px) > 0, px, py, fx, fy, ux, uy, wx, &
                          wy, vx, vy, impulse, force, partial(:, k))
      end do
      !$omp end parallel do
   end subroutine contact_step

   !> Groups of pairs side by side.
   subroutine sweep_bundles(blocks, k, tolerance, warm, b, ux, uy, vx, vy, impulse)
      !> block k of them
      type(contact_blocks_t), intent(in) :: blocks
      integer, intent(in) :: k
      !> see contact_step
      real(wp), intent(in) :: tolerance, warm, b, ux(*), uy(*), vx(*), vy(*)
      real(wp), intent(inout) :: impulse(2, *)
      integer :: i, slot, entry
      do i = blocks%bundle_first(k), blocks%bundle_first(k + 1) - 1
         slot = blocks%bundle_slot(i)
         entry = blocks%bundle_entry(i)
         call sweep_bundle(blocks%bundle_pairs(i), blocks%bundle_groups(i), blocks%slot_pair(1, slot), &
                           blocks%slot_node(1, slot), blocks%slot(1, slot), blocks%along(1, entry), &
                           blocks%across(1, entry), tolerance, warm, b, ux, uy, vx, vy, impulse)
      end do
   end subroutine sweep_bundles

   !> Groups of pairs one by one.
   subroutine sweep_singles(first, last, single, group_pair, group_node, node, pair_node, normal, weight, gain, friction, &
                            cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, damage, mobility, tolerance, &
                            warm, b, ux, uy, vx, vy, impulse, cohesive, separation, jump, kick)
      !> the first and the last of them in the list of groups
      integer, intent(in) :: first, last, single(*)
      !> see contact_step; without descriptors
      integer, intent(in) :: group_pair(*), group_node(*), node(*), pair_node(2, *)
      real(wp), intent(in) :: normal(2, *), weight(2, *), gain(2, *), friction(*), cohesion(*), slip_reference(*)
      real(wp), intent(in) :: gap_reference(*), cap(2, *), critical(2, *), damage(*), mobility(2, *)
      logical, intent(in) :: bonded(*), rigid(*)
      real(wp), intent(in) :: tolerance, warm, b, ux(*), uy(*), vx(*), vy(*)
      real(wp), intent(inout) :: impulse(2, *), cohesive(2, *), separation(*), jump(2, *), kick(2, *)
      real(wp) :: own_warm
      integer :: i, g
      do i = first, last
         g = single(i)
         own_warm = merge(warm, 0.0_wp, group_pair(g + 1) - group_pair(g) > 1)
         call sweep_group(group_pair(g), group_pair(g + 1) - 1, group_node(g), group_node(g + 1) - 1, node, pair_node, normal, &
                          weight, gain, friction, cohesion, slip_reference, gap_reference, bonded, rigid, cap, critical, &
                          damage, mobility, tolerance, own_warm, b, ux, uy, vx, vy, impulse, cohesive, separation, jump, kick)
      end do
   end subroutine sweep_singles

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

   !> Velocities and new displacements of the nodes of groups, and their residuals with the contact forces in.
   subroutine move_groups(first, last, swept, group_pair, group_node, node, pair_node, normal, mobility, counted, b, free_x, &
                          free_y, loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, force, sums)
      !> the first and the last of them in the list of groups
      integer, intent(in) :: first, last, swept(*)
      !> see contact_step; without descriptors
      integer, intent(in) :: group_pair(*), group_node(*), node(*), pair_node(2, *)
      integer(i1), intent(in) :: free_x(*), free_y(*)
      logical, intent(in) :: loaded
      real(wp), intent(in) :: normal(2, *), mobility(2, *), counted(2, *), b, px(*), py(*), fx(*), fy(*)
      real(wp), intent(in) :: ux(*), uy(*), impulse(2, *)
      real(wp), intent(inout) :: wx(*), wy(*), vx(*), vy(*), force(2, *), sums(2)
      integer :: i, g
      do i = first, last
         g = swept(i)
         call move_nodes(group_pair(g), group_pair(g + 1) - 1, group_node(g), group_node(g + 1) - 1, node, pair_node, normal, &
                         mobility, counted, b, free_x, free_y, loaded, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, &
                         force, sums)
      end do
   end subroutine move_groups

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
