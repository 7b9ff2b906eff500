!> The body under load: all that a run computes with, and how it follows a split. Types own their data; the order in
!> which they follow stands here, once.
module rf_model
   use, intrinsic :: iso_fortran_env, only: error_unit
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_build, only: checked_build
   use rf_clock, only: stopwatch_t
   use rf_interruption, only: interruption_t
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_renumber, only: renumbering_t, remove_from_mesh, plan_order, renumber_mesh
   use rf_ordering, only: ordering_none
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   use rf_material, only: material_t
   use rf_rows, only: rows_t
   use rf_contact, only: contact_t, pair_open
   use rf_loads, only: loads_t
   use rf_motion, only: motion_t
   use rf_pieces, only: pieces_t
   use rf_exposure, only: stored_energy, let_fall
   use rf_relaxation, only: relaxation_t, reaction
   use rf_step_k, only: block_size
   use rf_energy, only: energy_t
   use rf_dynamics, only: dynamics_t
   use rf_failure, only: failure_t
   use rf_ray, only: split_t
   use rf_splitting, only: split_mesh
   implicit none
   private
   public :: model_t

   !> slip, in mean edge lengths, up to which node pairs hold
   real(wp), parameter :: far_slip = 0.2_wp
   !> growth of the mesh after which it is numbered anew: this part of its nodes, and a block of the relaxation step at least
   real(wp), parameter :: growth_limit = 0.01_wp
   integer, parameter :: growth_least = block_size

   type :: model_t
      type(mesh_t) :: mesh
      type(material_t) :: material
      type(rows_t) :: rows
      type(contact_t) :: contact
      type(loads_t) :: loads
      type(motion_t) :: motion
      type(pieces_t) :: pieces
      type(relaxation_t) :: relaxation
      type(energy_t) :: energy
      type(dynamics_t) :: dynamics
      type(failure_t) :: failure
      !> force of the supports on the body at the last equilibrium [force], (2, supported nodes) (loads%at_support)
      real(wp), allocatable :: reaction(:, :)
      !> how often the mesh has changed
      integer :: mesh_changes = 0
      !> events so far, in all, in tension and in shear
      integer :: events = 0, events_tension = 0, events_shear = 0
      !> id of the first node whose contact slipped by more than node pairs hold for (0: none)
      integer :: slip_warning_node = 0
      !> ids of the first nodes at which elements are too large for the fracture energy, in opening and in slip (0: none)
      integer :: steep_warning_node(2) = 0
      !> time of splitting
      type(stopwatch_t) :: watch
      !> what the last event changed
      type(changes_t) :: changes
      !> what no split may change
      type(baseline_t), private :: baseline
   contains
      procedure :: prepare, equilibrate, accept, split, remove, has_grown, renumber, watch_slip, watch_softening
      procedure, private :: check, follow_parted, carry_all
      procedure :: exchange
   end type model_t

contains

   !> Everything that follows from mesh, sections, strengths and loads; displacements are zero. The changes are those by
   !> which cracks that exist from the start came into the mesh.
   subroutine prepare(self)
      class(model_t), intent(inout) :: self
      call self%loads%prepare(self%mesh%n_nodes)
      call self%loads%adopt(self%changes)
      call self%material%initial%assign_lines(self%mesh, self%material%section%plane_strain)
      call self%material%initial%nodal_forces(self%mesh, self%material%section%thickness, self%loads%initial)
      self%rows%with_sums = self%dynamics%wanted
      call self%rows%build(self%mesh, self%material)
      call self%motion%reserve(self%mesh%n_nodes)
      call self%contact%rebuild(self%mesh, self%material, self%motion)
      call self%pieces%find(self%mesh)
      call self%energy%prepare(self%loads, self%mesh%n_nodes)
      if (self%dynamics%wanted) call self%dynamics%prepare(self%mesh%n_nodes)
      call self%dynamics%adopt(self%changes)
      call self%failure%prepare(self%mesh, self%material)
      allocate (self%reaction(2, 0))
      if (checked_build) call take_baseline(self%mesh, self%baseline)
   end subroutine prepare

   !> Relax at the present loads. An interruption leaves the relaxation `under_way`.
   subroutine equilibrate(self, tolerance, interruption)
      class(model_t), intent(inout) :: self
      !> residual relative to the scale of forces [-]
      real(wp), intent(in) :: tolerance
      !> asked after each step (default: never)
      type(interruption_t), intent(inout), optional :: interruption
      call self%relaxation%equilibrate(self%mesh, self%rows, self%contact, self%loads, self%pieces, self%motion, tolerance, &
                                       interruption)
      if (self%relaxation%under_way) return
      call reaction(self%mesh, self%contact, self%loads, self%motion, self%reaction)
   end subroutine equilibrate

   !> Take the present equilibrium as part of the answer: friction is measured from here on, the ledger is booked.
   subroutine accept(self, at_event)
      class(model_t), intent(inout) :: self
      !> it is the first equilibrium after a split
      logical, intent(in) :: at_event
      real(wp) :: friction_work
      call self%contact%settle(self%motion, self%relaxation%b, friction_work)
      call self%energy%accept(self%loads, self%motion, self%reaction, friction_work, self%contact%cohesive%work(), &
                              self%mesh%n_nodes, at_event)
      call self%watch_slip()
      call self%watch_softening()
   end subroutine accept

   !> Remember the first node whose contact slipped too far.
   subroutine watch_slip(self)
      class(model_t), intent(inout) :: self
      integer :: node
      if (self%slip_warning_node > 0) return
      node = far_slipped_node(self)
      if (node > 0) self%slip_warning_node = self%mesh%node_id(node)
   end subroutine watch_slip

   !> What follows from softening in an accepted state: the first node of each mode at which it was too steep for the mesh
   !> is remembered, and the criterion knows what it shields.
   subroutine watch_softening(self)
      class(model_t), intent(inout) :: self
      integer :: i, p
      do i = 1, 2
         p = self%contact%cohesive%steep(i)
         if (self%steep_warning_node(i) == 0 .and. p > 0) &
            self%steep_warning_node(i) = self%mesh%node_id(self%contact%pair(1, p))
      end do
      call self%failure%shield(self%mesh, self%contact%bonds())
      ! what broke in this state no longer shields its neighbours, which have not been looked at yet
      if (self%contact%softens()) call self%failure%look(self%mesh, self%material, self%motion)
   end subroutine watch_softening

   !> The first node whose pair is in contact and has slipped by a good part of the element size; 0 if there is none.
   integer function far_slipped_node(self) result(node)
      type(model_t), intent(in) :: self
      integer :: p
      node = 0
      do p = 1, self%contact%n_pairs
         if (self%contact%state(p, self%relaxation%b) == pair_open) cycle
         if (abs(self%contact%slip(self%motion, p)) <= far_slip*self%mesh%mean_edge) cycle
         node = self%contact%pair(1, p)
         return
      end do
   end function far_slipped_node

   !> Split as planned, and let everything that is attached follow.
   subroutine split(self, plan, fraction, time)
      class(model_t), intent(inout) :: self
      type(split_t), intent(in) :: plan
      !> part of the step that is done [-] and step time: the loads are shared anew
      real(wp), intent(in) :: fraction, time
      call self%watch%start()
      self%mesh_changes = self%mesh_changes + 1
      self%events = self%events + 1
      call split_mesh(self%mesh, plan, self%events, self%changes)     ! the only phase in which anything grows
      call self%material%adopt(self%changes)
      call self%motion%adopt(self%changes)
      call self%dynamics%adopt(self%changes)
      call self%loads%adopt(self%changes)
      call self%material%initial%nodal_forces(self%mesh, self%material%section%thickness, self%loads%initial, self%changes)
      call self%loads%follow(self%mesh, self%material, self%changes, fraction, time)
      call self%rows%update(self%mesh, self%material, self%changes)
      call self%contact%follow(self%mesh, self%material, self%motion, self%changes)
      call self%pieces%follow(self%mesh, self%changes)
      call self%energy%adopt(self%changes, self%loads, self%mesh%n_nodes)
      call self%failure%adopt(self%mesh, self%changes)
      call self%failure%shield(self%mesh, self%contact%bonds())
      call self%failure%aim(self%mesh, self%events, self%mesh%x(:, plan%node), plan%direction)
      call self%watch%stop()
      if (checked_build) call self%check()
   end subroutine split

   !> Take elements out for good, between two steps. The forces by which they acted on the rest become loads of the exposed
   !> nodes that fall to zero over the step that begins next (theory: eqs. 45 to 47).
   subroutine remove(self, gone, falling, map)
      class(model_t), intent(inout) :: self
      !> the element goes, (elements)
      logical, intent(in) :: gone(:)
      !> the forces fall over a static step; else they are gone at once
      logical, intent(in) :: falling
      !> old numbers to new ones
      type(renumbering_t), intent(out) :: map
      integer, allocatable :: exposed(:)
      real(wp) :: stored
      self%mesh_changes = self%mesh_changes + 1
      stored = stored_energy(self%mesh, self%material, self%motion, gone)
      call remove_from_mesh(self%mesh, gone, map, self%changes, exposed)
      call self%carry_all(map, exposed)
      call self%follow_parted()
      if (falling) call let_fall(self%mesh, self%material, self%motion, self%contact, self%loads, self%reaction, &
                                 self%relaxation%b, exposed)
      call self%contact%cohesive%take_stock(self%contact%n_pairs)
      call self%energy%take_out(stored, self%contact%cohesive%work(), exposed, self%loads, self%reaction, self%mesh%n_nodes)
      if (checked_build) call take_baseline(self%mesh, self%baseline)
      if (checked_build) call self%check()
   end subroutine remove

   !> Everything that is kept by node, element or pair follows new numbers.
   subroutine carry_all(self, map, exposed)
      class(model_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      !> nodes that lost elements, new numbers
      integer, intent(in) :: exposed(:)
      call self%material%renumber(map)
      call self%motion%renumber(map)
      call self%dynamics%renumber(map)
      call self%loads%renumber(map)
      call self%contact%renumber(map)
      call self%energy%renumber(map)
      call self%failure%renumber(map, exposed)
   end subroutine carry_all

   !> Whether so much has been appended since the numbers were given that the relaxation step suffers from it. It depends on
   !> the mesh alone, so that a run is numbered anew at the same events whatever it is run with.
   pure logical function has_grown(self, by_more_than)
      class(model_t), intent(in) :: self
      !> so many nodes (default: as many as the step suffers from)
      integer, intent(in), optional :: by_more_than
      integer :: limit
      associate (mesh => self%mesh)
         limit = max(growth_least, int(growth_limit*mesh%n_numbered_nodes))
         if (present(by_more_than)) limit = by_more_than
         has_grown = mesh%ordering /= ordering_none .and. mesh%n_nodes - mesh%n_numbered_nodes > limit
      end associate
   end function has_grown

   !> Number nodes and elements anew, so that what splitting has appended comes to stand beside its neighbours. No result
   !> shows it but for the order of sums.
   subroutine renumber(self, map)
      class(model_t), intent(inout) :: self
      !> old numbers to new ones
      type(renumbering_t), intent(out) :: map
      call self%watch%start()
      call plan_order(self%mesh, map)
      call renumber_mesh(self%mesh, map)
      call self%carry_all(map, exposed=[integer ::])
      call self%changes%clear()
      call self%rows%build(self%mesh, self%material)
      call self%contact%rebuild(self%mesh, self%material, self%motion)
      call self%pieces%find(self%mesh)
      call self%watch%stop()
      if (checked_build) call self%check()
   end subroutine renumber

   !> What follows from the mesh after a removal, copies of parted nodes included.
   subroutine follow_parted(self)
      class(model_t), intent(inout) :: self
      call self%motion%adopt(self%changes)
      call self%dynamics%adopt(self%changes)
      call self%loads%adopt(self%changes)
      call self%material%initial%nodal_forces(self%mesh, self%material%section%thickness, self%loads%initial)
      call self%loads%gather(self%mesh, self%material)
      call self%rows%build(self%mesh, self%material)
      call self%contact%rebuild(self%mesh, self%material, self%motion, self%changes)
      call self%pieces%find(self%mesh)
      call self%failure%adopt(self%mesh, self%changes)
      call self%failure%shield(self%mesh, self%contact%bonds())
      if (self%changes%n_nodes > 0) call self%energy%adopt(self%changes, self%loads, self%mesh%n_nodes)
   end subroutine follow_parted

   !> Builds for development end at once where a split has broken the mesh: that is a fault of ours, not of the deck.
   subroutine check(self)
      class(model_t), intent(in) :: self
      character(len=:), allocatable :: problem
      call check_invariants(self%mesh, self%baseline, problem, self%changes)
      if (len(problem) == 0) return
      write (error_unit, '(a, i0, 2a)') 'rfem: after event ', self%events, ': ', problem
      error stop 'the mesh is broken'
   end subroutine check

   !> To or from a checkpoint. (Derived: watch is of one process.)
   subroutine exchange(self, archive)
      class(model_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%enter('mesh')
      call self%mesh%exchange(archive)
      call archive%leave()
      call archive%enter('material')
      call self%material%exchange(archive)
      call archive%leave()
      call archive%enter('rows')
      call self%rows%exchange(archive)
      call archive%leave()
      call archive%enter('contact')
      call self%contact%exchange(archive)
      call archive%leave()
      call archive%enter('loads')
      call self%loads%exchange(archive)
      call archive%leave()
      call archive%enter('motion')
      call self%motion%exchange(archive)
      call archive%leave()
      call archive%enter('pieces')
      call self%pieces%exchange(archive)
      call archive%leave()
      call archive%enter('relaxation')
      call self%relaxation%exchange(archive)
      call archive%leave()
      call archive%enter('energy')
      call self%energy%exchange(archive)
      call archive%leave()
      call archive%enter('dynamics')
      call self%dynamics%exchange(archive)
      call archive%leave()
      call archive%enter('failure')
      call self%failure%exchange(archive)
      call archive%leave()
      call archive%exchange('reaction', self%reaction)
      call archive%exchange('mesh_changes', self%mesh_changes)
      call archive%exchange('events', self%events)
      call archive%exchange('events_tension', self%events_tension)
      call archive%exchange('events_shear', self%events_shear)
      call archive%exchange('slip_warning_node', self%slip_warning_node)
      call archive%exchange_fixed('steep_warning_node', self%steep_warning_node)
      call archive%enter('changes')
      call self%changes%exchange(archive)
      call archive%leave()
      call archive%enter('baseline')
      call self%baseline%exchange(archive)
      call archive%leave()
      if (archive%reading .and. .not. allocated(archive%error)) call mend_baseline(self)
   end subroutine exchange

   !> Only a checked build keeps the baseline: one that goes on with the checkpoint of another begins with the body as it is now,
   !> and another does not hand on one that it lets grow old.
   subroutine mend_baseline(self)
      class(model_t), intent(inout) :: self
      type(baseline_t) :: none
      if (.not. checked_build) then
         self%baseline = none
      else if (self%baseline%n_elements == 0) then
         call take_baseline(self%mesh, self%baseline)
      end if
   end subroutine mend_baseline

end module rf_model
