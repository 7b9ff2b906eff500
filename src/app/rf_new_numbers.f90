!> New numbers of nodes and elements: after what a step takes out of the body when it begins (*MODEL CHANGE), and where
!> splitting has appended so much that the relaxation step would suffer.
submodule(rf_simulation) rf_new_numbers
   use rf_loads, only: renumber_definition
   use rf_removal_input, only: mark_removed, renumber_removal
   use rf_renumber, only: renumbering_t
   implicit none

contains

   module subroutine excavate(self, s)
      class(simulation_t), intent(inout) :: self
      integer, intent(in) :: s
      type(renumbering_t) :: map
      logical, allocatable :: gone(:)
      integer :: i
      if (.not. any(self%removals%step == s)) return
      allocate (gone(self%model%mesh%n_elements))
      gone = .false.
      do i = 1, size(self%removals)
         if (self%removals(i)%step == s) call mark_removed(self%model%mesh, self%removals, i, gone)
      end do
      if (.not. any(gone)) return
      call self%model%remove(gone, .not. self%steps(s)%dynamic, map)
      call renumber_definition(self%loads, map)
      call renumber_removal(self%removals, map)
      call self%follow_growth()
      call self%last%take(self%model)
      call self%log%line('step '//to_text(s)//': '//to_text(count(gone))//' elements removed, '// &
                         to_text(self%model%mesh%n_elements)//' are left')
      call note_lost_monitors(self)
   end subroutine excavate

   module subroutine follow_growth(self, by_more_than)
      class(simulation_t), intent(inout) :: self
      integer, intent(in), optional :: by_more_than
      type(renumbering_t) :: map
      if (.not. self%model%has_grown(by_more_than)) return
      call self%log%line('step '//to_text(self%position%step)//': numbered anew, as the mesh has grown by '// &
                         to_text(self%model%mesh%n_nodes - self%model%mesh%n_numbered_nodes)//' nodes')
      call self%model%renumber(map)
      call renumber_definition(self%loads, map)
      call renumber_removal(self%removals, map)
   end subroutine follow_growth

   !> Monitors whose nodes have all been removed.
   subroutine note_lost_monitors(self)
      type(simulation_t), intent(inout) :: self
      integer :: i
      associate (monitors => self%recorder%history%monitors)
         do i = 1, size(monitors)
            if (.not. any(ieee_is_nan(monitors(i)%force(self%model%mesh, self%model%loads, self%model%reaction)))) cycle
            call self%log%line('warning: all nodes of monitor '//monitors(i)%name//' have been removed: its columns are NaN '// &
                               'from here on')
         end do
      end associate
   end subroutine note_lost_monitors

end submodule rf_new_numbers
