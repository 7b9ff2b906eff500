!> The relaxation step over node rows: internal forces, damped update and all sums that damping and convergence need,
!> in one pass over blocks of nodes, and contact of the pairs that feel nothing but two nodes of a block. The rows of a block
!> are sorted by falling valence and cut into slices of `lanes` rows; a slice stores the first neighbours of all its rows, then
!> the second ones, and so on, shorter rows filled up with entries of no stiffness (sliced ELLPACK, Kreutzer et al. 2014). The
!> sums of a slice stay in vector registers.
!> Every sum has a fixed order: along a row, then inside a block, then over the blocks; the number of threads does not
!> show.
module rf_step_k
   use rf_kinds, only: wp, i1
   use rf_contact_blocks, only: contact_blocks_t
   use rf_direct_pair_k, only: solve_direct
   implicit none
   private
   public :: relaxation_step, internal_forces
   public :: block_size, blocks_for_threads, lanes, slices, n_sums, sum_curvature, sum_kinetic, sum_residual, sum_reaction

   !> nodes in a block: their forces stay in the first-level cache
   integer, parameter :: block_size = 512
   !> rows in a slice: the numbers that one vector register holds; slices in a block
   integer, parameter :: lanes = 8, slices = block_size/lanes
   !> partial sums of a block: v.(f - f_old), v.m v, |r|^2 over free and |r|^2 over supported directions
   integer, parameter :: sum_curvature = 1, sum_kinetic = 2, sum_residual = 3, sum_reaction = 4, n_sums = 4
   !> blocks below which a second thread costs more than it brings
   integer, parameter :: blocks_for_threads = 4
   !> forces on a block's nodes where none act: stay in the first-level cache
   real(wp), parameter :: no_force(block_size) = 0.0_wp

contains

   !> Forces of one block's nodes, f_i = sum_j K_ij (u_j - u_i) (theory: eq. 5).
   subroutine block_forces(n_slices, slice, order, column, kxx, kxy, kyx, kyy, ux, uy, fx, fy)
      !> slices of the block
      integer, intent(in) :: n_slices
      !> first entry of each slice, (slices + 1)
      integer, intent(in) :: slice(*)
      !> node of each row
      integer, intent(in) :: order(lanes, *)
      !> neighbour of each entry
      integer, intent(in) :: column(lanes, *)
      !> stiffness of each entry [force/length]
      real(wp), intent(in) :: kxx(lanes, *), kxy(lanes, *), kyx(lanes, *), kyy(lanes, *)
      !> displacements of all nodes [length]
      real(wp), intent(in) :: ux(*), uy(*)
      !> forces of the rows [force]
      real(wp), intent(out) :: fx(lanes, slices), fy(lanes, slices)
      real(wp) :: own_x(lanes), own_y(lanes), sum_x(lanes), sum_y(lanes), dx, dy
      integer :: s, p, l
      do s = 1, n_slices
         do l = 1, lanes
            own_x(l) = ux(order(l, s))
            own_y(l) = uy(order(l, s))
         end do
         sum_x = 0
         sum_y = 0
         do p = slice(s), slice(s + 1) - 1
            !$omp simd private(dx, dy)
            do l = 1, lanes
               dx = ux(column(l, p)) - own_x(l)
               dy = uy(column(l, p)) - own_y(l)
               sum_x(l) = sum_x(l) + (kxx(l, p)*dx + kxy(l, p)*dy)
               sum_y(l) = sum_y(l) + (kyx(l, p)*dx + kyy(l, p)*dy)
            end do
         end do
         fx(:, s) = sum_x
         fy(:, s) = sum_y
      end do
   end subroutine block_forces

   !> The same with kxy for kyx. (A loop of its own: block_forces that reads kxy twice takes 13 to 20 % longer where a body
   !> fits into the caches of the second level.)
   subroutine symmetric_forces(n_slices, slice, order, column, kxx, kxy, kyy, ux, uy, fx, fy)
      !> see block_forces
      integer, intent(in) :: n_slices, slice(*), order(lanes, *), column(lanes, *)
      real(wp), intent(in) :: kxx(lanes, *), kxy(lanes, *), kyy(lanes, *), ux(*), uy(*)
      real(wp), intent(out) :: fx(lanes, slices), fy(lanes, slices)
      real(wp) :: own_x(lanes), own_y(lanes), sum_x(lanes), sum_y(lanes), dx, dy
      integer :: s, p, l
      do s = 1, n_slices
         do l = 1, lanes
            own_x(l) = ux(order(l, s))
            own_y(l) = uy(order(l, s))
         end do
         sum_x = 0
         sum_y = 0
         do p = slice(s), slice(s + 1) - 1
            !$omp simd private(dx, dy)
            do l = 1, lanes
               dx = ux(column(l, p)) - own_x(l)
               dy = uy(column(l, p)) - own_y(l)
               sum_x(l) = sum_x(l) + (kxx(l, p)*dx + kxy(l, p)*dy)
               sum_y(l) = sum_y(l) + (kxy(l, p)*dx + kyy(l, p)*dy)
            end do
         end do
         fx(:, s) = sum_x
         fy(:, s) = sum_y
      end do
   end subroutine symmetric_forces

   !> Forces of one block's nodes in the order of the nodes.
   subroutine forces_in_order(n, base, slice, order, column, kxx, kxy, kyx, kyy, n_skew, skew_edge, skew, ux, uy, fx, fy)
      !> nodes of the block, the first of them
      integer, intent(in) :: n, base
      !> see block_forces; kyx of size 0: kxy is both
      integer, intent(in) :: slice(:), order(block_size)
      integer, intent(in), contiguous :: column(:, :)
      real(wp), intent(in), contiguous :: kxx(:, :), kxy(:, :), kyx(:, :), kyy(:, :)
      !> entries that are not symmetric; node and neighbour of each, half of kxy - kyx [force/length]
      integer, intent(in) :: n_skew, skew_edge(2, *)
      real(wp), intent(in) :: skew(*)
      real(wp), intent(in) :: ux(*), uy(*)
      real(wp), intent(out) :: fx(block_size), fy(block_size)
      real(wp) :: gx(block_size), gy(block_size)
      integer :: k, i, j
      if (size(kyx) > 0) then
         call block_forces((n - 1)/lanes + 1, slice, order, column, kxx, kxy, kyx, kyy, ux, uy, gx, gy)
      else
         call symmetric_forces((n - 1)/lanes + 1, slice, order, column, kxx, kxy, kyy, ux, uy, gx, gy)
      end if
      do k = 1, n
         fx(order(k) - base + 1) = gx(k)
         fy(order(k) - base + 1) = gy(k)
      end do
      do k = 1, n_skew
         i = skew_edge(1, k)
         j = skew_edge(2, k)
         fx(i - base + 1) = fx(i - base + 1) + skew(k)*(uy(j) - uy(i))
         fy(i - base + 1) = fy(i - base + 1) - skew(k)*(ux(j) - ux(i))
      end do
   end subroutine forces_in_order

   !> Internal forces of all nodes.
   subroutine internal_forces(n_blocks, first, count, slice, order, column, kxx, kxy, kyx, kyy, skew_start, skew_count, &
                              skew_edge, skew, ux, uy, fx, fy)
      integer, intent(in) :: n_blocks
      !> first node and number of nodes of each block
      integer, intent(in) :: first(:), count(:)
      !> first entry of each slice of each block, (slices + 1, block)
      integer, intent(in), contiguous :: slice(:, :)
      !> node of each row, (block_size, block); neighbour of each entry, (lanes, entry)
      integer, intent(in), contiguous :: order(:, :), column(:, :)
      !> stiffness of each entry [force/length], (lanes, entry); kyx of size 0: kxy is both but for the entries that are
      !> not symmetric
      real(wp), intent(in), contiguous :: kxx(:, :), kxy(:, :), kyx(:, :), kyy(:, :)
      !> those entries: the first and the number of each block; node and neighbour of each, half of kxy - kyx [force/length]
      integer, intent(in), contiguous :: skew_start(:), skew_count(:), skew_edge(:, :)
      real(wp), intent(in), contiguous :: skew(:)
      real(wp), intent(in), contiguous :: ux(:), uy(:)
      !> forces [force], (nodes)
      real(wp), intent(inout) :: fx(:), fy(:)
      real(wp) :: gx(block_size), gy(block_size)
      integer :: b, base, n
      !$omp parallel do default(none) schedule(static) if (n_blocks >= blocks_for_threads) &
      !$omp    shared(n_blocks, first, count, slice, order, column, kxx, kxy, kyx, kyy, skew_start, skew_count, skew_edge, &
      !$omp           skew, ux, uy, fx, fy) &
      !$omp    private(b, base, n, gx, gy)
      do b = 1, n_blocks
         base = first(b)
         n = count(b)
         call forces_in_order(n, base, slice(:, b), order(:, b), column, kxx, kxy, kyx, kyy, skew_count(b), &
                              skew_edge(:, skew_start(b):), skew(skew_start(b):), ux, uy, gx, gy)
         fx(base:base + n - 1) = gx(:n)
         fy(base:base + n - 1) = gy(:n)
      end do
      !$omp end parallel do
   end subroutine internal_forces

   !> One relaxation step of all nodes: v <- a v + b r/m, new u = u + v, r = p - f (theory: eqs. 7 to 9), and at once the
   !> impulses of those pairs that feel nothing but their own nodes, which the block has just moved.
   !> Blocks flagged as special hold supports or loose pieces, or damp locally; the others run the plain update.
   subroutine relaxation_step(n_nodes, n_blocks, first, count, special, slice, order, column, kxx, kxy, kyx, kyy, &
                              skew_start, skew_count, skew_edge, skew, a, b, local, ux, uy, wx, wy, vx, vy, fx, fy, px, py, &
                              inverse_mass, free_x, free_y, paced, counted, keep, blocks, with_contact, impulse, partial)
      integer, intent(in) :: n_nodes, n_blocks
      !> first node and number of nodes of each block
      integer, intent(in) :: first(:), count(:)
      !> the block needs the general update
      logical, intent(in) :: special(:)
      !> see internal_forces
      integer, intent(in), contiguous :: slice(:, :), order(:, :), column(:, :)
      real(wp), intent(in), contiguous :: kxx(:, :), kxy(:, :), kyx(:, :), kyy(:, :)
      integer, intent(in), contiguous :: skew_start(:), skew_count(:), skew_edge(:, :)
      real(wp), intent(in), contiguous :: skew(:)
      !> factors of velocity and of residual in the update [-], local damping [-]
      real(wp), intent(in) :: a, b, local
      !> displacements now and after the step [length]
      real(wp), intent(in) :: ux(n_nodes), uy(n_nodes)
      real(wp), intent(inout) :: wx(n_nodes), wy(n_nodes)
      !> velocities [length per step]
      real(wp), intent(inout) :: vx(n_nodes), vy(n_nodes)
      !> internal forces of the last step, on return of this one [force]
      real(wp), intent(inout) :: fx(n_nodes), fy(n_nodes)
      !> applied nodal forces [force]; arrays of size 0 where there are none
      real(wp), intent(in), contiguous :: px(:), py(:)
      !> 1/m of each node
      real(wp), intent(in) :: inverse_mass(n_nodes)
      !> 1 where a direction is free, 0 where it is supported
      integer(i1), intent(in) :: free_x(n_nodes), free_y(n_nodes)
      !> 1 where the node's motion enters the damping sums, 0 on pieces free to move as a whole; here and in the next two: an
      !> array of size 0 where all nodes have 1
      real(wp), intent(in), contiguous :: paced(:)
      !> 1 where its residual counts, 0 on loose pieces
      real(wp), intent(in), contiguous :: counted(:)
      !> factor of the old velocity: 1, less on pieces free to move as a whole (the residual stays whole, else contact
      !> forces would balance a part of it only)
      real(wp), intent(in), contiguous :: keep(:)
      !> contact of each block. Residuals of contact nodes are known after contact only
      type(contact_blocks_t), intent(in) :: blocks
      !> solve the direct pairs within each block; else they wait for contact_step with all others
      logical, intent(in) :: with_contact
      !> normal and tangential impulse of each pair, (2, pairs)
      real(wp), intent(inout), contiguous :: impulse(:, :)
      !> sums of each block, (n_sums, block)
      real(wp), intent(out) :: partial(:, :)
      real(wp) :: gx(block_size), gy(block_size), own_paced(block_size), measured(block_size), own_keep(block_size), of_pairs(2)
      integer :: base, n, j

      !$omp parallel do default(none) schedule(static) if (n_blocks >= blocks_for_threads) &
      !$omp    shared(n_blocks, first, count, special, slice, order, column, kxx, kxy, kyx, kyy, skew_start, skew_count, &
      !$omp           skew_edge, skew, blocks, with_contact, ux, uy, wx, wy, vx, vy, fx, fy, px, py, inverse_mass, free_x, &
      !$omp           free_y, paced, counted, keep, impulse, partial, a, b, local) &
      !$omp    private(j, base, n, gx, gy, own_paced, measured, own_keep, of_pairs)
      do j = 1, n_blocks
         base = first(j)
         n = count(j)
         call forces_in_order(n, base, slice(:, j), order(:, j), column, kxx, kxy, kyx, kyy, skew_count(j), &
                              skew_edge(:, skew_start(j):), skew(skew_start(j):), ux, uy, gx, gy)
         if (special(j)) then
            call part_of(paced, base, n, own_paced)
            call part_of(counted, base, n, measured)
            call part_of(keep, base, n, own_keep)
            call leave_out(blocks%node_first(j), blocks%node_first(j + 1) - 1, blocks%node, base, measured)
            if (size(px) > 0) then
               call general_update(n, a, b, local, gx, gy, ux(base), uy(base), wx(base), wy(base), vx(base), vy(base), &
                                   fx(base), fy(base), px(base:), py(base:), inverse_mass(base), free_x(base), free_y(base), &
                                   own_paced, measured, own_keep, partial(:, j))
            else
               call general_update(n, a, b, local, gx, gy, ux(base), uy(base), wx(base), wy(base), vx(base), vy(base), &
                                   fx(base), fy(base), no_force, no_force, inverse_mass(base), free_x(base), free_y(base), &
                                   own_paced, measured, own_keep, partial(:, j))
            end if
         else
            measured(:n) = 1
            call leave_out(blocks%node_first(j), blocks%node_first(j + 1) - 1, blocks%node, base, measured)
            if (size(px) > 0) then
               call plain_update(n, a, b, gx, gy, ux(base), uy(base), wx(base), wy(base), vx(base), vy(base), &
                                 fx(base), fy(base), px(base:), py(base:), inverse_mass(base), measured, partial(:, j))
            else
               call plain_update(n, a, b, gx, gy, ux(base), uy(base), wx(base), wy(base), vx(base), vy(base), &
                                 fx(base), fy(base), no_force, no_force, inverse_mass(base), measured, partial(:, j))
            end if
         end if
         if (.not. with_contact) cycle
         of_pairs = 0
         call solve_direct(blocks%direct_first(j), blocks%direct_outer(j) - 1, blocks%direct_pair, blocks%direct_node, &
                           blocks%direct, b, size(px) > 0, px, py, fx, fy, ux, uy, wx, wy, vx, vy, impulse, of_pairs)
         partial(sum_residual, j) = partial(sum_residual, j) + of_pairs(1)
         partial(sum_reaction, j) = partial(sum_reaction, j) + of_pairs(2)
      end do
      !$omp end parallel do
   end subroutine relaxation_step

   !> Residuals of some nodes of a block are not summed.
   pure subroutine leave_out(first, last, node, base, measured)
      !> the first and the last of them in the list of nodes, first node of the block
      integer, intent(in) :: first, last, node(*), base
      real(wp), intent(inout) :: measured(block_size)
      integer :: c
      do c = first, last
         measured(node(c) - base + 1) = 0
      end do
   end subroutine leave_out

   !> What a block's nodes have of a property.
   pure subroutine part_of(values, base, n, part)
      !> of all nodes; of size 0 where it is 1 everywhere
      real(wp), intent(in), contiguous :: values(:)
      !> first node, number of nodes
      integer, intent(in) :: base, n
      real(wp), intent(out) :: part(block_size)
      if (size(values) > 0) then
         part(:n) = values(base:base + n - 1)
      else
         part = 1
      end if
   end subroutine part_of

   !> Update of a block whose nodes are all free and paced.
   subroutine plain_update(n, a, b, gx, gy, ux, uy, wx, wy, vx, vy, fx, fy, px, py, inverse_mass, measured, sums)
      integer, intent(in) :: n
      real(wp), intent(in) :: a, b, gx(n), gy(n), ux(n), uy(n), px(n), py(n), inverse_mass(n), measured(n)
      real(wp), intent(inout) :: wx(n), wy(n), vx(n), vy(n), fx(n), fy(n)
      real(wp), intent(out) :: sums(n_sums)
      real(wp) :: curvature, kinetic, residual, x, y
      integer :: k
      curvature = 0; kinetic = 0; residual = 0
      !$omp simd private(x, y) reduction(+:curvature, kinetic, residual)
      do k = 1, n
         curvature = curvature + (vx(k)*(gx(k) - fx(k)) + vy(k)*(gy(k) - fy(k)))
         kinetic = kinetic + (vx(k)*vx(k) + vy(k)*vy(k))/inverse_mass(k)
         x = px(k) - gx(k)
         y = py(k) - gy(k)
         residual = residual + measured(k)*(x*x + y*y)
         vx(k) = a*vx(k) + b*inverse_mass(k)*x
         vy(k) = a*vy(k) + b*inverse_mass(k)*y
         wx(k) = ux(k) + vx(k)
         wy(k) = uy(k) + vy(k)
         fx(k) = gx(k)
         fy(k) = gy(k)
      end do
      sums = [curvature, kinetic, residual, 0.0_wp]
   end subroutine plain_update

   !> Update of a block with supports, loose pieces or local damping.
   subroutine general_update(n, a, b, local, gx, gy, ux, uy, wx, wy, vx, vy, fx, fy, px, py, inverse_mass, &
                             free_x, free_y, paced, measured, keep, sums)
      integer, intent(in) :: n
      real(wp), intent(in) :: a, b, local, gx(n), gy(n), ux(n), uy(n), px(n), py(n), inverse_mass(n)
      integer(i1), intent(in) :: free_x(n), free_y(n)
      real(wp), intent(in) :: paced(n), measured(n), keep(n)
      real(wp), intent(inout) :: wx(n), wy(n), vx(n), vy(n), fx(n), fy(n)
      real(wp), intent(out) :: sums(n_sums)
      real(wp) :: curvature, kinetic, residual, reaction, x, y
      integer :: k
      curvature = 0; kinetic = 0; residual = 0; reaction = 0
      !$omp simd private(x, y) reduction(+:curvature, kinetic, residual, reaction)
      do k = 1, n
         curvature = curvature + paced(k)*(vx(k)*(gx(k) - fx(k)) + vy(k)*(gy(k) - fy(k)))
         kinetic = kinetic + paced(k)*(vx(k)*vx(k) + vy(k)*vy(k))/inverse_mass(k)
         x = px(k) - gx(k)
         y = py(k) - gy(k)
         residual = residual + measured(k)*(free_x(k)*x*x + free_y(k)*y*y)
         reaction = reaction + measured(k)*((1.0_wp - free_x(k))*x*x + (1.0_wp - free_y(k))*y*y)
         ! a contact node's residual is not known yet: its neighbours damp it, else equilibrium would be out of reach
         x = x - local*measured(k)*merge(sign(1.0_wp, vx(k)), 0.0_wp, abs(vx(k)) > 0)*abs(x)
         y = y - local*measured(k)*merge(sign(1.0_wp, vy(k)), 0.0_wp, abs(vy(k)) > 0)*abs(y)
         vx(k) = free_x(k)*(keep(k)*a*vx(k) + b*inverse_mass(k)*x)
         vy(k) = free_y(k)*(keep(k)*a*vy(k) + b*inverse_mass(k)*y)
         wx(k) = ux(k) + vx(k)
         wy(k) = uy(k) + vy(k)
         fx(k) = gx(k)
         fy(k) = gy(k)
      end do
      sums = [curvature, kinetic, residual, reaction]
   end subroutine general_update

end module rf_step_k
