!> The energy ledger (Qiu & Ding 2007, section 2.5; theory: eqs. 39 to 41): work of loads and reactions by trapezoid between
!> accepted equilibria, against what it became. Energy is released at events only, so that the error is a real check.
module rf_energy
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_loads, only: loads_t
   use rf_motion, only: motion_t
   use rf_renumber, only: renumbering_t, carry
   use rf_topology, only: changes_t
   implicit none
   private
   public :: energy_t

   type :: energy_t
      !> totals since the start [force length]
      real(wp) :: external = 0, strain = 0, kinetic = 0, friction = 0, softening = 0, released = 0, damping = 0
      !> largest |external| so far
      real(wp) :: largest_external = 0
      !> released by the last event
      real(wp) :: released_by_event = 0
      !> a moving body was stopped: what it loses on its way to the next equilibrium is damped
      logical :: falls = .false.
      !> an equilibrium has been accepted
      logical, private :: begun = .false.
      !> displacements of the last accepted equilibrium, (nodes); applied forces, (nodes), not allocated as long as there are
      !> none; reactions, by place among the supports (loads%place)
      real(wp), allocatable, private :: ux(:), uy(:), px(:), py(:), qx(:), qy(:)
      !> which sums of the loads these applied forces are (loads%sums)
      integer, private :: taken = -1
   contains
      procedure :: prepare, accept, adopt, renumber, take_out, error, strain_energy, go_on_from
      procedure, private :: take_loads, force_before
      procedure :: exchange
   end type energy_t

contains

   !> Nothing has moved yet. What holds an initial stress until the first loads act counts as a force applied to the body, so
   !> that its release does work.
   subroutine prepare(self, loads, n_nodes)
      class(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: n_nodes
      call reserve(self, n_nodes)
      call self%take_loads(loads, n_nodes)
   end subroutine prepare

   !> Forces at the start of the next increment: the loads; before the first one what holds the initial stress.
   subroutine take_loads(self, loads, n)
      class(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      !> nodes
      integer, intent(in) :: n
      integer :: i
      self%taken = loads%sums
      if (.not. (allocated(self%px) .or. loads%any_force())) return
      call grow(self%px, size(self%ux))
      call grow(self%py, size(self%ux))
      do i = 1, n
         call keep_force(self, loads, i)
      end do
      if (self%begun .or. .not. allocated(loads%initial)) return
      self%px(:n) = loads%initial(1, :n)
      self%py(:n) = loads%initial(2, :n)
   end subroutine take_loads

   subroutine keep_force(self, loads, node)
      type(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: node
      real(wp) :: force(2)
      force = loads%force_at(node)
      self%px(node) = force(1)
      self%py(node) = force(2)
   end subroutine keep_force

   subroutine reserve(self, n)
      class(energy_t), intent(inout) :: self
      integer, intent(in) :: n
      call grow(self%ux, n)
      call grow(self%uy, n)
      if (.not. allocated(self%px)) return
      call grow(self%px, n)
      call grow(self%py, n)
   end subroutine reserve

   !> Strain energy against the undeformed body: U = u.f/2 + u.f0, f0 the forces of the initial stress (theory: eq. 44)
   !> [force length].
   pure real(wp) function strain_energy(self, loads, motion, n)
      class(energy_t), intent(in) :: self
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      !> nodes
      integer, intent(in) :: n
      associate (unused => self)
      end associate
      strain_energy = 0.5_wp*(dot_product(motion%ux(:n), motion%fx(:n)) + dot_product(motion%uy(:n), motion%fy(:n)))
      if (allocated(loads%initial)) strain_energy = strain_energy + dot_product(motion%ux(:n), loads%initial(1, :n)) &
                                                    + dot_product(motion%uy(:n), loads%initial(2, :n))
   end function strain_energy

   !> What acted on a node at the last equilibrium, applied or by its support [force].
   pure function force_before(self, loads, node) result(force)
      class(energy_t), intent(in) :: self
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: node
      real(wp) :: force(2)
      force = 0
      if (allocated(self%px)) force = [self%px(node), self%py(node)]
      if (.not. allocated(self%qx)) return
      associate (place => loads%place(node))
         if (place > 0 .and. place <= size(self%qx)) force = force + [self%qx(place), self%qy(place)]
      end associate
   end function force_before

   !> Keep the reaction of a node's support.
   subroutine keep_reaction(self, loads, node, reaction)
      type(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: node
      !> [force]
      real(wp), intent(in) :: reaction(2)
      if (loads%place(node) == 0) return
      call grow(self%qx, loads%n_supported)
      call grow(self%qy, loads%n_supported)
      self%qx(loads%place(node)) = reaction(1)
      self%qy(loads%place(node)) = reaction(2)
   end subroutine keep_reaction

   !> Book an equilibrium that is part of the answer.
   subroutine accept(self, loads, motion, reaction, friction_work, softening_work, n, at_event)
      class(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      !> force of the supports on the body [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      !> work against friction since the last equilibrium [force length]
      real(wp), intent(in) :: friction_work
      !> work against the cohesion of cracks that soften, since the start [force length]
      real(wp), intent(in) :: softening_work
      !> nodes
      integer, intent(in) :: n
      !> it is the first equilibrium after a split: what the ledger lacks was released by it
      logical, intent(in) :: at_event
      real(wp) :: work, before, missing, force(2)
      integer :: i
      work = 0
      do i = 1, n
         force = self%force_before(loads, i) + loads%force_at(i) + loads%at_support(reaction, i)
         work = work + 0.5_wp*(force(1)*(motion%ux(i) - self%ux(i)) + force(2)*(motion%uy(i) - self%uy(i)))
      end do
      before = self%strain
      self%external = self%external + work
      self%largest_external = max(self%largest_external, abs(self%external))
      self%strain = self%strain_energy(loads, motion, n)
      self%friction = self%friction + friction_work
      self%released_by_event = 0
      missing = before + work - self%strain - friction_work - (softening_work - self%softening)
      if (at_event) self%released_by_event = missing
      self%softening = softening_work
      self%released = self%released + self%released_by_event
      if (self%falls .and. .not. at_event) self%damping = self%damping + missing
      self%falls = .false.
      call self%go_on_from(loads, motion, reaction, n)
   end subroutine accept

   !> The work up to the present state is booked: the next trapezoid begins here.
   subroutine go_on_from(self, loads, motion, reaction, n)
      class(energy_t), intent(inout) :: self
      type(loads_t), intent(in) :: loads
      type(motion_t), intent(in) :: motion
      !> force of the supports on the body [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      !> nodes
      integer, intent(in) :: n
      integer :: i
      self%ux(:n) = motion%ux(:n)
      self%uy(:n) = motion%uy(:n)
      self%begun = .true.
      call self%take_loads(loads, n)
      do i = 1, n
         call keep_reaction(self, loads, i, loads%at_support(reaction, i))
      end do
   end subroutine go_on_from

   !> Follow a split. The loads have been shared among the copies already; supports do not move during an event, so their
   !> reactions do no work until the next equilibrium.
   subroutine adopt(self, changes, loads, n_nodes)
      class(energy_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: n_nodes
      integer :: i, n, a, b
      call reserve(self, n_nodes)
      do i = 1, changes%n_nodes
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         self%ux(n) = 0.5_wp*(self%ux(a) + self%ux(b))
         self%uy(n) = 0.5_wp*(self%uy(a) + self%uy(b))
         call keep_reaction(self, loads, n, [0.0_wp, 0.0_wp])
      end do
      if (.not. self%begun .or. self%taken /= loads%sums) then
         call self%take_loads(loads, n_nodes)
         return
      end if
      do i = 1, loads%n_touched        ! the others bear what they bore when it was taken
         n = loads%touched(i)
         if (allocated(self%px)) call keep_force(self, loads, n)
      end do
   end subroutine adopt

   !> Follow new numbers of the nodes.
   subroutine renumber(self, map)
      class(energy_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      call carry(self%ux, map%node_from)
      call carry(self%uy, map%node_from)
      call carry(self%px, map%node_from)
      call carry(self%py, map%node_from)
   end subroutine renumber

   !> Elements were removed: the strain energy that they hold leaves the body with them, as negative external work. From now on
   !> the forces by which they acted on the rest are loads of the exposed nodes (theory: eq. 47).
   subroutine take_out(self, stored, softening, exposed, loads, reaction, n_nodes)
      class(energy_t), intent(inout) :: self
      !> of the removed elements [force length]
      real(wp), intent(in) :: stored
      !> work against the cohesion of cracks that soften, with what is left of them [force length]
      real(wp), intent(in) :: softening
      !> nodes whose forces have changed
      integer, intent(in) :: exposed(:)
      type(loads_t), intent(in) :: loads
      !> force of the supports on the body [force], (2, supported nodes)
      real(wp), intent(in) :: reaction(:, :)
      integer, intent(in) :: n_nodes
      integer :: i, n
      self%external = self%external - stored + (softening - self%softening)
      self%softening = softening
      self%largest_external = max(self%largest_external, abs(self%external))
      self%strain = self%strain - stored
      call self%take_loads(loads, n_nodes)
      do i = 1, size(exposed)
         n = exposed(i)
         call keep_reaction(self, loads, n, loads%at_support(reaction, n))
      end do
   end subroutine take_out

   !> What the ledger does not account for, relative to the largest external work [-].
   pure real(wp) function error(self)
      class(energy_t), intent(in) :: self
      error = 0
      if (self%largest_external > 0) error = (self%external - self%strain - self%kinetic - self%friction - self%softening &
                                              - self%released - self%damping)/self%largest_external
   end function error

   !> To or from a checkpoint.
   subroutine exchange(self, archive)
      class(energy_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('external', self%external)
      call archive%exchange('strain', self%strain)
      call archive%exchange('kinetic', self%kinetic)
      call archive%exchange('friction', self%friction)
      call archive%exchange('softening', self%softening)
      call archive%exchange('released', self%released)
      call archive%exchange('damping', self%damping)
      call archive%exchange('largest_external', self%largest_external)
      call archive%exchange('released_by_event', self%released_by_event)
      call archive%exchange('falls', self%falls)
      call archive%exchange('begun', self%begun)
      call archive%exchange('ux', self%ux)
      call archive%exchange('uy', self%uy)
      call archive%exchange('px', self%px)
      call archive%exchange('py', self%py)
      call archive%exchange('qx', self%qx)
      call archive%exchange('qy', self%qy)
      call archive%exchange('taken', self%taken)
   end subroutine exchange

end module rf_energy
