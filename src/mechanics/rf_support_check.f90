!> Whether the supports hold every piece of the body.
module rf_support_check
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_model, in_step, in_both
   use rf_deck_rules, only: any_failed
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_loads, only: load_definition_t, load_support
   use rf_mesh, only: mesh_t
   use rf_topology, only: changes_t
   use rf_pieces, only: pieces_t
   use rf_removal_input, only: removal_t, mark_removed
   use rf_renumber, only: renumbering_t, remove_from_mesh
   use rf_text, only: to_text
   implicit none
   private
   public :: check_supports, check_rigid_motion, hold

   !> places count as different from this part of the piece's size on (deck.md's margin for geometric sets)
   real(wp), parameter :: margin_of_size = 1.0e-6_wp
   !> pieces that are named one by one
   integer, parameter :: pieces_shown = 3

   !> the supports of one piece
   type :: stance_t
      !> lowest and highest x and y of its nodes [length]
      real(wp) :: low(2) = huge(1.0_wp), high(2) = -huge(1.0_wp)
      !> lowest and highest y of the nodes held along x, and x of those held along y [length]
      real(wp) :: arm_low(2) = huge(1.0_wp), arm_high(2) = -huge(1.0_wp)
      !> directions that some node is held in
      logical :: held(2) = .false.
      !> its first node in the order of the deck
      integer :: first = 0
   end type stance_t

contains

   !> Check the supports of each step with *STATIC; after the first step that lacks some the others are not looked at.
   !> Nothing is said where the mesh or the supports were not read without errors.
   subroutine check_supports(deck, mesh, definitions, replaced, removals, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_t), intent(in) :: mesh
      !> of all steps, in order (read_loads)
      type(load_definition_t), intent(in) :: definitions(:)
      !> OP=NEW, (kinds, steps)
      logical, intent(in) :: replaced(:, :)
      !> what steps take out of the body
      type(removal_t), intent(in) :: removals(:)
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      logical, allocatable :: held(:, :), gone(:)
      integer :: before, step, i
      if (deck%describing() .or. mesh%n_elements == 0) return
      if (any_failed(deck, 'NODE', in_model) .or. any_failed(deck, 'ELEMENT', in_model) .or. any_failed(deck, 'MESH', in_model) &
          .or. any_failed(deck, 'NSET', in_model) .or. any_failed(deck, 'BOUNDARY', in_both) .or. &
          any_failed(deck, 'MODEL CHANGE', in_step)) return
      allocate (held(2, mesh%n_nodes), gone(mesh%n_elements))
      held = .false.
      gone = .false.
      before = diagnostics%n_errors
      step = -1
      call deck%open(card, 'STATIC', where=in_step)
      do while (deck%next(card))
         do while (step < card%step)
            step = step + 1
            if (step > 0) then
               if (replaced(load_support, step)) held = .false.
            end if
            call hold(mesh, pack(definitions, definitions%step == step), held)
            do i = 1, size(removals)
               if (removals(i)%step == step) call mark_removed(mesh, removals, i, gone)
            end do
         end do
         call check_rest(mesh, gone, held, card%keyword_place(), diagnostics)
         if (diagnostics%n_errors > before) return
      end do
   end subroutine check_supports

   !> Check what is left of the body, after everything has been taken out that is gone by then.
   subroutine check_rest(mesh, gone, held, place, diagnostics)
      type(mesh_t), intent(in) :: mesh
      !> (elements)
      logical, intent(in) :: gone(:)
      !> the direction is supported, (2, nodes)
      logical, intent(in) :: held(:, :)
      type(place_t), intent(in) :: place
      type(diagnostics_t), intent(inout) :: diagnostics
      type(mesh_t) :: rest
      type(renumbering_t) :: map
      type(changes_t) :: changes
      integer, allocatable :: exposed(:)
      logical, allocatable :: rest_held(:, :)
      if (.not. any(gone) .or. all(gone)) then
         if (.not. any(gone)) call check_rigid_motion(mesh, held, place, diagnostics)
         return
      end if
      rest = mesh
      call remove_from_mesh(rest, gone, map, changes, exposed)
      allocate (rest_held(2, rest%n_nodes))
      rest_held(:, :map%n_nodes) = held(:, map%node_from)
      if (changes%n_nodes > 0) rest_held(:, changes%node(:changes%n_nodes)) = &
         rest_held(:, changes%parent(1, :changes%n_nodes))
      call check_rigid_motion(rest, rest_held, place, diagnostics)
   end subroutine check_rest

   !> Mark the directions that definitions of supports hold.
   subroutine hold(mesh, definitions, held)
      type(mesh_t), intent(in) :: mesh
      !> of one step; others than supports do not count
      type(load_definition_t), intent(in) :: definitions(:)
      !> (2, nodes)
      logical, intent(inout) :: held(:, :)
      integer :: i, n
      do i = 1, size(definitions)
         associate (this => definitions(i))
            if (this%kind /= load_support) cycle
            if (this%entity > 0) held(this%first_dof:this%last_dof, this%entity) = .true.
            do n = 1, merge(mesh%n_nodes, 0, this%set > 0)
               if (mesh%node_in_set(n, this%set)) held(this%first_dof:this%last_dof, n) = .true.
            end do
         end associate
      end do
   end subroutine hold

   !> Each piece that can move as a rigid body is an error. A node held along x allows no translation along x, one held
   !> along y none along y; a rotation is excluded by two nodes held along x at different heights, or along y at different
   !> x: otherwise the body turns about the point where the lines of all supports meet.
   subroutine check_rigid_motion(mesh, held, place, diagnostics)
      type(mesh_t), intent(in) :: mesh
      !> the direction is supported, (2, nodes)
      logical, intent(in) :: held(:, :)
      !> where the errors belong: the step's *STATIC
      type(place_t), intent(in) :: place
      type(diagnostics_t), intent(inout) :: diagnostics
      type(pieces_t) :: pieces
      type(stance_t), allocatable :: stance(:)
      character(len=:), allocatable :: motions
      integer :: p, n_free
      call pieces%find(mesh)
      call find_stances(mesh, held, pieces, stance)
      n_free = 0
      do p = 1, pieces%n
         motions = free_motions(stance(p))
         if (len(motions) == 0) cycle
         n_free = n_free + 1
         if (n_free > pieces_shown) cycle
         if (pieces%n == 1) then
            call diagnostics%error(place, 'the supports leave a rigid motion free: the body can '//motions)
         else
            call diagnostics%error(place, 'the supports leave a rigid motion free: the piece with node '// &
                                   to_text(mesh%node_id(stance(p)%first))//' can '//motions)
         end if
      end do
      if (n_free > pieces_shown) call diagnostics%error(place, 'the supports leave a rigid motion of '// &
                                                        to_text(n_free - pieces_shown)//' more pieces free')
   end subroutine check_rigid_motion

   !> What holds each piece, and where.
   subroutine find_stances(mesh, held, pieces, stance)
      type(mesh_t), intent(in) :: mesh
      logical, intent(in) :: held(:, :)
      type(pieces_t), intent(in) :: pieces
      !> (pieces)
      type(stance_t), allocatable, intent(out) :: stance(:)
      integer :: n, dof
      allocate (stance(pieces%n))
      do n = 1, mesh%n_nodes
         associate (this => stance(pieces%of_node(n)), x => mesh%x(:, n))
            this%low = min(this%low, x)
            this%high = max(this%high, x)
            if (this%first == 0) this%first = n
            if (mesh%node_rank(n) < mesh%node_rank(this%first)) this%first = n
            do dof = 1, 2
               if (.not. held(dof, n)) cycle
               this%held(dof) = .true.
               this%arm_low(dof) = min(this%arm_low(dof), x(3 - dof))
               this%arm_high(dof) = max(this%arm_high(dof), x(3 - dof))
            end do
         end associate
      end do
   end subroutine find_stances

   !> 'move along x, turn'; empty where nothing is free.
   pure function free_motions(stance) result(text)
      type(stance_t), intent(in) :: stance
      character(len=:), allocatable :: text
      real(wp) :: margin
      logical :: turns
      text = ''
      if (.not. stance%held(1)) text = 'move along x'
      if (.not. stance%held(2)) text = joined_with(text, 'move along y')
      margin = margin_of_size*maxval(stance%high - stance%low)
      turns = .true.
      if (stance%held(1)) turns = turns .and. stance%arm_high(1) - stance%arm_low(1) <= margin
      if (stance%held(2)) turns = turns .and. stance%arm_high(2) - stance%arm_low(2) <= margin
      if (turns) text = joined_with(text, 'turn')
   end function free_motions

   pure function joined_with(text, word) result(longer)
      character(len=*), intent(in) :: text, word
      character(len=:), allocatable :: longer
      longer = word
      if (len(text) > 0) longer = text//', '//word
   end function joined_with
end module rf_support_check
