!> What a dynamic step needs beyond its keyword: density, a time increment that is safe, no static step's keywords.
module rf_dynamic_input
   use rf_kinds, only: wp
   use rf_deck, only: deck_t, card_t, in_step
   use rf_diagnostics, only: diagnostics_t
   use rf_dynamics, only: safe_time_step, lumped_mass
   use rf_log, only: short
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_rows, only: rows_t
   use rf_step_input, only: step_t
   implicit none
   private
   public :: check_dynamics

contains

   !> Check the dynamic steps once mesh and materials are known.
   subroutine check_dynamics(deck, steps, mesh, material, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(step_t), intent(in) :: steps(:)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(diagnostics_t), intent(in) :: diagnostics
      type(card_t) :: card
      real(wp) :: safe
      integer :: e
      if (deck%describing() .or. diagnostics%n_errors > 0 .or. .not. any(steps%dynamic)) return
      if (mesh%n_elements == 0) return
      safe = 0
      if (any(steps%time_increment > 0)) safe = safe_increment(mesh, material)
      call deck%open(card, 'DYNAMIC', where=in_step)
      do while (deck%next(card))
         do e = 1, mesh%n_elements
            if (.not. material%section(mesh%section(e))%density > 0) exit
         end do
         if (e <= mesh%n_elements) then
            call card%keyword_error('a dynamic step needs the density of material '// &
                                    trim(material%name(material%section(mesh%section(e))%material))//': *DENSITY is missing')
         else if (steps(card%step)%time_increment > safe .and. safe > 0) then
            call card%keyword_error('the time increment '//short(steps(card%step)%time_increment)//' is above the longest that '// &
                                    'is safe, '//short(safe)//'; 0 takes that')
         end if
      end do
   end subroutine check_dynamics

   !> Longest time increment that is safe for the mesh as read; 0 where a density is missing.
   real(wp) function safe_increment(mesh, material) result(safe)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(rows_t) :: rows
      real(wp), allocatable :: mass(:), damping(:)
      safe = 0
      call lumped_mass(mesh, material, mass, damping)
      if (.not. minval(mass(:mesh%n_nodes)) > 0) return
      rows%with_sums = .true.
      call rows%build(mesh, material)
      safe = safe_time_step(mesh%n_nodes, rows, mass)
   end function safe_increment

end module rf_dynamic_input
