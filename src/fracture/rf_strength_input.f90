!> Reads the strength of the materials (`*STRENGTH`) and the regions that never break (`*NO SPLIT`).
module rf_strength_input
   use rf_kinds, only: wp, pi
   use rf_criteria, only: criterion_names, standard_criterion, make_criterion
   use rf_criterion, only: strength_t
   use rf_criterion_griffith, only: griffith_t, griffith_jump
   use rf_deck, only: deck_t, card_t, in_model
   use rf_diagnostics, only: diagnostics_t
   use rf_failure, only: failure_t
   use rf_material, only: material_t
   use rf_material_input, only: material_of
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_text, only: to_text
   implicit none
   private
   public :: read_strengths, read_no_split, jump_of_criterion

   !> digits that a computed bound is shown with
   integer, parameter :: shown_digits = 6

contains

   !> Strength and criterion of each material; friction of broken surfaces where the deck gives none. After read_materials.
   subroutine read_strengths(deck, material, failure, diagnostics)
      type(deck_t), intent(inout) :: deck
      !> gets the friction
      type(material_t), intent(inout) :: material
      !> gets strength and criterion, (materials)
      type(failure_t), intent(inout) :: failure
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      character(len=:), allocatable :: name
      integer :: m, s
      associate (unused => diagnostics)
      end associate
      call start(failure, size(material%name))
      call deck%open(card, 'STRENGTH', where=in_model, about='strength of the material; *FRACTURE needs it but for regions '// &
                     'of *NO SPLIT')
      do while (deck%next(card))
         m = material_of(deck, card, size(failure%strength))
         if (failure%strength(m)%given) call card%keyword_error('the material has *STRENGTH already')
         call card%get_word('CRITERION', name, allowed=criterion_names, default=standard_criterion, about='GRIFFITH: tension '// &
                            'where sigma1 < -3 sigma3, Mohr-Coulomb elsewhere (Qiu & Ding 2007, eq. 2); CUTOFF: Mohr-Coulomb '// &
                            'with tension cut-off')
         call make_criterion(name, failure%criterion(m))
         call read_values(card, failure%strength(m))
      end do
      do s = 1, size(material%section)
         associate (section => material%section(s))
            if (.not. section%friction_given) section%friction = failure%strength(section%material)%tan_friction
            section%strength = [failure%strength(section%material)%tensile, failure%strength(section%material)%cohesion]
         end associate
      end do
   end subroutine read_strengths

   !> Materials without strength; each has a law, so that it can be asked.
   subroutine start(failure, n_materials)
      type(failure_t), intent(inout) :: failure
      integer, intent(in) :: n_materials
      integer :: m
      if (allocated(failure%strength)) deallocate (failure%strength, failure%criterion)
      allocate (failure%strength(n_materials), failure%criterion(n_materials))
      do m = 1, n_materials
         call make_criterion(standard_criterion, failure%criterion(m))
      end do
   end subroutine start

   !> Tensile strength, cohesion, angle of internal friction. With a tensile strength above the cone's tip c/tan phi there
   !> would be states without any strength left that count as sound.
   subroutine read_values(card, strength)
      type(card_t), intent(inout) :: card
      type(strength_t), intent(inout) :: strength
      real(wp) :: angle
      strength%given = .true.
      if (.not. card%needs_line('sigma_t, c, phi')) return
      call card%field_real('sigma_t', strength%tensile, above=0.0_wp, unit='stress', about='tensile strength, at most c/tan phi')
      call card%field_real('c', strength%cohesion, above=0.0_wp, unit='stress', about='cohesion')
      call card%field_real('phi', angle, at_least=0.0_wp, below=90.0_wp, unit='degrees', about='angle of internal friction')
      strength%tan_friction = tan(angle*pi/180)
      if (card%line_failed) return
      if (above_apex(strength)) &
         call card%error('sigma_t must be at most c/tan phi = '//rounded(strength%cohesion/strength%tan_friction)// &
                         ', the tip of the Mohr-Coulomb cone')
   end subroutine read_values

   !> Whether the tensile strength is more than c/tan phi (by more than rounding), told without a division by 0.
   pure logical function above_apex(strength)
      type(strength_t), intent(in) :: strength
      real(wp), parameter :: margin = 1 + 4*epsilon(1.0_wp)
      if (strength%tan_friction > 1) then
         above_apex = strength%tensile > strength%cohesion/strength%tan_friction*margin
      else
         above_apex = strength%tensile*strength%tan_friction/margin > strength%cohesion
      end if
   end function above_apex

   !> A computed number as text.
   pure function rounded(value) result(text)
      real(wp), intent(in) :: value
      character(len=:), allocatable :: text
      real(wp) :: unit
      text = to_text(value)
      if (abs(log10(value)) > 0.9_wp*range(value)) return ! its last digits may be beyond the range of numbers
      unit = 10.0_wp**(floor(log10(value)) + 1 - shown_digits)
      text = to_text(anint(value/unit)*unit)
   end function rounded

   !> Tension at which GRIFFITH fails in shear where its branches meet [stress]: there it jumps to the tensile strength,
   !> which the log says. 0 for other criteria and without strength.
   pure real(wp) function jump_of_criterion(failure, m) result(tension)
      type(failure_t), intent(in) :: failure
      !> number of the material
      integer, intent(in) :: m
      tension = 0
      if (.not. failure%strength(m)%given) return
      select type (law => failure%criterion(m)%law)
      type is (griffith_t)
         tension = griffith_jump(failure%strength(m)%cohesion, failure%strength(m)%tan_friction)
      end select
   end function jump_of_criterion

   !> Regions that never break; failure%mark_regions has been called before. Of an element set these are the elements and the
   !> nodes inside it (those on its border break towards the outside).
   subroutine read_no_split(deck, mesh_input, mesh, failure, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      !> gets no_split_node and no_split_element
      type(failure_t), intent(inout) :: failure
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      character(len=:), allocatable :: elements, nodes, problem
      integer :: set, i
      associate (unused => diagnostics)
      end associate
      call deck%open(card, 'NO SPLIT', where=in_model, about='a region that never breaks (supports, platens)')
      do while (deck%next(card))
         call card%get_name('ELSET', elements, default='', about='set of elements: they are never cut')
         call card%get_name('NSET', nodes, default='', about='set of nodes: no crack begins or ends at them')
         if (card%describing()) cycle
         if ((len(elements) > 0) .eqv. (len(nodes) > 0)) then
            call card%keyword_error('*NO SPLIT needs either ELSET=name or NSET=name')
         else if (len(elements) > 0) then
            call mesh_input%elements%find_set(elements, set, problem)
            do i = 1, mesh%n_elements
               if (mesh%element_in_set(i, set)) failure%no_split_element(i) = .true.
            end do
            if (len(problem) > 0) call card%keyword_error(problem)
         else
            call mesh_input%nodes%find_set(nodes, set, problem)
            do i = 1, mesh%n_nodes
               if (mesh%node_in_set(i, set)) failure%no_split_node(i) = .true.
            end do
            if (len(problem) > 0) call card%keyword_error(problem)
         end if
      end do
      if (.not. deck%describing()) call protect_inner_nodes(mesh, failure)
   end subroutine read_no_split

   !> A node all of whose elements never break does not break either.
   subroutine protect_inner_nodes(mesh, failure)
      type(mesh_t), intent(in) :: mesh
      type(failure_t), intent(inout) :: failure
      logical, allocatable :: inside(:)
      integer :: e
      if (.not. any(failure%no_split_element(:mesh%n_elements))) return
      allocate (inside(mesh%n_nodes))
      inside = .true.
      do e = 1, mesh%n_elements
         if (.not. failure%no_split_element(e)) inside(mesh%connectivity(:, e)) = .false.
      end do
      where (inside) failure%no_split_node(:mesh%n_nodes) = .true.
   end subroutine protect_inner_nodes
end module rf_strength_input
