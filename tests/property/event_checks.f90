!> What must hold after every event beyond the invariants of the mesh: all that is attached to the body is what it would be
!> if it were made anew, or what it was before, shared out.
module event_checks
   use rf_kinds, only: wp, i1
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t, next_corner, side_nodes
   use rf_contact, only: contact_t
   use rf_rows, only: rows_t
   use rf_step_k, only: internal_forces
   use rf_pieces, only: pieces_t
   use rf_loads, only: loads_t
   use rf_model, only: model_t
   use rf_failure, only: failure_t
   use rf_invariants, only: baseline_t, check_invariants
   use random_body, only: body_t, n_node_sets, n_element_sets
   use test_meshes, only: check_changes, check_carried, check_pairs, totals_t, take_totals, smallest_angle, nodal_forces, &
      check_forces
   implicit none
   private
   public :: state_t, take_state, check_event, check_anew

   !> sums agree within this part of the sum of magnitudes
   real(wp), parameter :: sum_tolerance = 1.0e-11_wp

   !> what is kept over an event, or looked up after it
   type :: state_t
      type(mesh_t) :: mesh
      type(totals_t) :: totals
      type(contact_t) :: contact
      !> internal forces [force], (2, nodes)
      real(wp), allocatable :: forces(:, :)
      !> applied forces: sum [force], sum of magnitudes
      real(wp) :: applied(2) = 0, applied_scale = 0
      logical, allocatable :: held(:, :)
      !> area of the sets, sections and deck elements [length^2]; boundary between nodes of a set, faces of a load group and
      !> segments of an event [length]
      real(wp), allocatable :: set_area(:), section_area(:), origin_area(:), set_boundary(:), face_length(:), event_length(:)
      !> pieces, and nodes and segments by which cracks joined the boundary
      integer :: pieces = 0
   end type state_t

contains

   !> What is there before an event.
   subroutine take_state(model, state)
      type(model_t), intent(in) :: model
      type(state_t), intent(out) :: state
      integer :: n
      n = model%mesh%n_nodes
      state%mesh = model%mesh
      state%contact = model%contact
      state%forces = nodal_forces(model%mesh, model%material, model%motion)
      state%totals = take_totals(model%mesh, model%motion)
      state%applied = sum(applied_forces(model%loads, n), 2)
      state%applied_scale = sum(abs(applied_forces(model%loads, n)))
      state%held = reshape([model%loads%free_x(:n), model%loads%free_y(:n)] == 0_i1, [2, n], order=[2, 1])
      state%pieces = model%pieces%n
      call measure(model, state)
   end subroutine take_state

   !> Areas and lengths of everything that has a name.
   subroutine measure(model, state)
      type(model_t), intent(in) :: model
      type(state_t), intent(inout) :: state
      integer :: e, k, s, set, nodes(2, 2)
      real(wp) :: length
      allocate (state%set_area(n_element_sets), state%section_area(size(model%material%section)), &
                state%origin_area(maxval(model%mesh%element_origins())), state%set_boundary(n_node_sets), &
                state%face_length(0:model%loads%n_tags), &
                state%event_length(0:model%events), source=0.0_wp)
      associate (mesh => model%mesh)
         do e = 1, mesh%n_elements
            do set = 1, n_element_sets
               if (mesh%element_in_set(e, set)) state%set_area(set) = state%set_area(set) + mesh%area(e)
            end do
            state%section_area(mesh%section(e)) = state%section_area(mesh%section(e)) + mesh%area(e)
            state%origin_area(mesh%origin_of_element(e)) = state%origin_area(mesh%origin_of_element(e)) + mesh%area(e)
            do k = 1, 3
               if (mesh%neighbour(k, e) /= 0) cycle
               associate (a => mesh%connectivity(k, e), b => mesh%connectivity(next_corner(k), e))
                  length = norm2(mesh%x(:, b) - mesh%x(:, a))
                  do set = 1, n_node_sets
                     if (mesh%node_in_set(a, set) .and. mesh%node_in_set(b, set)) &
                        state%set_boundary(set) = state%set_boundary(set) + length
                  end do
               end associate
               set = max(0, mesh%tag_at(k, e))
               state%face_length(set) = state%face_length(set) + length
            end do
         end do
         do s = 1, mesh%n_segments
            nodes = side_nodes(mesh, s)
            length = norm2(mesh%x(:, nodes(2, 1)) - mesh%x(:, nodes(1, 1)))
            state%event_length(mesh%segment_event(s)) = state%event_length(mesh%segment_event(s)) + length
         end do
      end associate
   end subroutine measure

   !> All that must hold after a split; the first thing found wrong is told.
   subroutine check_event(body, before, baseline, jump, problem)
      type(body_t), intent(inout) :: body
      !> before the split
      type(state_t), intent(in) :: before
      type(baseline_t), intent(in) :: baseline
      !> of nodal forces over the split, relative to the largest force
      real(wp), intent(inout) :: jump
      !> empty if nothing is wrong
      character(len=:), allocatable, intent(out) :: problem
      real(wp) :: here
      here = 0
      associate (model => body%model)
         call check_invariants(model%mesh, baseline, problem, model%changes)
         if (len(problem) == 0) call check_changes(before%mesh, model%mesh, model%changes, problem)
         if (len(problem) == 0) call check_carried(before%totals, model%mesh, model%motion, model%changes, problem)
         if (len(problem) == 0) call check_forces(before%forces, model%mesh, model%material, model%motion, model%changes, problem, &
                                                  here)
         jump = max(jump, here)
         if (len(problem) == 0) call check_names(model, before, problem)
         if (len(problem) == 0) call check_members(model, problem)
         if (len(problem) == 0) call check_supports(model, before, problem)
         if (len(problem) == 0) call check_kept_pairs(model, before%contact, problem)
         if (len(problem) == 0 .and. model%pieces%n < before%pieces) problem = 'there are fewer pieces than before'
         if (len(problem) == 0) call check_anew(model, problem)
         if (len(problem) == 0) call check_load_sum(model, before, problem)
      end associate
   end subroutine check_event

   !> Areas and lengths stay those of their names.
   subroutine check_names(model, before, problem)
      type(model_t), intent(in) :: model
      type(state_t), intent(in) :: before
      character(len=:), allocatable, intent(inout) :: problem
      type(state_t) :: now
      integer :: n
      call measure(model, now)
      n = ubound(before%event_length, 1)
      if (far(now%set_area, before%set_area)) problem = 'the area of an element set has changed'
      if (far(now%section_area, before%section_area)) problem = 'the area of a section has changed'
      if (size(now%origin_area) /= size(before%origin_area)) then
         problem = 'an element has an origin that none had'
      else if (far(now%origin_area, before%origin_area)) then
         problem = 'the area of what came from one element has changed'
      end if
      if (far(now%set_boundary, before%set_boundary)) problem = 'the boundary of a node set has changed'
      if (size(now%face_length) /= size(before%face_length)) then
         problem = 'a loaded face has a tag that none had'
      else if (far(now%face_length, before%face_length)) then
         problem = 'the length of loaded faces has changed'
      end if
      if (far(now%event_length(:n), before%event_length)) problem = 'the crack of an earlier event has changed its length'
   end subroutine check_names

   pure logical function far(one, other)
      real(wp), intent(in) :: one(:), other(:)
      far = any(abs(one - other) > sum_tolerance*maxval(abs(other)))
   end function far

   !> A copy belongs to the sets of its node; the middle of a boundary edge to those of both ends, another midpoint to none.
   subroutine check_members(model, problem)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(inout) :: problem
      integer(i1) :: wanted
      integer :: i, n
      associate (changes => model%changes, member => model%mesh%node_membership)
         do i = 1, changes%n_nodes
            n = changes%node(i)
            wanted = 0
            if (changes%parent(2, i) == 0) wanted = member(1, changes%parent(1, i))
            if (changes%on_boundary(i)) wanted = iand(member(1, changes%parent(1, i)), member(1, changes%parent(2, i)))
            if (member(1, n) /= wanted) problem = 'a new node is not in the sets of those it comes from'
         end do
      end associate
   end subroutine check_members

   !> A copy is held where its node is, the middle of a boundary edge where both ends are, between them; nothing else changes.
   subroutine check_supports(model, before, problem)
      type(model_t), intent(in) :: model
      type(state_t), intent(in) :: before
      character(len=:), allocatable, intent(inout) :: problem
      logical :: wanted
      integer :: i, dof, n, parent(2)
      real(wp) :: place(2), scale
      associate (changes => model%changes, loads => model%loads)
         do dof = 1, 2
            do n = 1, size(before%held, 2)
               if (loads%is_held(dof, n) .neqv. before%held(dof, n)) problem = 'an old node is held otherwise than before'
            end do
            do i = 1, changes%n_nodes
               n = changes%node(i)
               parent = merge(changes%parent(1, i), changes%parent(:, i), changes%parent(2, i) == 0)
               wanted = loads%is_held(dof, parent(1)) .and. loads%is_held(dof, parent(2)) .and. &
                        (changes%parent(2, i) == 0 .or. changes%on_boundary(i))
               if (loads%is_held(dof, n) .neqv. wanted) problem = 'a new node is held where its parents are not, or not held'
               if (.not. wanted) cycle
               place = [loads%prescribed(dof, parent(1)), loads%prescribed(dof, parent(2))]
               ! where they are now is the difference of where they started and of where they go
               scale = maxval(abs([loads%support(dof, loads%place(parent))%from, loads%support(dof, loads%place(parent))%to]))
               if (abs(loads%prescribed(dof, n) - 0.5_wp*sum(place)) > 4*epsilon(1.0_wp)*scale) &
                  problem = 'a new node is held at another place than its parents'
            end do
         end do
      end associate
   end subroutine check_supports

   !> Pairs that were there before know what they knew.
   subroutine check_kept_pairs(model, old, problem)
      type(model_t), intent(in) :: model
      type(contact_t), intent(in) :: old
      character(len=:), allocatable, intent(inout) :: problem
      integer :: p, q
      logical :: same
      associate (contact => model%contact)
         do p = 1, old%n_pairs
            q = contact%find_pair(old%pair(1, p), old%pair(2, p))
            if (q == 0) cycle
            if (contact%broken(q) .neqv. old%broken(p)) problem = 'a pair has forgotten whether it is broken'
            same = all(abs(old%normal(:, p) - contact%normal(:, q)) <= epsilon(1.0_wp))
            if (.not. same) cycle
            if (differ(contact%slip_reference(q), old%slip_reference(p))) problem = 'a pair measures its slip from elsewhere'
            if (differ(contact%gap_reference(q), old%gap_reference(p))) problem = 'a pair measures its gap from elsewhere'
            if (abs(contact%area(q) - old%area(p)) > 1.0e-12_wp*old%area(p)) cycle
            if (any(differ(contact%impulse(:, q), old%impulse(:, p)))) problem = 'a pair has lost its impulse'
         end do
      end associate
   end subroutine check_kept_pairs

   !> Forces applied to the first n nodes now [force], (2, n).
   pure function applied_forces(loads, n) result(forces)
      type(loads_t), intent(in) :: loads
      integer, intent(in) :: n
      real(wp), allocatable :: forces(:, :)
      integer :: i
      allocate (forces(2, n))
      do i = 1, n
         forces(:, i) = loads%force_at(i)
      end do
   end function applied_forces

   elemental logical function differ(one, other)
      real(wp), intent(in) :: one, other
      differ = abs(one - other) > 0
   end function differ

   !> The loads on the body are those from before.
   subroutine check_load_sum(model, before, problem)
      type(model_t), intent(in) :: model
      type(state_t), intent(in) :: before
      character(len=:), allocatable, intent(inout) :: problem
      real(wp) :: applied(2)
      integer :: n
      n = model%mesh%n_nodes
      applied = sum(applied_forces(model%loads, n), 2)
      ! pressure in a crack pushes on both faces alike, on new ones too: the sum is the same of more terms
      if (norm2(applied - before%applied) > &
          sum_tolerance*max(before%applied_scale, sum(abs(applied_forces(model%loads, n))))) &
         problem = 'the sum of the loads has changed'
   end subroutine check_load_sum

   !> What followed where the event touched the body is what it would be if it were made anew, bit for bit.
   subroutine check_anew(model, problem)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(inout) :: problem
      type(loads_t) :: loads
      type(rows_t) :: rows
      type(pieces_t) :: pieces
      integer :: n, i
      n = model%mesh%n_nodes
      loads = model%loads
      call loads%apply(model%mesh, model%material, 0.5_wp, 0.5_wp)
      if (any(differ(loads%px(:n), model%loads%px(:n)) .or. differ(loads%py(:n), model%loads%py(:n)))) problem = 'forces on nodes'
      do i = 1, n
         if (any(differ(loads%at_support(loads%displacement, i), model%loads%at_support(model%loads%displacement, i)))) &
            problem = 'supports'
      end do
      if (any(differ(applied_forces(loads, n), applied_forces(model%loads, n)))) problem = 'applied forces'
      call pieces%find(model%mesh)
      if (pieces%n /= model%pieces%n) problem = 'the number of pieces'
      if (any(pieces%of_node(:n) /= model%pieces%of_node(:n))) problem = 'pieces of nodes'
      call rows%build(model%mesh, model%material, model%rows%alike)
      if (any(differ(rows%inverse_mass(:n), model%rows%inverse_mass(:n)))) problem = 'masses'
      if (any(differ(forces_of(rows, model), forces_of(model%rows, model)))) problem = 'rows'
      if (len(problem) > 0) problem = problem//' did not follow'
      if (len(problem) == 0) call check_pairs(model%mesh, model%material, model%contact, problem)
      if (len(problem) == 0) call check_fresh_pairs(model, problem)
      if (len(problem) == 0) call check_looks(model, problem)
   end subroutine check_anew

   !> Internal forces by the rows [force], (2 nodes).
   function forces_of(rows, model) result(f)
      type(rows_t), intent(in) :: rows
      type(model_t), intent(in) :: model
      real(wp), allocatable :: f(:)
      real(wp), allocatable :: fx(:), fy(:)
      allocate (fx(model%mesh%n_nodes), fy(model%mesh%n_nodes))
      call internal_forces(rows%n_blocks, rows%first, rows%count, rows%slice, rows%order, rows%column, rows%kxx, rows%kxy, &
                           rows%kyx, rows%kyy, rows%skew_start, rows%skew_count, rows%skew_edge, rows%skew, &
                           model%motion%ux, model%motion%uy, fx, fy)
      f = [fx, fy]
   end function forces_of

   !> Pairs found without those from before are the same, in the same places.
   subroutine check_fresh_pairs(model, problem)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(inout) :: problem
      type(contact_t) :: fresh
      integer :: n
      call fresh%rebuild(model%mesh, model%material, model%motion)
      n = fresh%n_pairs
      associate (contact => model%contact)
         if (contact%n_pairs /= n .or. contact%n_groups /= fresh%n_groups) then
            problem = 'a fresh search finds other pairs'
         else if (any(contact%pair(:, :n) /= fresh%pair(:, :n))) then
            problem = 'a fresh search finds the pairs in another order'
         else if (any(differ(contact%normal(:, :n), fresh%normal(:, :n))) .or. any(differ(contact%area(:n), fresh%area(:n))) .or. &
                  any(differ(contact%friction(:n), fresh%friction(:n)))) then
            problem = 'a fresh search finds pairs with other normals, areas or friction'
         else if (contact%n_lone /= fresh%n_lone .or. contact%n_nodes /= fresh%n_nodes .or. &
                  any(contact%group_pair(:fresh%n_groups + 1) /= fresh%group_pair(:fresh%n_groups + 1)) .or. &
                  any(contact%group_node(:fresh%n_groups + 1) /= fresh%group_node(:fresh%n_groups + 1)) .or. &
                  any(contact%node(:fresh%n_nodes) /= fresh%node(:fresh%n_nodes)) .or. &
                  any(contact%pair_node(:, :n) /= fresh%pair_node(:, :n))) then
            problem = 'a fresh search finds other groups'
         else if (any(differ(contact%cohesive%area(:n), fresh%cohesive%area(:n))) .or. &
                  any(differ(contact%cohesive%energy(:, :n), fresh%cohesive%energy(:, :n))) .or. &
                  any(differ(contact%cohesive%strength(:, :n), fresh%cohesive%strength(:, :n)))) then
            problem = 'a fresh search finds pairs that soften otherwise'
         end if
      end associate
   end subroutine check_fresh_pairs

   !> The look at the criterion finds, from what it keeps of the body, what it finds from nothing; and its screen leaves out no
   !> node that would have been the largest.
   subroutine check_looks(model, problem)
      type(model_t), intent(in) :: model
      character(len=:), allocatable, intent(inout) :: problem
      type(failure_t) :: kept, fresh
      integer :: n
      n = model%mesh%n_nodes
      kept = model%failure
      kept%settings%on = .true.
      call kept%look(model%mesh, model%material, model%motion)
      fresh%strength = model%failure%strength
      fresh%criterion = model%failure%criterion
      fresh%settings = kept%settings
      allocate (fresh%no_split_node, source=model%failure%no_split_node)
      allocate (fresh%no_split_element, source=model%failure%no_split_element)
      call fresh%prepare(model%mesh, model%material)
      fresh%exhausted(:n) = model%failure%exhausted(:n)
      call fresh%shield(model%mesh, model%contact%bonds())
      call kept%shield(model%mesh, model%contact%bonds())
      if (allocated(fresh%shielded)) then
         if (any(fresh%shielded(:n) .neqv. kept%shielded(:n)) .or. any(fresh%soft_tip(:n) .neqv. kept%soft_tip(:n))) &
            problem = 'nodes that softening cracks shield did not follow'
         fresh%shielded(:n) = model%failure%shielded(:n)
      end if
      call fresh%look_everywhere(model%mesh, model%material, model%motion)
      if (differ(kept%largest, fresh%largest) .and. max(kept%largest, fresh%largest) > 0) &
         problem = 'the largest utilisation is another than that of all nodes'
   end subroutine check_looks

end module event_checks
