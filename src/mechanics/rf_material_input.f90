!> Reads the materials and sections: `*MATERIAL` with the keywords that belong to it, `*SOLID SECTION`. What belongs to
!> strength is read in the fracture layer (rf_strength_input).
module rf_material_input
   use rf_kinds, only: wp
   use rf_cst, only: elasticity
   use rf_deck, only: deck_t, card_t, in_model
   use rf_deck_rules, only: name_table_t, may_be_misspelt
   use rf_diagnostics, only: diagnostics_t, place_t
   use rf_material, only: material_t, section_t, surface_t
   use rf_mesh, only: mesh_t
   use rf_mesh_input, only: mesh_input_t
   use rf_scatter, only: scatter_t, scatter_none, scatter_weibull, scatter_normal, least_modulus, largest_deviation
   use rf_text, only: to_text
   implicit none
   private
   public :: read_materials, material_of

   !> Young's modulus with which the plane constants stay within the range of numbers for any Poisson's ratio [stress]
   real(wp), parameter :: largest_modulus = 1.0e280_wp

   !> a material as the deck gives it
   type :: draft_t
      type(section_t) :: section
      logical :: elastic = .false.
      type(scatter_t) :: scatter
      !> FIELDS of *HETEROGENEITY
      logical :: scatters_strength = .false., scatters_stiffness = .false.
      !> of *MATERIAL
      type(place_t) :: place
   end type draft_t

contains

   !> Read all materials, give every element its section and its factors. After errors the result is harmless: every
   !> element has a section, every section a material.
   subroutine read_materials(deck, mesh_input, mesh, material, diagnostics)
      type(deck_t), intent(inout) :: deck
      !> sets of the deck, plane state of its elements
      type(mesh_input_t), intent(in) :: mesh_input
      !> gets the section of each element
      type(mesh_t), intent(inout) :: mesh
      type(material_t), intent(inout) :: material
      !> errors of meaning; those of the lines come with deck%finish
      type(diagnostics_t), intent(inout) :: diagnostics
      type(name_table_t) :: names
      type(draft_t), allocatable :: draft(:)
      call read_names(deck, names, draft)
      call read_elastic(deck, names, draft, diagnostics)
      call read_density(deck, draft)
      call read_damping(deck, draft)
      call read_friction(deck, draft, material)
      call read_softening(deck, draft)
      call read_heterogeneity(deck, draft)
      call list_names(names, size(draft), material)
      if (.not. deck%describing()) mesh%section(:mesh%n_elements) = 0
      call read_sections(deck, mesh_input, names, draft, mesh, material, diagnostics)
      if (.not. deck%describing()) call draw_factors(draft, mesh, material)
   end subroutine read_materials

   !> Number of the material that a keyword belongs to: the last one before it. Also 1 if there is none, after an error.
   integer function material_of(deck, card, n_materials) result(m)
      type(deck_t), intent(in) :: deck
      type(card_t), intent(inout) :: card
      !> materials there are, at least 1
      integer, intent(in) :: n_materials
      m = min(deck%ordinal(card, 'MATERIAL'), n_materials)
      if (m == 0) call card%keyword_error('*'//card%keyword()//' belongs to a *MATERIAL, which must stand before it')
      m = max(m, 1)
   end function material_of

   !> Room for all materials (at least one, so that what follows always finds one); their names.
   subroutine read_names(deck, names, draft)
      type(deck_t), intent(inout) :: deck
      type(name_table_t), intent(inout) :: names
      type(draft_t), allocatable, intent(out) :: draft(:)
      type(card_t) :: card
      character(len=:), allocatable :: name
      allocate (draft(max(1, deck%count_of('MATERIAL'))))
      call deck%open(card, 'MATERIAL', where=in_model, about='begins a material; the keywords that follow belong to it')
      do while (deck%next(card))
         call card%get_name('NAME', name, about='name of the material')
         call names%define(card, 'material', name)
         draft(names%n)%place = card%keyword_place()
      end do
   end subroutine read_names

   !> The second keyword of a kind that a material (or what else it belongs to) has.
   subroutine refuse_second(card, seen, owner)
      type(card_t), intent(inout) :: card
      !> it has one; true afterwards
      logical, intent(inout) :: seen
      !> 'material' (default)
      character(len=*), intent(in), optional :: owner
      character(len=:), allocatable :: noun
      noun = 'material'
      if (present(owner)) noun = owner
      if (seen) call card%keyword_error('the '//noun//' has *'//card%keyword()//' already')
      seen = .true.
   end subroutine refuse_second

   !> `*ELASTIC`, which every material needs.
   subroutine read_elastic(deck, names, draft, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(name_table_t), intent(in) :: names
      type(draft_t), intent(inout) :: draft(:)
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      integer :: m
      call deck%open(card, 'ELASTIC', where=in_model, about='isotropic linear elasticity')
      do while (deck%next(card))
         associate (this => draft(material_of(deck, card, size(draft))))
            call refuse_second(card, this%elastic)
            if (.not. card%needs_line('E, nu')) cycle
            call card%field_real('E', this%section%young, above=0.0_wp, unit='stress', about='Young''s modulus')
            call card%field_real('nu', this%section%poisson, above=-1.0_wp, below=0.5_wp, about='Poisson''s ratio')
            if (this%section%young < largest_modulus) cycle
            call card%error('E is too large to be computed with')
            this%section%young = 1
         end associate
      end do
      if (deck%describing() .or. may_be_misspelt(card, 'ELASTIC')) return
      do m = 1, names%n
         if (.not. draft(m)%elastic) call diagnostics%error(draft(m)%place, 'material '//names%name(m)%s//' has no *ELASTIC')
      end do
   end subroutine read_elastic

   subroutine read_density(deck, draft)
      type(deck_t), intent(inout) :: deck
      type(draft_t), intent(inout) :: draft(:)
      type(card_t) :: card
      logical :: seen(size(draft))
      integer :: m
      seen = .false.
      call deck%open(card, 'DENSITY', where=in_model, about='mass per volume; gravity and dynamic steps need it')
      do while (deck%next(card))
         m = material_of(deck, card, size(draft))
         call refuse_second(card, seen(m))
         if (.not. card%needs_line('rho')) cycle
         call card%field_real('rho', draft(m)%section%density, above=0.0_wp, unit='mass/length^3', about='density')
      end do
   end subroutine read_density

   !> `*DAMPING`: of motion in dynamic steps. Damping that grows with the stiffness would shorten the time step.
   subroutine read_damping(deck, draft)
      type(deck_t), intent(inout) :: deck
      type(draft_t), intent(inout) :: draft(:)
      type(card_t) :: card
      logical :: seen(size(draft))
      integer :: m
      seen = .false.
      call deck%open(card, 'DAMPING', where=in_model, about='damping in dynamic steps; without it there is none')
      do while (deck%next(card))
         m = material_of(deck, card, size(draft))
         call refuse_second(card, seen(m))
         call card%get_real('ALPHA', draft(m)%section%damping, at_least=0.0_wp, unit='1/time', &
                            about='force against the motion, in units of mass x velocity')
      end do
   end subroutine read_damping

   !> Friction of the surfaces that come by breaking, and of cracks that exist from the start: the block belongs to the last
   !> *MATERIAL or *CRACK before it.
   subroutine read_friction(deck, draft, material)
      type(deck_t), intent(inout) :: deck
      type(draft_t), intent(inout) :: draft(:)
      !> gets the surfaces of the cracks
      type(material_t), intent(inout) :: material
      type(card_t) :: card
      type(surface_t) :: surface
      logical :: noted
      integer :: m, c
      noted = .false.
      if (allocated(material%surface)) deallocate (material%surface)
      allocate (material%surface(deck%count_of('CRACK')))
      call deck%open(card, 'FRICTION', where=in_model, about='friction of surfaces broken in the last *MATERIAL before it '// &
                     '(without it the tangent of the angle of internal friction; between two materials the smaller of each '// &
                     'holds), or of the last *CRACK (without it as if it had come by breaking)')
      do while (deck%next(card))
         c = deck%ordinal(card, 'CRACK')
         if (deck%last_of(card, 'CRACK') > deck%last_of(card, 'MATERIAL')) then
            call refuse_second(card, material%surface(c)%given, 'crack')
            call read_surface(card, surface, noted)
            surface%given = .true.
            material%surface(c) = surface
         else
            m = material_of(deck, card, size(draft))
            call refuse_second(card, draft(m)%section%friction_given)
            call read_surface(card, surface, noted)
            draft(m)%section%friction = surface%friction
            draft(m)%section%cohesion = surface%cohesion
         end if
      end do
   end subroutine read_friction

   !> Parameters and data line of *FRICTION.
   subroutine read_surface(card, surface, noted)
      type(card_t), intent(inout) :: card
      type(surface_t), intent(out) :: surface
      !> the note about the second field has been given
      logical, intent(inout) :: noted
      call card%get_real('COHESION', surface%cohesion, default=0.0_wp, at_least=0.0_wp, unit='stress', &
                         about='shear stress borne besides friction until the surface first slips or opens')
      if (.not. card%needs_line('mu')) return
      call card%field_real('mu', surface%friction, at_least=0.0_wp, about='coefficient of friction')
      if (.not. (noted .or. card%next_is_empty())) then
         call card%note('the second field of *FRICTION is not used and skipped')
         noted = .true.
      end if
      call card%field_skip('stick slope')
   end subroutine read_surface

   !> Fracture energy of cracks that open in the material.
   subroutine read_softening(deck, draft)
      type(deck_t), intent(inout) :: deck
      type(draft_t), intent(inout) :: draft(:)
      type(card_t) :: card
      logical :: seen(size(draft))
      integer :: m
      seen = .false.
      call deck%open(card, 'SOFTENING', where=in_model, about='what breaking costs: the traction on a new crack falls linearly '// &
                     'with its opening and slip (without it, at once). Between two materials the smaller of each holds')
      do while (deck%next(card))
         m = material_of(deck, card, size(draft))
         call refuse_second(card, seen(m))
         if (.not. card%needs_line('Gf_I, Gf_II')) cycle
         associate (energy => draft(m)%section%fracture_energy)
            call card%field_real('Gf_I', energy(1), above=0.0_wp, unit='energy/length^2', about='fracture energy in tension')
            call card%field_real('Gf_II', energy(2), default=energy(1), above=0.0_wp, unit='energy/length^2', shown='Gf_I', &
                                 about='fracture energy in shear, above what friction takes')
         end associate
      end do
   end subroutine read_softening

   !> Scatter of strength and stiffness from element to element.
   subroutine read_heterogeneity(deck, draft)
      type(deck_t), intent(inout) :: deck
      type(draft_t), intent(inout) :: draft(:)
      type(card_t) :: card
      character(len=:), allocatable :: distribution, fields
      logical :: seen(size(draft)), weibull
      integer :: m
      seen = .false.
      call deck%open(card, 'HETEROGENEITY', where=in_model, about='scatter from element to element: one factor of mean 1 for '// &
                     'each, a function of the seed and the element''s id alone; children inherit it')
      do while (deck%next(card))
         m = material_of(deck, card, size(draft))
         call refuse_second(card, seen(m))
         associate (this => draft(m))
            call card%get_word('DISTRIBUTION', distribution, allowed='WEIBULL NORMAL', default='WEIBULL', about='of the factors')
            call card%get_integer('SEED', this%scatter%seed, default=1, about='another seed, another scatter')
            call card%get_word('FIELDS', fields, allowed='STRENGTH ELASTIC ALL', default='STRENGTH', &
                               about='what scatters: sigma_t and c, E, or all of them by the same factor')
            this%scatters_strength = fields /= 'ELASTIC'
            this%scatters_stiffness = fields /= 'STRENGTH'
            weibull = distribution == 'WEIBULL'
            this%scatter%kind = merge(scatter_weibull, scatter_normal, weibull)
            if (.not. card%needs_line(trim(merge('m                 ', 'standard deviation', weibull)))) then
               this%scatter%kind = scatter_none
               cycle
            end if
            call card%form('of WEIBULL')
            if (weibull .or. card%describing()) call card%field_real('m', this%scatter%parameter, at_least=least_modulus, &
                                                                     about='Weibull modulus')
            call card%form('of NORMAL')
            if (.not. weibull .or. card%describing()) call card%field_real('standard deviation', this%scatter%parameter, &
               at_least=0.0_wp, at_most=largest_deviation, about='of the factors; draws below 0.01 are drawn anew')
         end associate
      end do
   end subroutine read_heterogeneity

   !> The names that other layers show.
   subroutine list_names(names, n, material)
      type(name_table_t), intent(in) :: names
      !> materials, at least 1
      integer, intent(in) :: n
      type(material_t), intent(inout) :: material
      integer :: m
      if (allocated(material%name)) deallocate (material%name)
      allocate (material%name(n))
      material%name = ''
      do m = 1, names%n
         material%name(m) = names%name(m)%s
      end do
   end subroutine list_names

   !> Sections of the deck: one for each block and plane state; those of the elements.
   subroutine read_sections(deck, mesh_input, names, draft, mesh, material, diagnostics)
      type(deck_t), intent(inout) :: deck
      type(mesh_input_t), intent(in) :: mesh_input
      type(name_table_t), intent(in) :: names
      type(draft_t), intent(in) :: draft(:)
      type(mesh_t), intent(inout) :: mesh
      type(material_t), intent(inout) :: material
      type(diagnostics_t), intent(inout) :: diagnostics
      type(card_t) :: card
      character(len=:), allocatable :: set_name, name, problem
      type(section_t) :: section
      integer :: set, m
      logical :: failed
      failed = .false.
      if (allocated(material%section)) deallocate (material%section)
      allocate (material%section(0))
      call deck%open(card, 'SOLID SECTION', where=in_model, about='what the elements of a set are made of. An element in '// &
                     'several of them has the last')
      do while (deck%next(card))
         call card%get_name('ELSET', set_name, about='set of elements')
         call card%get_name('MATERIAL', name, about='material')
         section%thickness = 1
         if (card%line()) call card%field_real('thickness', section%thickness, default=1.0_wp, above=0.0_wp, unit='length', &
                                               about='thickness of the body')
         if (card%describing()) cycle
         set = 0
         if (len(set_name) > 0) then
            call mesh_input%elements%find_set(set_name, set, problem)
            if (len(problem) > 0) call card%keyword_error(problem)
         end if
         m = names%find(name)
         if (m == 0 .and. len(name) > 0) call card%keyword_error(names%unknown('material', name))
         failed = failed .or. set == 0 .or. m == 0
         if (set == 0 .or. m == 0) cycle
         section = with_thickness(draft(m)%section, m, section%thickness)
         call assign_section(mesh_input, set, section, mesh, material, card%keyword_place(), diagnostics)
      end do
      failed = failed .or. may_be_misspelt(card, 'SOLID SECTION')
      if (.not. deck%describing()) call complete_sections(mesh, material, failed, diagnostics)
   end subroutine read_sections

   !> Section of a material.
   pure function with_thickness(of_material, m, thickness) result(section)
      type(section_t), intent(in) :: of_material
      !> the material's number
      integer, intent(in) :: m
      !> [length]
      real(wp), intent(in) :: thickness
      type(section_t) :: section
      section = of_material
      section%material = m
      section%thickness = thickness
   end function with_thickness

   !> Give the elements of a set a section.
   subroutine assign_section(mesh_input, set, section, mesh, material, place, diagnostics)
      type(mesh_input_t), intent(in) :: mesh_input
      !> number of the set
      integer, intent(in) :: set
      !> the section but for the plane state
      type(section_t), intent(in) :: section
      type(mesh_t), intent(inout) :: mesh
      type(material_t), intent(inout) :: material
      !> of the keyword
      type(place_t), intent(in) :: place
      type(diagnostics_t), intent(inout) :: diagnostics
      integer :: e, state, number(2)
      logical, allocatable :: again(:)
      number = 0
      allocate (again(mesh%n_elements))
      again = .false.
      do e = 1, mesh%n_elements
         if (.not. mesh%element_in_set(e, set)) cycle
         state = merge(1, 2, mesh_input%plane_strain(e))
         if (number(state) == 0) then
            call add_section(material, section, mesh_input%plane_strain(e))
            number(state) = size(material%section)
         end if
         again(e) = mesh%section(e) > 0
         mesh%section(e) = number(state)
      end do
      if (any(again)) call diagnostics%warning(place, listed(mesh, again)//' had a section before; this one holds')
   end subroutine assign_section

   subroutine add_section(material, section, plane_strain)
      type(material_t), intent(inout) :: material
      type(section_t), intent(in) :: section
      logical, intent(in) :: plane_strain
      type(section_t), allocatable :: larger(:)
      integer :: n
      n = size(material%section)
      allocate (larger(n + 1))
      larger(:n) = material%section
      larger(n + 1) = section
      larger(n + 1)%plane_strain = plane_strain
      larger(n + 1)%law = elasticity(section%young, section%poisson, plane_strain)
      call move_alloc(larger, material%section)
   end subroutine add_section

   !> 'element 17', '3 elements (the first is 17)'
   function listed(mesh, which) result(list)
      type(mesh_t), intent(in) :: mesh
      !> (elements), at least one
      logical, intent(in) :: which(:)
      character(len=:), allocatable :: list
      integer :: first
      first = mesh%element_id(minloc(mesh%element_rank(:mesh%n_elements), dim=1, mask=which))
      if (count(which) == 1) then
         list = 'element '//to_text(first)
      else
         list = to_text(count(which))//' elements (the first is '//to_text(first)//')'
      end if
   end function listed

   !> Elements without a section are an error (unless a section went wrong, which has been said); they get the first.
   subroutine complete_sections(mesh, material, failed, diagnostics)
      type(mesh_t), intent(inout) :: mesh
      type(material_t), intent(inout) :: material
      !> a section could not be assigned
      logical, intent(in) :: failed
      type(diagnostics_t), intent(inout) :: diagnostics
      type(place_t) :: nowhere
      type(section_t) :: harmless
      logical, allocatable :: missing(:)
      allocate (missing(mesh%n_elements))
      missing = mesh%section(:mesh%n_elements) == 0
      if (any(missing) .and. .not. failed) then
         if (size(material%section) == 0) then
            call diagnostics%error(nowhere, 'the deck has no *SOLID SECTION: it says what the elements are made of')
         else
            call diagnostics%error(nowhere, 'no *SOLID SECTION for '//listed(mesh, missing))
         end if
      end if
      if (size(material%section) == 0) then
         harmless%young = 1
         harmless%material = 1
         call add_section(material, harmless, .true.)
      end if
      where (missing) mesh%section(:mesh%n_elements) = 1
   end subroutine complete_sections

   !> Factors of all elements.
   subroutine draw_factors(draft, mesh, material)
      type(draft_t), intent(in) :: draft(:)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(inout) :: material
      integer :: e, m
      real(wp) :: factor
      if (all(draft%scatter%kind == scatter_none)) return
      call material%prepare(mesh%n_elements)
      do e = 1, mesh%n_elements
         m = material%section(mesh%section(e))%material
         if (draft(m)%scatter%kind == scatter_none) cycle
         factor = draft(m)%scatter%factor(mesh%origin_of_element(e))
         if (draft(m)%scatters_strength) material%strength_factor(e) = factor
         if (draft(m)%scatters_stiffness) material%stiffness_factor(e) = factor
      end do
   end subroutine draw_factors
end module rf_material_input
