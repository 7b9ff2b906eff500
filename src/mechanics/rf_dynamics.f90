!> Explicit dynamics: central differences with the real mass in real time (theory: section 11). The step is that of the
!> relaxation, with velocities in length per step: the mass of a node then enters as m/dt^2, and contact impulses are forces.
module rf_dynamics
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_renumber, only: renumbering_t, carry
   use rf_material, only: material_t
   use rf_rows, only: rows_t
   use rf_contact, only: contact_t, pair_stick
   use rf_loads, only: loads_t
   use rf_motion, only: motion_t
   use rf_energy, only: energy_t
   use rf_step_k, only: relaxation_step, block_size, n_sums
   implicit none
   private
   public :: dynamics_t, safe_time_step, lumped_mass

   !> part of the time step at which Gershgorin's bound of the highest frequency says that a step is just stable
   real(wp), parameter :: safety = 0.9_wp
   !> contact impulses stand when they change by less, relative to the largest
   real(wp), parameter :: contact_tolerance = 1.0e-8_wp

   type :: dynamics_t
      !> some step of the deck is dynamic
      logical :: wanted = .false.
      !> velocities at the present state [length/time], (2, nodes); zero in static steps, not allocated if all steps are
      real(wp), allocatable :: velocity(:, :)
      !> velocities that the deck gives for the start of the first dynamic step, until then, (2, nodes)
      real(wp), allocatable :: initial(:, :)
      !> time from the present state to the next, and from the one before to it (0: it starts from velocities) [time]
      real(wp) :: time_step = 0, last_time_step = 0
      !> largest that is safe for mesh, materials and mass as they are [time]
      real(wp) :: safe = 0
      !> lumped mass of each node: a third of each of its elements [mass]
      real(wp), allocatable :: mass(:)
      !> mass-proportional damping of each node [1/time]
      real(wp), allocatable, private :: damping(:)
      !> dt h/m, and the factor of the old velocity, that the step kernel works with (theory: eq. 49)
      real(wp), allocatable, private :: inverse_mass(:), keep(:)
      real(wp), allocatable, private :: ones(:), partial(:, :)
      logical, allocatable, private :: special(:)
      !> applied forces change with time
      logical :: forces_vary = .false.
      !> the time step changes at the present state; it is the first one of a step
      logical, private :: damped = .false., changing = .false., starting = .false.
      !> directions that supports move: node, direction, place among the contact nodes (0: none); their displacement at the
      !> next state, velocity before the step [length per step] and reaction [force]
      integer, private :: n_moving = 0
      integer, allocatable, private :: moving(:, :)
      real(wp), allocatable, private :: target(:), old_moving(:), moving_force(:)
      !> velocities before the step: of contact nodes, (2, contact nodes); of all nodes, where they are kept
      real(wp), allocatable, private :: old_contact(:, :), old_x(:), old_y(:)
      !> displacements up to which the work of loads that do not vary is booked [length]
      real(wp), allocatable, private :: booked_x(:), booked_y(:)
   contains
      procedure :: prepare, give_velocity, begin_step, follow_split, set_time_step, evaluate, complete, move, end_step
      procedure :: adopt, renumber
      procedure :: kinetic_energy_before, book_loads, not_finite, add_moving, show_initial
      procedure, private :: find_moving, set_factors, drive, find_moving_forces, book_half, prepare_masks, book_change
      procedure :: exchange
   end type dynamics_t

   interface
      !> To or from a checkpoint.
      module subroutine exchange(self, archive)
         class(dynamics_t), intent(inout) :: self
         class(archive_t), intent(inout) :: archive
      end subroutine exchange
   end interface

contains

   !> The body is at rest.
   subroutine prepare(self, n_nodes)
      class(dynamics_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      call grow(self%velocity, n_nodes, 2)
   end subroutine prepare

   !> A velocity that the deck gives for the start of the first dynamic step.
   subroutine give_velocity(self, n_nodes, node, dof, value)
      class(dynamics_t), intent(inout) :: self
      integer, intent(in) :: n_nodes, node, dof
      !> [length/time]
      real(wp), intent(in) :: value
      if (.not. allocated(self%initial)) allocate (self%initial(2, n_nodes), source=0.0_wp)
      self%initial(dof, node) = value
   end subroutine give_velocity

   !> The first step is dynamic: the state before it shows the velocities that the deck gives, and what they are worth.
   subroutine show_initial(self, mesh, material, held, energy)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> directions that the step supports: they are at rest, (2, nodes)
      logical, intent(in) :: held(:, :)
      type(energy_t), intent(inout) :: energy
      integer :: n
      if (.not. allocated(self%initial)) return
      call lumped_mass(mesh, material, self%mass, self%damping)
      do n = 1, mesh%n_nodes
         self%velocity(:, n) = merge(0.0_wp, self%initial(:, n), held(:, n))
         energy%kinetic = energy%kinetic + 0.5_wp*self%mass(n)*sum(self%velocity(:, n)**2)
      end do
      energy%external = energy%kinetic
   end subroutine show_initial

   !> Start a dynamic step from the present displacements and velocities. Loads that have no amplitude act at once.
   subroutine begin_step(self, mesh, material, rows, contact, loads, motion)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(inout) :: motion
      integer :: n
      call motion%reserve(mesh%n_nodes)
      call grow(self%velocity, mesh%n_nodes, 2)
      if (allocated(self%initial)) then
         self%velocity(:, :mesh%n_nodes) = self%initial(:, :mesh%n_nodes)
         deallocate (self%initial)
      end if
      self%forces_vary = loads%forces_vary()
      self%starting = .true.
      self%time_step = 1                ! so that velocities per step are those of the deck until a time step is set
      self%last_time_step = 0
      do n = 1, mesh%n_nodes
         motion%vx(n) = self%velocity(1, n)
         motion%vy(n) = self%velocity(2, n)
      end do
      call self%follow_split(mesh, material, rows, contact, loads, motion)
      self%last_time_step = 0
   end subroutine begin_step

   !> Everything that depends on the mesh anew: mass, what the kernel must know of each node, which supports move.
   subroutine follow_split(self, mesh, material, rows, contact, loads, motion)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      integer :: n
      n = mesh%n_nodes
      call lumped_mass(mesh, material, self%mass, self%damping)
      self%damped = any(self%damping(:n) > 0)
      self%safe = safe_time_step(n, rows, self%mass)
      call self%prepare_masks(mesh, rows, contact, loads)
      call self%find_moving(mesh, contact, loads)
      call grow(self%booked_x, n)
      call grow(self%booked_y, n)
      self%booked_x(:n) = motion%ux(:n)
      self%booked_y(:n) = motion%uy(:n)
   end subroutine follow_split

   !> Mass and damping of all nodes, from the elements in their order.
   subroutine lumped_mass(mesh, material, mass, damping)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> a third of each element [mass]; mean of the elements' damping, weighted by it [1/time], (nodes)
      real(wp), allocatable, intent(inout) :: mass(:), damping(:)
      real(wp) :: third
      integer :: e
      call grow(mass, mesh%n_nodes)
      call grow(damping, mesh%n_nodes)
      mass = 0
      damping = 0
      do e = 1, mesh%n_elements
         associate (section => material%section(mesh%section(e)), corner => mesh%connectivity(:, e))
            third = section%density*section%thickness*mesh%area(e)/3
            mass(corner) = mass(corner) + third
            damping(corner) = damping(corner) + section%damping*third
         end associate
      end do
      damping(:mesh%n_nodes) = damping(:mesh%n_nodes)/mass(:mesh%n_nodes)
   end subroutine lumped_mass

   !> Largest time step that is safe (theory: eq. 50): 0.9 x 2/omega with the bound of Gershgorin for the largest omega.
   pure real(wp) function safe_time_step(n_nodes, rows, mass)
      integer, intent(in) :: n_nodes
      type(rows_t), intent(in) :: rows
      !> (nodes) [mass]
      real(wp), intent(in) :: mass(:)
      safe_time_step = safety*2*sqrt(minval(mass(:n_nodes)/rows%row_sum(:n_nodes)))
   end function safe_time_step

   !> What the kernel must know of each node: all take part, and blocks with supports or damping are special.
   subroutine prepare_masks(self, mesh, rows, contact, loads)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      integer :: n
      call grow(self%ones, 0)
      call grow(self%keep, mesh%n_nodes)
      call grow(self%inverse_mass, mesh%n_nodes)
      call grow(self%partial, rows%n_blocks, n_sums)
      call grow(self%special, rows%n_blocks)
      self%special = self%damped
      do n = 1, mesh%n_nodes
         if (loads%is_held(1, n) .or. loads%is_held(2, n)) self%special((n - 1)/block_size + 1) = .true.
      end do
      call grow(self%old_contact, contact%n_nodes, 2)
   end subroutine prepare_masks

   !> List the directions that supports move.
   subroutine find_moving(self, mesh, contact, loads)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      integer, allocatable :: place(:)
      integer :: n, dof, c
      allocate (place(mesh%n_nodes), source=0)
      do c = 1, contact%n_nodes
         place(contact%node(c)) = c
      end do
      self%n_moving = 0
      do n = 1, mesh%n_nodes
         do dof = 1, 2
            if (.not. loads%is_held(dof, n)) cycle
            associate (ramp => loads%support(dof, loads%place(n)))
               if (.not. (ramp%is_velocity .or. ramp%amplitude > 0 .or. abs(ramp%to - ramp%from) > 0)) cycle
            end associate
            self%n_moving = self%n_moving + 1
            call grow(self%moving, self%n_moving, 3)
            self%moving(:, self%n_moving) = [n, dof, place(n)]
         end do
      end do
      call grow(self%target, self%n_moving)
      call grow(self%old_moving, self%n_moving)
      call grow(self%moving_force, self%n_moving)
   end subroutine find_moving

   !> Choose the time to the next state. Velocities, which are lengths per step, are scaled to it.
   subroutine set_time_step(self, time_step, mesh, contact, loads, motion)
      class(dynamics_t), intent(inout) :: self
      !> [time]
      real(wp), intent(in) :: time_step
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(inout) :: motion
      real(wp) :: scaling
      scaling = time_step/self%time_step
      motion%vx(:mesh%n_nodes) = scaling*motion%vx(:mesh%n_nodes)
      motion%vy(:mesh%n_nodes) = scaling*motion%vy(:mesh%n_nodes)
      self%time_step = time_step
      self%changing = abs(self%time_step - self%last_time_step) > 0
      call self%set_factors(mesh%n_nodes, contact, loads)
   end subroutine set_time_step

   !> Factors of the step from the last time step to this one (theory: eq. 49).
   subroutine set_factors(self, n_nodes, contact, loads)
      class(dynamics_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      real(wp) :: h, c
      integer :: n
      h = 0.5_wp*(self%last_time_step + self%time_step)
      do n = 1, n_nodes
         c = self%damping(n)*h
         self%inverse_mass(n) = 2/(2 + c)*h*self%time_step/self%mass(n)
         self%keep(n) = (2 - c)/(2 + c)
      end do
      call contact%weigh(self%inverse_mass, loads%free_x, loads%free_y)
      call contact%arrange(n_nodes, self%inverse_mass, loads%free_x, loads%free_y, self%ones)
   end subroutine set_factors

   !> Forces of the present state, the velocities after it and the displacements that come next; the ledger up to this state.
   !> The state stays as it is until `move`.
   subroutine evaluate(self, mesh, rows, contact, loads, motion, energy, keep_all, next_time)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(inout) :: motion
      type(energy_t), intent(inout) :: energy
      !> keep the velocities before the step of all nodes: the state will be shown (`complete`)
      logical, intent(in) :: keep_all
      !> step time of the next state [time]
      real(wp), intent(in) :: next_time
      integer :: c, k, n
      n = mesh%n_nodes
      if (contact%blocks%n == 0) &      ! after a restart
         call contact%arrange(n, self%inverse_mass, loads%free_x, loads%free_y, self%ones)
      if (keep_all .or. self%damped .or. self%changing) then
         self%old_x = motion%vx(:n)
         self%old_y = motion%vy(:n)
      end if
      do c = 1, contact%n_nodes
         self%old_contact(:, c) = [motion%vx(contact%node(c)), motion%vy(contact%node(c))]
      end do
      do k = 1, self%n_moving
         self%old_moving(k) = merge(motion%vx(self%moving(1, k)), motion%vy(self%moving(1, k)), self%moving(2, k) == 1)
         self%target(k) = loads%support_at(self%moving(2, k), self%moving(1, k), 1.0_wp, next_time)
      end do
      if (self%forces_vary) call add_work(n, loads, motion, 0.5_wp*self%last_time_step/self%time_step, energy)
      call relaxation_step(n, rows%n_blocks, rows%first, rows%count, self%special, rows%slice, rows%order, rows%column, rows%kxx, &
                           rows%kxy, rows%kyx, rows%kyy, rows%skew_start, rows%skew_count, rows%skew_edge, rows%skew, 1.0_wp, &
                           1.0_wp, 0.0_wp, motion%ux, motion%uy, motion%wx, motion%wy, motion%vx, motion%vy, motion%fx, &
                           motion%fy, loads%px, loads%py, self%inverse_mass, loads%free_x, loads%free_y, self%ones, self%ones, &
                           self%keep, contact%blocks, .false., contact%impulse, self%partial)
      call self%drive(motion)
      if (contact%n_pairs > 0) then      ! all pairs only now: contact needs to know how supports move
         call contact%step(.false., contact_tolerance, 0.0_wp, 1.0_wp, loads%free_x, loads%free_y, loads%px, loads%py, motion)
         if (self%n_moving > 0) call contact%sum_forces(1.0_wp)
         call contact%cohesive%release(contact%n_pairs)
      end if
      call self%drive(motion)       ! contact forms displacements anew from velocities: not to the last bit
      call self%find_moving_forces(contact, loads, motion)
      if (self%changing) call self%book_change(n, motion, energy)
      self%starting = .false.
      if (self%last_time_step > 0) call self%book_half(mesh, contact, motion, energy, before=.true.)
   end subroutine evaluate

   !> Supports that move: their velocity is what takes them to where they are at the next state.
   subroutine drive(self, motion)
      class(dynamics_t), intent(inout) :: self
      type(motion_t), intent(inout) :: motion
      integer :: k, n
      do k = 1, self%n_moving
         n = self%moving(1, k)
         if (self%moving(2, k) == 1) then
            motion%vx(n) = self%target(k) - motion%ux(n)
            motion%wx(n) = self%target(k)
         else
            motion%vy(n) = self%target(k) - motion%uy(n)
            motion%wy(n) = self%target(k)
         end if
      end do
   end subroutine drive

   !> Reactions of supports that move: they bear the inertia of their nodes too.
   subroutine find_moving_forces(self, contact, loads, motion)
      class(dynamics_t), intent(inout) :: self
      type(contact_t), intent(in) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      real(wp) :: h, now, force, acting(2)
      integer :: k, n, c
      h = 0.5_wp*(self%last_time_step + self%time_step)
      do k = 1, self%n_moving
         n = self%moving(1, k)
         c = self%moving(3, k)
         acting = loads%acting_at(n)
         if (self%moving(2, k) == 1) then
            now = motion%vx(n)
            force = motion%fx(n) - acting(1)
         else
            now = motion%vy(n)
            force = motion%fy(n) - acting(2)
         end if
         if (c > 0) force = force - contact%force(self%moving(2, k), c)
         self%moving_force(k) = force + self%mass(n)/self%time_step*((now - self%old_moving(k))/h &
                                                                     + 0.5_wp*self%damping(n)*(now + self%old_moving(k)))
      end do
   end subroutine find_moving_forces

   !> The time step changes at this state: the kinetic energy of (51) is another one for the same motion. At the start of a
   !> step the velocities given are worth so much, which counts as work done on the body; after a split it counts to what that
   !> released (theory: eq. 54).
   subroutine book_change(self, n_nodes, motion, energy)
      class(dynamics_t), intent(in) :: self
      integer, intent(in) :: n_nodes
      type(motion_t), intent(in) :: motion
      type(energy_t), intent(inout) :: energy
      real(wp) :: before, after, part(2), now(2), old(2)
      integer :: n
      before = 0
      after = 0
      part = [self%last_time_step, self%time_step]/(self%last_time_step + self%time_step)
      do n = 1, n_nodes
         now = [motion%vx(n), motion%vy(n)]
         old = [self%old_x(n), self%old_y(n)]
         before = before + self%mass(n)*dot_product(old, old + 2*part(1)*(now - old))
         after = after + self%mass(n)*dot_product(now, now - 2*part(2)*(now - old))
      end do
      before = 0.5_wp*before/self%time_step**2
      after = 0.5_wp*after/self%time_step**2
      if (self%starting) then
         energy%external = energy%external + (after - energy%kinetic)
      else
         energy%released = energy%released + (before - after)
      end if
   end subroutine book_change

   !> Book half a step's work of the forces of this state (theory: eqs. 52 and 53): supports that move, friction, impacts, damping.
   subroutine book_half(self, mesh, contact, motion, energy, before)
      class(dynamics_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(in) :: contact
      type(motion_t), intent(in) :: motion
      type(energy_t), intent(inout) :: energy
      !> the half before the state, else the one after it
      logical, intent(in) :: before
      real(wp) :: part, v(2), rate(2), work(3), moved
      integer :: k, p, a, b
      part = 0.5_wp
      if (before) part = 0.5_wp*self%last_time_step/self%time_step
      do k = 1, self%n_moving
         moved = self%old_moving(k)
         if (.not. before) moved = merge(motion%vx(self%moving(1, k)), motion%vy(self%moving(1, k)), self%moving(2, k) == 1)
         energy%external = energy%external + part*self%moving_force(k)*moved
      end do
      work = 0
      do p = 1, contact%n_pairs
         if (.not. (contact%impulse(1, p) > 0 .or. contact%cohesive%bonded(p))) cycle
         if (before) then
            v = self%old_contact(:, contact%pair_node(2, p)) - self%old_contact(:, contact%pair_node(1, p))
         else
            a = contact%pair(1, p)
            b = contact%pair(2, p)
            v = [motion%vx(b) - motion%vx(a), motion%vy(b) - motion%vy(a)]
         end if
         rate = [contact%normal(1, p)*v(1) + contact%normal(2, p)*v(2), contact%normal(1, p)*v(2) - contact%normal(2, p)*v(1)]
         work(1:2) = work(1:2) + (contact%impulse(:, p) - contact%cohesive%impulse(:, p))*rate
         work(3) = work(3) + dot_product(contact%cohesive%impulse(:, p), rate)
      end do
      energy%damping = energy%damping - part*work(1)
      energy%friction = energy%friction - part*work(2)
      energy%softening = energy%softening - part*work(3)
      if (self%damped) energy%damping = energy%damping + part*damping_work(self, mesh%n_nodes, motion, before)
   end subroutine book_half

   !> Work against mass-proportional damping over a whole step at the velocity before or after the state [force length].
   pure real(wp) function damping_work(self, n_nodes, motion, before) result(work)
      type(dynamics_t), intent(in) :: self
      integer, intent(in) :: n_nodes
      type(motion_t), intent(in) :: motion
      logical, intent(in) :: before
      real(wp) :: x, y
      integer :: n
      work = 0
      do n = 1, n_nodes
         x = merge(self%old_x(n), motion%vx(n), before)
         y = merge(self%old_y(n), motion%vy(n), before)
         work = work + self%damping(n)*self%mass(n)*((motion%vx(n) + self%old_x(n))*x + (motion%vy(n) + self%old_y(n))*y)
      end do
      work = 0.5_wp*work/self%time_step
   end function damping_work

   !> Book the work of applied forces over part of the present velocities.
   subroutine add_work(n_nodes, loads, motion, part, energy)
      integer, intent(in) :: n_nodes
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      real(wp), intent(in) :: part
      type(energy_t), intent(inout) :: energy
      if (allocated(loads%applied)) then
         energy%external = energy%external + part*(dot_product(loads%applied(1, :n_nodes), motion%vx(:n_nodes)) &
                                                   + dot_product(loads%applied(2, :n_nodes), motion%vy(:n_nodes)))
      else
         energy%external = energy%external + part*(dot_product(loads%px(:n_nodes), motion%vx(:n_nodes)) &
                                                   + dot_product(loads%py(:n_nodes), motion%vy(:n_nodes)))
      end if
   end subroutine add_work

   !> Book the work of loads that do not vary, from where it was booked last to the present displacements.
   subroutine book_loads(self, n_nodes, loads, motion, energy)
      class(dynamics_t), intent(inout) :: self
      integer, intent(in) :: n_nodes
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      type(energy_t), intent(inout) :: energy
      integer :: n
      real(wp) :: work, force(2)
      if (self%forces_vary) return
      work = 0
      do n = 1, n_nodes
         force = loads%force_at(n)
         work = work + (force(1)*(motion%ux(n) - self%booked_x(n)) + force(2)*(motion%uy(n) - self%booked_y(n)))
      end do
      energy%external = energy%external + work
      self%booked_x(:n_nodes) = motion%ux(:n_nodes)
      self%booked_y(:n_nodes) = motion%uy(:n_nodes)
   end subroutine book_loads

   !> Reactions of supports that move, in the place of those that would hold the body at rest.
   subroutine add_moving(self, loads, reaction)
      class(dynamics_t), intent(in) :: self
      type(loads_t), intent(in) :: loads
      !> (2, supported nodes) [force]
      real(wp), intent(inout) :: reaction(:, :)
      integer :: k
      do k = 1, self%n_moving
         reaction(self%moving(2, k), loads%place(self%moving(1, k))) = self%moving_force(k)
      end do
   end subroutine add_moving

   !> What is shown of the state just evaluated with keep_all: velocities, energies.
   subroutine complete(self, mesh, loads, motion, energy)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      type(energy_t), intent(inout) :: energy
      real(wp) :: kinetic, part
      integer :: n
      call grow(self%velocity, mesh%n_nodes, 2)
      kinetic = 0
      part = 2*self%time_step/(self%last_time_step + self%time_step)      ! 1 unless the time step changes here
      do n = 1, mesh%n_nodes
         kinetic = kinetic + self%mass(n)*(motion%vx(n)*(motion%vx(n) - part*(motion%vx(n) - self%old_x(n))) &
                                           + motion%vy(n)*(motion%vy(n) - part*(motion%vy(n) - self%old_y(n))))
         self%velocity(:, n) = 0.5_wp*[self%old_x(n) + motion%vx(n), self%old_y(n) + motion%vy(n)]/self%time_step
      end do
      call self%book_loads(mesh%n_nodes, loads, motion, energy)
      energy%kinetic = 0.5_wp*kinetic/self%time_step**2          ! (theory: eq. 51)
      energy%strain = energy%strain_energy(loads, motion, mesh%n_nodes)
      energy%largest_external = max(energy%largest_external, abs(energy%external))
   end subroutine complete

   !> Go to the next state: the ledger's half after this one, displacements, friction from where the faces are then.
   subroutine move(self, mesh, contact, loads, motion, energy)
      class(dynamics_t), intent(inout) :: self
      type(mesh_t), intent(in) :: mesh
      type(contact_t), intent(inout) :: contact
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(inout) :: motion
      type(energy_t), intent(inout) :: energy
      integer :: p
      if (self%forces_vary) call add_work(mesh%n_nodes, loads, motion, 0.5_wp, energy)
      call self%book_half(mesh, contact, motion, energy, before=.false.)
      call motion%advance()
      contact%cohesive%stored = 0
      do p = 1, contact%n_pairs
         call contact%cohesive%settle(p, [contact%opening(motion, p), contact%slip(motion, p)])
         call contact%follow_overlap(motion, p)
         if (.not. contact%cohesive%bonded(p)) contact%cohesive%impulse(:, p) = 0
         if (contact%state(p, 1.0_wp) == pair_stick) cycle
         contact%slip_reference(p) = contact%slip(motion, p)
         contact%broken(p) = .true.
         contact%cohesive_force(p) = 0
      end do
      call contact%follow_references()
      if (self%changing) then
         self%changing = .false.
         self%last_time_step = self%time_step
         call self%set_factors(mesh%n_nodes, contact, loads)
      end if
   end subroutine move

   !> 1/2 m v^2 with the velocities that led to the present state [force length]: what a split changes of it is lost.
   pure real(wp) function kinetic_energy_before(self, n_nodes, motion) result(kinetic)
      class(dynamics_t), intent(in) :: self
      integer, intent(in) :: n_nodes
      type(motion_t), intent(in) :: motion
      integer :: n
      kinetic = 0
      do n = 1, n_nodes
         kinetic = kinetic + self%mass(n)*(motion%vx(n)**2 + motion%vy(n)**2)
      end do
      kinetic = 0.5_wp*kinetic/self%time_step**2
   end function kinetic_energy_before

   !> A static step follows: the body stops, and its kinetic energy counts as damped away; so does what the work against
   !> cohesion, booked step by step, differs from the energy of its law, which static steps go on with.
   subroutine end_step(self, contact, energy)
      class(dynamics_t), intent(inout) :: self
      type(contact_t), intent(in) :: contact
      type(energy_t), intent(inout) :: energy
      energy%damping = energy%damping + energy%kinetic + (energy%softening - contact%cohesive%work())
      energy%softening = contact%cohesive%work()
      energy%kinetic = 0
      energy%falls = .true.
      self%velocity = 0
   end subroutine end_step

   !> Velocities follow a split.
   subroutine adopt(self, changes)
      class(dynamics_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer :: i, n, a, b
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         if (allocated(self%velocity)) then
            call grow(self%velocity, n, 2)
            self%velocity(:, n) = 0.5_wp*(self%velocity(:, a) + self%velocity(:, b))
         end if
         if (.not. allocated(self%initial)) cycle
         call grow(self%initial, n, 2)
         self%initial(:, n) = 0.5_wp*(self%initial(:, a) + self%initial(:, b))
      end do
   end subroutine adopt

   !> Follow new numbers.
   subroutine renumber(self, map)
      class(dynamics_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      call carry(self%velocity, map%node_from)
      call carry(self%initial, map%node_from)
   end subroutine renumber

   !> The first node whose motion is not finite after the last evaluation; 0 if all are.
   integer function not_finite(self, mesh, rows, motion) result(node)
      class(dynamics_t), intent(in) :: self
      type(mesh_t), intent(in) :: mesh
      type(rows_t), intent(in) :: rows
      type(motion_t), intent(in) :: motion
      node = 0
      if (ieee_is_finite(sum(self%partial(:, :rows%n_blocks)))) return
      do node = 1, mesh%n_nodes
         if (.not. ieee_is_finite(motion%fx(node) + motion%fy(node) + motion%vx(node) + motion%vy(node))) return
      end do
      node = maxloc(abs(motion%fx(:mesh%n_nodes)) + abs(motion%fy(:mesh%n_nodes)), dim=1)    ! squares overflow first
   end function not_finite

end module rf_dynamics
