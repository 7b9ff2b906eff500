!> Explicit dynamic relaxation to equilibrium (Qiu & Ding 2007, eqs. 4 to 6): central differences with fictitious mass,
!> no global stiffness matrix (theory: section 3). docs/timestep.md walks through one step.
module rf_relaxation
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_t
   use rf_clock, only: stopwatch_t
   use rf_interruption, only: interruption_t
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_rows, only: rows_t
   use rf_contact, only: contact_t
   use rf_loads, only: loads_t
   use rf_motion, only: motion_t
   use rf_pieces, only: pieces_t
   use rf_debris, only: debris_t
   use rf_step_k, only: relaxation_step, block_size, n_sums, sum_curvature, sum_kinetic, sum_residual, sum_reaction
   implicit none
   private
   public :: relaxation_t, relaxation_settings_t, reaction
   public :: damping_adaptive, damping_kinetic, damping_local, damping_viscous
   public :: scale_memory, relaxed, relaxed_roughly, relaxation_failed, relaxation_mechanism, relaxation_not_finite

   !> kinds of damping
   integer, parameter :: damping_adaptive = 1, damping_kinetic = 2, damping_local = 3, damping_viscous = 4
   !> outcomes: within tolerance; within 100 x tolerance at the iteration limit; above that; a loaded piece ran away;
   !> a sum is not finite
   integer, parameter :: relaxed = 0, relaxed_roughly = 1, relaxation_failed = 2, relaxation_mechanism = 3, &
      relaxation_not_finite = 4
   !> a state at the iteration limit is still taken within this multiple of the tolerance
   real(wp), parameter :: rough_factor = 100.0_wp
   !> largest damping coefficient [-]
   real(wp), parameter :: largest_damping = 1.9_wp
   !> velocity that loose pieces keep in a step (theory: eq. 14)
   real(wp), parameter :: loose_keep = 0.8_wp
   !> part of the largest scale of any converged state that the scale never falls below
   real(wp), parameter :: scale_memory = 0.02_wp
   !> a residual below this part of the largest force of the relaxation is round-off: a body that was never loaded and
   !> ends without load (a cut bar that is pulled apart) has no other scale
   real(wp), parameter :: round_off = 1.0e-12_wp
   !> contact impulses stand when they change by less, relative to the largest; and in units of the tolerance
   real(wp), parameter :: contact_tolerance = 1.0e-6_wp, contact_fraction = 0.01_wp
   !> movement, in mean edge lengths, from which a piece that does not come to rest is a mechanism
   real(wp), parameter :: mechanism_movement = 0.2_wp
   !> residual, in units of the tolerance, down to which VISCOUS damping looks for the lowest frequency
   real(wp), parameter :: viscous_look = 10.0_wp
   !> weight of the newest Rayleigh quotient in that search, and steps that it takes at least
   real(wp), parameter :: viscous_smoothing = 0.02_wp
   integer, parameter :: viscous_steps = 100
   !> steps between two looks at which loose pieces bear load, and over which their motion is looked at
   integer, parameter :: steps_of_look = 25, steps_of_debris = 100

   type :: relaxation_settings_t
      !> residual relative to the scale of forces for states that are recorded, and for those that choose an event
      real(wp) :: tolerance = 1.0e-6_wp, event_tolerance = 1.0e-6_wp
      integer :: max_iterations = 100000
      !> go on with a state that is still above 100 x tolerance at the limit
      logical :: continue_anyway = .false.
      integer :: damping = damping_adaptive
      !> LOCAL: FLAC's alpha; VISCOUS: fraction of critical
      real(wp) :: factor = 1
   end type relaxation_settings_t

   !> What goes from one step of a relaxation to the next, beside the motion itself.
   type :: progress_t
      !> damping coefficient of the next step [-]; it starts from rest
      real(wp) :: c = 0
      logical :: at_rest = .true.
      !> VISCOUS: Rayleigh quotient of the slow motion, smoothed over the steps [-]
      real(wp) :: lowest = 0
      !> KINETIC: kinetic energy in the last step (any unit)
      real(wp) :: kinetic_before = 0
      !> scale of the loads, largest force in any step [force]
      real(wp) :: applied = 0, largest = 0
      !> sum over the nodes of each piece of the displacements at the start [length], (2, pieces)
      real(wp), allocatable :: start(:, :)
   end type progress_t

   type :: relaxation_t
      type(relaxation_settings_t) :: settings
      !> a relaxation has been left after one of its steps; `equilibrate` goes on with it
      logical :: under_way = .false.
      !> of the last relaxation: steps, |r|/scale, outcome
      integer :: iterations = 0, outcome = relaxed
      real(wp) :: residual = 0
      !> factor of r/m in the last step: contact force = impulse/b
      real(wp) :: b = 0.5_wp
      !> piece that ran away, node that is not finite
      integer :: piece = 0, node = 0
      !> largest scale of a converged state [force]
      real(wp) :: largest_scale = 0
      !> element updates so far and the time they took [s]
      real(wp) :: element_updates = 0, seconds = 0
      !> the part of that time that contact takes after the step's own pass
      type(stopwatch_t) :: contact_watch
      !> damping coefficient of VISCOUS once known [-]
      real(wp), private :: viscous = -1
      type(progress_t), private :: now
      !> loose pieces that bear load
      type(debris_t), private :: debris
      !> per node: its residual counts; its motion enters the damping; part of the velocity that it keeps in a step. Of size
      !> 0 where all nodes have 1
      real(wp), allocatable, private :: counted(:), paced(:), keep(:)
      real(wp), allocatable, private :: partial(:, :)
      logical, allocatable, private :: special(:)
      !> velocities of this step and of the last one, (node, step, direction); KINETIC damping only
      real(wp), allocatable, private :: velocity(:, :, :)
   contains
      procedure :: begin_step, equilibrate, exchange
      procedure, private :: start, prepare_masks, step, sum_up, next_damping, judge_failure, return_to_peak, keep_velocities
      procedure, private :: watch_debris
   end type relaxation_t

contains

   !> Take over the settings of a step; VISCOUS damping looks for its coefficient anew.
   subroutine begin_step(self, settings)
      class(relaxation_t), intent(inout) :: self
      type(relaxation_settings_t), intent(in) :: settings
      self%settings = settings
      self%viscous = -1
   end subroutine begin_step

   !> Relax to equilibrium at the present loads, starting from the present displacements at rest (theory: eqs. 7 to 13). An
   !> interruption ends it after any step, `under_way`; called again it goes on from there with the same bits.
   subroutine equilibrate(self, mesh, rows, contact, loads, pieces, motion, tolerance, interruption)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(inout) :: pieces
      type(motion_t), intent(inout) :: motion
      !> residual relative to the scale of forces at which the state is taken [-]
      real(wp), intent(in) :: tolerance
      !> asked after each step (default: never)
      type(interruption_t), intent(inout), optional :: interruption
      real(wp) :: sums(n_sums), scale
      integer(i8) :: ticks(2), rate
      integer :: done
      logical :: there, changed

      call system_clock(ticks(1), rate)
      if (.not. self%under_way) then
         call contact%weigh(rows%inverse_mass, loads%free_x, loads%free_y)
         call pieces%look_at_loads(loads, contact%bonds())
         call self%start(mesh, contact, loads, pieces, motion, tolerance)
      end if
      call self%prepare_masks(mesh, rows, loads, pieces)
      call contact%arrange(mesh%n_nodes, rows%inverse_mass, loads%free_x, loads%free_y, self%counted)
      self%under_way = .false.
      done = self%iterations
      scale = 0
      do
         if (self%settings%damping == damping_kinetic) call self%keep_velocities(motion, mesh%n_nodes)
         call self%step(mesh, rows, contact, loads, motion, tolerance)
         call self%sum_up(rows, contact, sums)
         if (.not. ieee_is_finite(sum(sums))) exit
         self%now%largest = max(self%now%largest, sqrt(sums(sum_residual) + sums(sum_reaction)))
         scale = max(self%now%applied, sqrt(sums(sum_reaction)), scale_memory*self%largest_scale, &
                     round_off*self%now%largest/tolerance)
         there = sqrt(sums(sum_residual)) <= tolerance*scale
         call self%watch_debris(mesh, rows, contact, loads, pieces, motion, sqrt(sums(sum_residual)), tolerance*scale, changed)
         if (.not. changed .and. (there .or. self%iterations >= self%settings%max_iterations)) exit
         if (self%iterations > self%settings%max_iterations) exit      ! one step shows what has begun to count, and no more
         call self%next_damping(sums, sqrt(sums(sum_residual)) > viscous_look*tolerance*scale)
         self%now%at_rest = self%settings%damping == damping_kinetic .and. sums(sum_kinetic) < self%now%kinetic_before
         self%now%kinetic_before = sums(sum_kinetic)
         self%iterations = self%iterations + 1
         if (self%now%at_rest) then
            call self%return_to_peak(motion, mesh%n_nodes)
            self%now%kinetic_before = 0
         else
            call motion%advance()
         end if
         if (present(interruption)) self%under_way = interruption%asked()
         if (self%under_way) exit
      end do
      call contact%sum_forces(self%b)
      call system_clock(ticks(2))
      self%seconds = self%seconds + real(ticks(2) - ticks(1), wp)/real(rate, wp)
      done = self%iterations - done
      if (.not. self%under_way) done = done + 1      ! the step that ends it moves nothing
      self%element_updates = self%element_updates + real(done, wp)*mesh%n_elements
      if (.not. self%under_way) call self%judge_failure(mesh, loads, pieces, motion, sums, scale, tolerance)
   end subroutine equilibrate

   !> A relaxation begins: the body is at rest, supports are where they have to be.
   subroutine start(self, mesh, contact, loads, pieces, motion, tolerance)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(in) :: pieces
      type(motion_t), intent(inout) :: motion
      real(wp), intent(in) :: tolerance
      logical :: changed
      integer :: n
      call motion%reserve(mesh%n_nodes)
      do n = 1, mesh%n_nodes
         motion%vx(n) = 0
         motion%vy(n) = 0
         if (loads%is_held(1, n)) motion%ux(n) = loads%prescribed(1, n)
         if (loads%is_held(2, n)) motion%uy(n) = loads%prescribed(2, n)
      end do
      self%now%c = 0
      self%now%at_rest = .true.
      self%now%lowest = 0
      self%now%kinetic_before = 0
      self%now%applied = loads%scale(mesh%n_nodes)
      self%now%largest = 0
      self%now%start = summed_displacements(mesh, pieces, motion)
      self%iterations = 0
      call self%debris%begin(pieces%n)
      call self%debris%look(contact, pieces, self%b, tolerance*max(self%now%applied, scale_memory*self%largest_scale), changed)
   end subroutine start

   !> Loose pieces that bear load: which they are now, and how slowly the body creeps with them.
   subroutine watch_debris(self, mesh, rows, contact, loads, pieces, motion, residual, limit, changed)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(in) :: pieces
      type(motion_t), intent(in) :: motion
      !> |r| of the last step, and at which the state is taken [force]
      real(wp), intent(in) :: residual, limit
      !> what counts has changed: the next step knows its residual
      logical, intent(out) :: changed
      logical :: due
      due = mod(self%iterations, steps_of_look) == 0 .and. self%iterations < self%settings%max_iterations
      changed = .false.
      if (due .or. residual <= limit) call self%debris%look(contact, pieces, self%b, limit, changed)
      if (changed) then
         call self%prepare_masks(mesh, rows, loads, pieces)
         call contact%arrange(mesh%n_nodes, rows%inverse_mass, loads%free_x, loads%free_y, self%counted)
      end if
      if (mod(self%iterations, steps_of_debris) == 0) &
         call self%debris%follow(mesh%n_nodes, contact, motion, self%b, rows%inverse_mass, self%paced, residual)
   end subroutine watch_debris

   !> One step: forces and update of all nodes, with the contact of most pairs; then that of the others.
   subroutine step(self, mesh, rows, contact, loads, motion, tolerance)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(inout) :: motion
      real(wp), intent(in) :: tolerance
      real(wp) :: a, b, local, warm
      local = 0
      a = (2 - self%now%c)/(2 + self%now%c)
      b = 2/(2 + self%now%c)
      if (self%settings%damping == damping_local) then    ! stable with twice the mass only
         local = self%settings%factor
         b = 0.5_wp*b
      end if
      if (self%now%at_rest) then
         a = 0
         b = merge(0.25_wp, 0.5_wp, self%settings%damping == damping_local)
      end if
      warm = merge(b/self%b, 0.0_wp, self%iterations > 0)      ! the same forces as in the step before
      self%b = b
      call relaxation_step(mesh%n_nodes, rows%n_blocks, rows%first, rows%count, self%special, rows%slice, rows%order, rows%column, &
                           rows%kxx, rows%kxy, rows%kyx, rows%kyy, rows%skew_start, rows%skew_count, rows%skew_edge, rows%skew, &
                           a, b, local, motion%ux, motion%uy, motion%wx, motion%wy, motion%vx, motion%vy, motion%fx, motion%fy, &
                           loads%px, loads%py, rows%inverse_mass, loads%free_x, loads%free_y, self%paced, self%counted, &
                           self%keep, contact%blocks, .true., contact%impulse, self%partial)
      if (contact%n_pairs == 0) return
      call self%contact_watch%start()
      call contact%step(.true., min(contact_tolerance, contact_fraction*tolerance), warm, b, loads%free_x, loads%free_y, &
                        loads%px, loads%py, motion)
      if (self%now%at_rest) call contact%cohesive%release(contact%n_pairs)
      call self%contact_watch%stop()
   end subroutine step

   !> KINETIC damping: the kinetic energy fell in this step, so it peaked in the middle of the last one; start again
   !> from the displacements there, at rest (Cundall 1976). Without going back, a mode of six steps' period would
   !> come back to the same place for ever.
   subroutine return_to_peak(self, motion, n)
      class(relaxation_t), intent(in) :: self
      type(motion_t), intent(inout) :: motion
      !> nodes
      integer, intent(in) :: n
      motion%ux(:n) = motion%ux(:n) - (self%velocity(:n, 1, 1) + 0.5_wp*self%velocity(:n, 2, 1))
      motion%uy(:n) = motion%uy(:n) - (self%velocity(:n, 1, 2) + 0.5_wp*self%velocity(:n, 2, 2))
      motion%vx(:n) = 0
      motion%vy(:n) = 0
   end subroutine return_to_peak

   !> KINETIC damping: keep the velocities of this step and of the last one.
   subroutine keep_velocities(self, motion, n)
      class(relaxation_t), intent(inout) :: self
      type(motion_t), intent(in) :: motion
      !> nodes
      integer, intent(in) :: n
      if (allocated(self%velocity)) then
         if (size(self%velocity, 1) /= n) deallocate (self%velocity)
      end if
      if (.not. allocated(self%velocity)) allocate (self%velocity(n, 2, 2), source=0.0_wp)
      self%velocity(:, 2, :) = self%velocity(:, 1, :)
      self%velocity(:, 1, 1) = motion%vx(:n)
      self%velocity(:, 1, 2) = motion%vy(:n)
   end subroutine keep_velocities

   !> Sums over blocks, of all nodes and then of contact nodes that were left out, in their order.
   subroutine sum_up(self, rows, contact, sums)
      class(relaxation_t), intent(in) :: self
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(in) :: contact
      real(wp), intent(out) :: sums(n_sums)
      integer :: b
      sums = 0
      do b = 1, rows%n_blocks
         sums = sums + self%partial(:, b)
      end do
      if (contact%n_pairs == 0) return
      do b = 1, contact%blocks%n
         sums(sum_residual) = sums(sum_residual) + contact%partial(1, b)
         sums(sum_reaction) = sums(sum_reaction) + contact%partial(2, b)
      end do
   end subroutine sum_up

   !> Damping coefficient of the next step (theory: eq. 11).
   subroutine next_damping(self, sums, far)
      class(relaxation_t), intent(inout) :: self
      real(wp), intent(in) :: sums(n_sums)
      !> the residual is still far above the tolerance
      logical, intent(in) :: far
      real(wp) :: quotient
      quotient = 0
      if (sums(sum_kinetic) > 0) quotient = max(0.0_wp, sums(sum_curvature)/sums(sum_kinetic))
      quotient = min(quotient, self%debris%slow)
      associate (now => self%now)
         select case (self%settings%damping)
         case (damping_adaptive)
            now%c = min(largest_damping, 2*sqrt(quotient))
         case (damping_viscous)
            ! adaptive until the residual has come down, then the fraction of critical of the slow motion that is left
            if (self%viscous < 0) then
               now%c = min(largest_damping, 2*sqrt(quotient))
               now%lowest = now%lowest + viscous_smoothing*(quotient - now%lowest)
               if (.not. far .and. self%iterations >= viscous_steps) &
                  self%viscous = min(largest_damping, self%settings%factor*2*sqrt(now%lowest))
            else
               now%c = self%viscous
            end if
         case default
            now%c = 0
         end select
      end associate
   end subroutine next_damping

   !> What the kernel must know of each node: supports, loose pieces.
   subroutine prepare_masks(self, mesh, rows, loads, pieces)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(in) :: pieces
      integer :: n, b, p
      logical :: alone, drifts, all_hang
      all_hang = all((pieces%supported .or. pieces%loaded) .and. (.not. pieces%slides .or. pieces%loaded))
      call make_room(self%counted, merge(0, mesh%n_nodes, all_hang))
      call make_room(self%paced, merge(0, mesh%n_nodes, all_hang))
      call make_room(self%keep, merge(0, mesh%n_nodes, all_hang))
      call grow(self%partial, rows%n_blocks, n_sums)
      call grow(self%special, rows%n_blocks)
      self%special = self%settings%damping == damping_local
      do n = 1, mesh%n_nodes
         b = (n - 1)/block_size + 1
         if (loads%is_held(1, n) .or. loads%is_held(2, n)) self%special(b) = .true.
         if (all_hang) cycle
         p = pieces%of_node(n)
         alone = .not. (pieces%supported(p) .or. pieces%loaded(p))
         drifts = (alone .and. .not. self%debris%clamped(p)) .or. (pieces%slides(p) .and. .not. pieces%loaded(p))
         alone = alone .and. .not. self%debris%counts(p)
         self%counted(n) = merge(0.0_wp, 1.0_wp, alone)
         self%paced(n) = merge(0.0_wp, 1.0_wp, drifts)
         self%keep(n) = merge(loose_keep, 1.0_wp, drifts .and. .not. self%debris%counts(p))
         if (alone .or. drifts) self%special(b) = .true.
      end do
   end subroutine prepare_masks

   !> Room for n nodes that have 1; none for none.
   subroutine make_room(values, n)
      real(wp), allocatable, intent(inout) :: values(:)
      integer, intent(in) :: n
      if (allocated(values)) then
         if (n == 0 .and. size(values) > 0) deallocate (values)
      end if
      call grow(values, n)
      values = 1
   end subroutine make_room

   !> Decide how the relaxation ended (theory: eqs. 12 and 15).
   subroutine judge_failure(self, mesh, loads, pieces, motion, sums, scale, tolerance)
      class(relaxation_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(in) :: pieces
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: sums(n_sums), scale, tolerance
      integer :: n
      self%piece = 0
      self%node = 0
      if (.not. ieee_is_finite(sum(sums))) then
         self%outcome = relaxation_not_finite
         self%residual = 0
         do n = 1, mesh%n_nodes
            if (ieee_is_finite(motion%fx(n) + motion%fy(n) + motion%vx(n) + motion%vy(n))) cycle
            self%node = n
            return
         end do
         return
      end if
      self%residual = merge(huge(1.0_wp), 0.0_wp, sums(sum_residual) > 0)
      if (scale > 0) self%residual = sqrt(sums(sum_residual))/scale
      if (sqrt(sums(sum_residual)) <= tolerance*scale) then
         self%outcome = relaxed
         self%largest_scale = max(self%largest_scale, scale)
         return
      end if
      self%outcome = relaxation_failed
      if (self%residual <= rough_factor*tolerance) self%outcome = relaxed_roughly
      self%piece = runaway_piece(mesh, loads, pieces, motion, self%now%start)
      if (self%piece > 0) self%outcome = relaxation_mechanism
   end subroutine judge_failure

   !> The first piece that loads or supports drive, that no support holds, and that has moved far; 0 if there is none.
   integer function runaway_piece(mesh, loads, pieces, motion, start) result(piece)
      type(mesh_t), intent(in) :: mesh
      type(loads_t), intent(in) :: loads
      type(pieces_t), intent(in) :: pieces
      type(motion_t), intent(in) :: motion
      !> sums of displacements at the start [length], (2, pieces)
      real(wp), intent(in) :: start(:, :)
      real(wp), allocatable :: movement(:, :)
      integer, allocatable :: nodes(:), held(:, :)
      integer :: n, p
      allocate (nodes(pieces%n), held(2, pieces%n), source=0)
      do n = 1, mesh%n_nodes
         p = pieces%of_node(n)
         nodes(p) = nodes(p) + 1
         if (loads%is_held(1, n)) held(1, p) = held(1, p) + 1
         if (loads%is_held(2, n)) held(2, p) = held(2, p) + 1
      end do
      movement = summed_displacements(mesh, pieces, motion) - start
      do piece = 1, pieces%n
         if (sum(held(:, piece)) >= 3 .and. all(held(:, piece) > 0)) cycle     ! fewer leave a rigid motion free
         if (.not. (pieces%loaded(piece) .or. pieces%supported(piece))) cycle
         if (norm2(movement(:, piece)) > mechanism_movement*mesh%mean_edge*nodes(piece)) return
      end do
      piece = 0
   end function runaway_piece

   !> Sum of the displacements of each piece's nodes [length], (2, pieces).
   pure function summed_displacements(mesh, pieces, motion) result(sums)
      type(mesh_t), intent(in) :: mesh
      type(pieces_t), intent(in) :: pieces
      type(motion_t), intent(in) :: motion
      real(wp), allocatable :: sums(:, :)
      integer :: n, p
      allocate (sums(2, pieces%n), source=0.0_wp)
      do n = 1, mesh%n_nodes
         p = pieces%of_node(n)
         sums(1, p) = sums(1, p) + motion%ux(n)
         sums(2, p) = sums(2, p) + motion%uy(n)
      end do
   end function summed_displacements

   !> Force of the supports on the body at the present state [force], (2, supported nodes); zero at free directions.
   subroutine reaction(mesh, contact, loads, motion, force)
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      real(wp), allocatable, intent(inout) :: force(:, :)
      real(wp) :: acting(2)
      integer :: n, p, c
      call grow(force, loads%n_supported, 2)
      force = 0
      do n = 1, mesh%n_nodes
         p = loads%place(n)
         if (p == 0) cycle
         acting = loads%acting_at(n)
         force(1, p) = (1 - loads%free_x(n))*(motion%fx(n) - acting(1))
         force(2, p) = (1 - loads%free_y(n))*(motion%fy(n) - acting(2))
      end do
      do c = 1, contact%n_nodes
         n = contact%node(c)
         p = loads%place(n)
         if (p == 0) cycle
         force(1, p) = force(1, p) - (1 - loads%free_x(n))*contact%force(1, c)
         force(2, p) = force(2, p) - (1 - loads%free_y(n))*contact%force(2, c)
      end do
   end subroutine reaction

   !> To or from a checkpoint. (Derived: settings follow from the deck; the masks counted, paced, keep, special,
   !> partial are made anew; element_updates, seconds, contact_watch are figures of one process.)
   subroutine exchange(self, archive)
      class(relaxation_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('under_way', self%under_way)
      call archive%exchange('iterations', self%iterations)
      call archive%exchange('outcome', self%outcome)
      call archive%exchange('residual', self%residual)
      call archive%exchange('b', self%b)
      call archive%exchange('piece', self%piece)
      call archive%exchange('node', self%node)
      call archive%exchange('largest_scale', self%largest_scale)
      call archive%exchange('viscous', self%viscous)
      call archive%exchange('velocity', self%velocity)
      associate (now => self%now)
         call archive%exchange('c', now%c)
         call archive%exchange('at_rest', now%at_rest)
         call archive%exchange('lowest', now%lowest)
         call archive%exchange('kinetic_before', now%kinetic_before)
         call archive%exchange('applied', now%applied)
         call archive%exchange('largest', now%largest)
         call archive%exchange('start', now%start)
      end associate
      call archive%enter('debris')
      call self%debris%exchange(archive)
      call archive%leave()
   end subroutine exchange

end module rf_relaxation
