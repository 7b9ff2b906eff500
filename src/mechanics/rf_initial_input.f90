!> Reads the state before the first step: `*INITIAL CONDITIONS`, TYPE=STRESS here, TYPE=VELOCITY in rf_initial_velocity_input.
module rf_initial_input
   use rf_kinds, only: wp
   use rf_dynamics, only: dynamics_t
   use rf_initial_velocity_input, only: read_velocity_line
   use rf_deck, only: deck_t, card_t, in_model
   use rf_initial_stress, only: stress_line_t
   use rf_material, only: material_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_text, only: to_text
   implicit none
   private
   public :: read_initial_conditions

contains

   !> Read all blocks. The elements get their stress when the mesh is complete (model%prepare).
   subroutine read_initial_conditions(deck, mesh_input, mesh, material, dynamics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(inout) :: material
      !> gets initial velocities
      type(dynamics_t), intent(inout) :: dynamics
      type(card_t) :: card
      character(len=:), allocatable :: kind, fields
      logical :: geostatic
      call deck%open(card, 'INITIAL CONDITIONS', where=in_model, about='the state before the first step. An element, or '// &
                     'node and direction, that several lines name has what the last one says')
      do while (deck%next(card))
         call card%get_word('TYPE', kind, allowed='STRESS VELOCITY', about='of what')
         call card%get_flag('GEOSTATIC', geostatic, about='stress that grows with depth: linear in y, taken at the elements'' '// &
                            'centroids')
         fields = 'elset, sxx, syy, szz, sxy'
         if (geostatic) fields = 'elset, s_y1, y1, s_y2, y2, K0'
         if (kind == 'VELOCITY') fields = 'node or set, dof, value'
         if (geostatic .and. kind == 'VELOCITY') call card%keyword_error('GEOSTATIC belongs to TYPE=STRESS')
         if (.not. card%needs_line(fields)) cycle
         do
            if (card%describing()) then
               call card%form('of STRESS')
               call read_uniform(card, mesh_input, mesh, material)
               call card%form('of STRESS, GEOSTATIC')
               call read_depth(card, mesh_input, mesh, material)
               call card%form('of VELOCITY')
               call read_velocity_line(deck, card, mesh_input, mesh, dynamics)
            else if (kind == 'VELOCITY') then
               call read_velocity_line(deck, card, mesh_input, mesh, dynamics)
            else if (geostatic) then
               call read_depth(card, mesh_input, mesh, material)
            else
               call read_uniform(card, mesh_input, mesh, material)
            end if
            if (.not. card%line()) exit
         end do
      end do
   end subroutine read_initial_conditions

   !> A stress that is the same in all elements of a set.
   subroutine read_uniform(card, mesh_input, mesh, material)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(inout) :: material
      real(wp) :: stress(4)
      integer :: set
      call read_set(card, mesh_input, set)
      call card%field_real('sxx', stress(1), unit='stress', about='tension positive')
      call card%field_real('syy', stress(2), unit='stress', about='tension positive')
      call card%field_real('szz', stress(3), unit='stress', about='tension positive; 0 in plane stress')
      call card%field_real('sxy', stress(4), default=0.0_wp, unit='stress', about='shear stress')
      if (card%line_failed .or. set == 0) return
      if (abs(stress(3)) > 0) call refuse_plane_stress(card, 'szz', mesh_input, mesh, set)
      call keep(material, set, stress, [0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
   end subroutine read_uniform

   !> A stress that is linear in y.
   subroutine read_depth(card, mesh_input, mesh, material)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(inout) :: material
      real(wp) :: s(2), y(2), ratio_x, ratio_z, slope, ratio(4)
      integer :: set
      logical :: given
      call read_set(card, mesh_input, set)
      call card%field_real('s_y1', s(1), unit='stress', about='syy at y1, tension positive')
      call card%field_real('y1', y(1), unit='length', about='height')
      call card%field_real('s_y2', s(2), unit='stress', about='syy at y2')
      call card%field_real('y2', y(2), unit='length', about='another height')
      call card%field_real('K0', ratio_x, at_least=0.0_wp, about='sxx/syy')
      given = .not. card%next_is_empty()
      call card%field_real('K0_z', ratio_z, default=ratio_x, at_least=0.0_wp, shown='K0', &
                           about='szz/syy; szz is 0 in plane stress')
      if (card%line_failed .or. set == 0) return
      if (.not. abs(y(2) - y(1)) > 0) then
         call card%error('y1 and y2 are the same height, '//to_text(y(1))//'; they must differ')
         return
      end if
      if (given .and. ratio_z > 0) call refuse_plane_stress(card, 'K0_z', mesh_input, mesh, set)
      slope = (s(2) - s(1))/(y(2) - y(1))
      ratio = [ratio_x, 1.0_wp, ratio_z, 0.0_wp]
      call keep(material, set, ratio*(s(1) - slope*y(1)), ratio*slope)
   end subroutine read_depth

   !> The field with the set; 0 if there is none, or the keyword is only described.
   subroutine read_set(card, mesh_input, set)
      type(card_t), intent(inout) :: card
      type(mesh_input_t), intent(in) :: mesh_input
      integer, intent(out) :: set
      character(len=:), allocatable :: name, problem
      set = 0
      call card%field_name('elset', name, about='set of elements')
      if (card%describing() .or. len(name) == 0) return
      call mesh_input%elements%find_set(name, set, problem)
      if (len(problem) > 0) call card%error(problem)
   end subroutine read_set

   !> A stress out of the plane contradicts plane stress.
   subroutine refuse_plane_stress(card, field, mesh_input, mesh, set)
      type(card_t), intent(inout) :: card
      character(len=*), intent(in) :: field
      type(mesh_input_t), intent(in) :: mesh_input
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: set
      integer :: e, first
      first = 0
      do e = 1, mesh%n_elements
         if (mesh_input%plane_strain(e) .or. .not. mesh%element_in_set(e, set)) cycle
         if (first == 0) first = e
         if (mesh%element_rank(e) < mesh%element_rank(first)) first = e
      end do
      if (first > 0) call card%error('element '//to_text(mesh%element_id(first))//' is in plane stress (CPS3), where there is '// &
                                     'no stress out of the plane: '//field//' must be 0')
   end subroutine refuse_plane_stress

   !> Keep what a line says.
   subroutine keep(material, set, base, slope)
      type(material_t), intent(inout) :: material
      integer, intent(in) :: set
      !> of stress_line_t
      real(wp), intent(in) :: base(4), slope(4)
      type(stress_line_t) :: line
      line%set = set
      line%base = base
      line%slope = slope
      if (.not. allocated(material%initial%line)) allocate (material%initial%line(0))
      material%initial%line = [material%initial%line, line]
   end subroutine keep

end module rf_initial_input
