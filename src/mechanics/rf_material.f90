!> What the elements are made of: sections (material, plane state, thickness), the scatter of each element, and the stress
!> it is under from the start.
module rf_material
   use rf_kinds, only: wp
   use rf_archive, only: archive_t
   use rf_grow, only: grow
   use rf_cst, only: elasticity_t
   use rf_initial_stress, only: initial_stress_t
   use rf_topology, only: changes_t
   use rf_renumber, only: renumbering_t, carry
   implicit none
   private
   public :: material_t, section_t, surface_t

   !> A material as a section of the body uses it.
   type :: section_t
      !> plane elasticity
      type(elasticity_t) :: law
      !> number of the material (order of the deck)
      integer :: material = 0
      !> plane strain, else plane stress
      logical :: plane_strain = .true.
      !> thickness [length], density [mass/length^3; negative: not given]
      real(wp) :: thickness = 1, density = -1
      !> mass-proportional damping in dynamic steps [1/time]
      real(wp) :: damping = 0
      !> coefficient of friction [-] and cohesion [stress] of surfaces broken in this material
      real(wp) :: friction = 0, cohesion = 0
      !> energy that breaking costs, in tension and in shear [energy/length^2]; 0: it costs none
      real(wp) :: fracture_energy(2) = 0
      !> tensile strength and cohesion of the material [stress]; 0: not given
      real(wp) :: strength(2) = 0
      !> the deck gives the friction; else the strength decides it
      logical :: friction_given = .false.
      !> Young's modulus [stress], Poisson's ratio [-]
      real(wp) :: young = 0, poisson = 0
   end type section_t

   !> Surfaces of a crack that exists from the start.
   type :: surface_t
      !> the deck gives them friction of their own; else that of the materials beside them counts
      logical :: given = .false.
      !> coefficient of friction [-], cohesion [stress]
      real(wp) :: friction = 0, cohesion = 0
   end type surface_t

   type :: material_t
      type(section_t), allocatable :: section(:)
      !> names of the materials, (materials)
      character(len=80), allocatable :: name(:)
      !> surfaces of each *CRACK (not allocated: there is none), (cracks)
      type(surface_t), allocatable :: surface(:)
      !> factor of stiffness and of strength (tensile strength, cohesion) of each element [-], (capacity); not allocated where
      !> nothing scatters
      real(wp), allocatable :: stiffness_factor(:), strength_factor(:)
      type(initial_stress_t) :: initial
   contains
      procedure :: prepare, adopt, renumber, stiffness_of, strength_of, surface_given, out_of_plane
      procedure :: exchange
   end type material_t

contains

   !> Room for the factors of elements that scatter: all are 1 so far.
   subroutine prepare(self, n_elements)
      class(material_t), intent(inout) :: self
      integer, intent(in) :: n_elements
      allocate (self%stiffness_factor(n_elements), self%strength_factor(n_elements), source=1.0_wp)
   end subroutine prepare

   !> Factor of an element's stiffness [-].
   pure real(wp) function stiffness_of(self, element) result(factor)
      class(material_t), intent(in) :: self
      integer, intent(in) :: element
      factor = 1
      if (allocated(self%stiffness_factor)) factor = self%stiffness_factor(element)
   end function stiffness_of

   !> Factor of an element's tensile strength and cohesion [-].
   pure real(wp) function strength_of(self, element) result(factor)
      class(material_t), intent(in) :: self
      integer, intent(in) :: element
      factor = 1
      if (allocated(self%strength_factor)) factor = self%strength_factor(element)
   end function strength_of

   !> Whether a crack has friction of its own (crack 0, broken in the run, has not).
   pure logical function surface_given(self, crack)
      class(material_t), intent(in) :: self
      !> number of the *CRACK
      integer, intent(in) :: crack
      surface_given = .false.
      if (crack > 0 .and. allocated(self%surface)) surface_given = self%surface(crack)%given
   end function surface_given

   !> Children have the factors and the initial stress of the element they were cut from.
   subroutine adopt(self, changes)
      class(material_t), intent(inout) :: self
      type(changes_t), intent(in) :: changes
      integer :: i, child, origin
      call self%initial%adopt(changes)
      if (.not. allocated(self%stiffness_factor)) return
      do i = 1, changes%n_children
         child = changes%child(1, i)
         origin = changes%child(2, i)
         call grow(self%stiffness_factor, child)
         call grow(self%strength_factor, child)
         self%stiffness_factor(child) = self%stiffness_factor(origin)
         self%strength_factor(child) = self%strength_factor(origin)
      end do
   end subroutine adopt

   !> Follow new numbers of the elements.
   subroutine renumber(self, map)
      class(material_t), intent(inout) :: self
      type(renumbering_t), intent(in) :: map
      call carry(self%stiffness_factor, map%element_from)
      call carry(self%strength_factor, map%element_from)
      call carry(self%initial%stress, map%element_from)
   end subroutine renumber

   !> Stress out of the plane that goes with the stress in it (theory: eq. 3) [stress]: what the displacements have added to the
   !> initial stress tells what they have added out of the plane.
   pure real(wp) function out_of_plane(self, section, element, stress) result(zz)
      class(material_t), intent(in) :: self
      !> of the element
      integer, intent(in) :: section, element
      !> xx, yy, xy, the initial stress included [stress]
      real(wp), intent(in) :: stress(3)
      real(wp) :: ratio
      ratio = self%section(section)%law%out_of_plane
      zz = ratio*(stress(1) + stress(2))
      if (.not. self%initial%given) return
      associate (initial => self%initial%stress(:, element))
         zz = initial(3) + ratio*((stress(1) - initial(1)) + (stress(2) - initial(2)))
      end associate
   end function out_of_plane

   !> To or from a checkpoint. (Derived: section, name, surface follow from the deck.)
   subroutine exchange(self, archive)
      class(material_t), intent(inout) :: self
      class(archive_t), intent(inout) :: archive
      call archive%exchange('stiffness_factor', self%stiffness_factor)
      call archive%exchange('strength_factor', self%strength_factor)
      call archive%enter('initial')
      call self%initial%exchange(archive)
      call archive%leave()
   end subroutine exchange

end module rf_material
