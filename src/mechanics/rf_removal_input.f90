!> Reads what is taken out of the body: `*MODEL CHANGE, REMOVE, TYPE=ELEMENT`.
module rf_removal_input
   use rf_catalogue, only: selection_t
   use rf_deck, only: deck_t, card_t, in_step
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_renumber, only: renumbering_t
   use rf_text, only: to_text
   implicit none
   private
   public :: removal_t, read_removals, mark_removed, renumber_removal

   !> Elements that go at the begin of a step.
   type :: removal_t
      integer :: step = 0
      !> a set, or one element (the other is 0)
      integer :: set = 0, entity = 0
   end type removal_t

contains

   !> Read all blocks; removals come in the order of the steps.
   subroutine read_removals(deck, mesh_input, mesh, removals)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(removal_t), allocatable, intent(out) :: removals(:)
      type(card_t) :: card
      character(len=:), allocatable :: kind
      logical, allocatable :: gone(:)
      logical :: flag
      allocate (removals(0), gone(mesh%n_elements))
      gone = .false.
      call deck%open(card, 'MODEL CHANGE', where=in_step, about='elements that are taken out for good when the step begins '// &
                     '(excavation). In a static step the forces by which they acted on the rest fall linearly to zero')
      do while (deck%next(card))
         call card%get_flag('REMOVE', flag, about='take out; it must be given')
         if (.not. (flag .or. card%describing())) call card%keyword_error('*MODEL CHANGE needs the parameter REMOVE')
         call card%get_word('TYPE', kind, allowed='ELEMENT', about='what is taken out')
         if (.not. card%needs_line('element or set, ...')) cycle
         do
            call read_line(card, mesh_input, mesh, gone, removals)
            if (.not. card%line()) exit
         end do
         if (mesh%n_elements > 0 .and. all(gone) .and. .not. card%describing()) &
            call card%keyword_error('nothing of the body would be left')
      end do
   end subroutine read_removals

   !> The names on a line.
   subroutine read_line(card, mesh_input, mesh, gone, removals)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      !> what has been removed up to here, (elements)
      logical, intent(inout) :: gone(:)
      type(removal_t), allocatable, intent(inout) :: removals(:)
      type(selection_t) :: selection
      character(len=:), allocatable :: name, problem
      do
         call card%field_name('element or set', name, about='ids of elements or names of sets, any number on a line')
         if (card%describing() .or. len(name) == 0) exit
         call mesh_input%elements%resolve(name, selection, problem)
         if (len(problem) > 0) then
            call card%error(problem)
         else if (selection%set > 0 .or. selection%single > 0) then
            removals = [removals, removal_t(card%step, selection%set, selection%single)]
            call warn_of_gone(card, mesh, removals(size(removals)), name, gone)
            call mark_removed(mesh, removals, size(removals), gone)
         end if
         if (card%next_is_empty()) exit
      end do
   end subroutine read_line

   !> Elements that are named a second time.
   subroutine warn_of_gone(card, mesh, removal, name, gone)
      type(card_t), intent(inout) :: card
      type(mesh_t), intent(in) :: mesh
      type(removal_t), intent(in) :: removal
      character(len=*), intent(in) :: name
      logical, intent(in) :: gone(:)
      logical, allocatable :: named(:)
      integer :: total, again
      allocate (named(mesh%n_elements))
      named = .false.
      call mark_removed(mesh, [removal], 1, named)
      total = count(named)
      again = count(named .and. gone(:mesh%n_elements))
      if (again == 0) return
      if (removal%entity > 0) then
         call card%warning('element '//name//' has been removed before')
      else
         call card%warning(to_text(again)//' of the '//to_text(total)//' elements of '//name//' have been removed before')
      end if
   end subroutine warn_of_gone

   !> Mark the elements that a removal takes, as far as they are in the mesh.
   subroutine mark_removed(mesh, removals, which, gone)
      type(mesh_t), intent(in) :: mesh
      type(removal_t), intent(in) :: removals(:)
      integer, intent(in) :: which
      !> (elements)
      logical, intent(inout) :: gone(:)
      integer :: e
      associate (removal => removals(which))
         do e = 1, mesh%n_elements
            if (mesh%element_in_set(e, removal%set)) gone(e) = .true.
            if (removal%entity == 0) cycle
            if (mesh%origin_of_element(e) == mesh%origin_of_element(removal%entity)) gone(e) = .true.
         end do
      end associate
   end subroutine mark_removed

   !> What a removal that names one element means in new numbers; nothing if all of it is gone.
   pure elemental subroutine renumber_removal(removal, map)
      type(removal_t), intent(inout) :: removal
      type(renumbering_t), intent(in) :: map
      if (removal%entity > 0) removal%entity = map%element_deputy(removal%entity)
   end subroutine renumber_removal

end module rf_removal_input
