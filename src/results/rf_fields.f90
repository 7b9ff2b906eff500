!> Every field of a frame, one row each: name, unit, place, sign, how it is filled. Files, ASCII headers and docs follow
!> from this table. Fill procedures work in internal numbering, from the live model, at the time of writing.
module rf_fields
   use rf_kinds, only: wp
   use rf_model, only: model_t
   use rf_criterion, only: principal, strength_t
   use rf_recovery, only: patch_work_t, node_stress
   implicit none
   private
   public :: field_t, point_fields, cell_fields

   !> when a field is in the file
   integer, parameter, public :: always = 1, with_fracture = 2, with_dynamics = 3

   type :: field_t
      character(len=:), allocatable :: name
      integer :: components = 1
      !> stored as 64-bit real, 32-bit real, or integer
      logical :: double = .false., whole = .false.
      integer :: present_when = always
      !> kind of quantity, and the sign convention, for the users' reference
      character(len=:), allocatable :: unit, sign
      procedure(fill_interface), pointer, nopass :: fill => null()
   end type field_t

   abstract interface
      !> Values of a field, (components, entities), in internal numbering.
      subroutine fill_interface(model, values)
         import :: model_t, wp
         type(model_t), intent(in) :: model
         real(wp), intent(inout) :: values(:, :)
      end subroutine fill_interface
   end interface

contains

   !> Fields at the nodes.
   subroutine point_fields(fields)
      type(field_t), allocatable, intent(out) :: fields(:)
      allocate (fields(9))
      call describe(fields(1), 'displacement', 3, 'length', 'along x, y, z', fill_displacement)
      fields(1)%double = .true.
      call describe(fields(2), 'reaction', 3, 'force', 'of the support on the body, at supported directions', fill_reaction)
      call describe(fields(3), 'stress', 6, 'stress', 'tension positive; XX YY ZZ XY YZ XZ; as the criterion uses it', &
                    fill_node_stress)
      call describe(fields(4), 'sigma1', 1, 'stress', 'compression positive; larger principal stress in the plane', fill_sigma1)
      call describe(fields(5), 'sigma3', 1, 'stress', 'compression positive; smaller principal stress in the plane', fill_sigma3)
      call describe(fields(6), 'utilisation', 1, '-', 'fails at 1', fill_utilisation)
      fields(6)%present_when = with_fracture
      call describe(fields(7), 'node_id', 1, '-', 'the deck''s id; new nodes count on', fill_node_id)
      call describe(fields(8), 'node_origin', 1, '-', 'deck id of the node it is a copy of; 0: a midpoint', fill_node_origin)
      fields(7:8)%whole = .true.
      call describe(fields(9), 'velocity', 3, 'length/time', 'along x, y, z; zero in static steps', fill_velocity)
      fields(9)%present_when = with_dynamics
   end subroutine point_fields

   !> Fields in the elements.
   subroutine cell_fields(fields)
      type(field_t), allocatable, intent(out) :: fields(:)
      allocate (fields(7))
      call describe(fields(1), 'stress', 6, 'stress', 'tension positive; XX YY ZZ XY YZ XZ', fill_element_stress)
      call describe(fields(2), 'material', 1, '-', 'order of *MATERIAL', fill_material)
      call describe(fields(3), 'element_id', 1, '-', 'the deck''s id; new elements count on', fill_element_id)
      call describe(fields(4), 'element_origin', 1, '-', 'deck id of the ancestor', fill_element_origin)
      call describe(fields(5), 'split_level', 1, '-', 'how often an ancestor was bisected', fill_split_level)
      call describe(fields(6), 'fragment', 1, '-', 'piece of the body, from 1', fill_fragment)
      fields(2:6)%whole = .true.
      call describe(fields(7), 'strength_factor', 1, '-', 'scatter of tensile strength and cohesion', fill_strength_factor)
      fields(7)%present_when = with_fracture
   end subroutine cell_fields

   subroutine describe(field, name, components, unit, sign, fill)
      type(field_t), intent(inout) :: field
      character(len=*), intent(in) :: name
      integer, intent(in) :: components
      character(len=*), intent(in) :: unit, sign
      procedure(fill_interface) :: fill
      field%name = name
      field%components = components
      field%unit = unit
      field%sign = sign
      field%fill => fill
   end subroutine describe

   subroutine fill_displacement(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: n
      n = model%mesh%n_nodes
      values(1, :n) = model%motion%ux(:n)
      values(2, :n) = model%motion%uy(:n)
      values(3, :n) = 0
   end subroutine fill_displacement

   subroutine fill_velocity(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: n
      n = model%mesh%n_nodes
      values(1:2, :n) = model%dynamics%velocity(:, :n)
      values(3, :n) = 0
   end subroutine fill_velocity

   subroutine fill_reaction(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: n
      do n = 1, model%mesh%n_nodes
         values(1:2, n) = model%loads%at_support(model%reaction, n)
         values(3, n) = 0
      end do
   end subroutine fill_reaction

   !> Stress out of the plane follows from those in it. Under an initial stress, what that adds is recovered at the node as the
   !> stress in the plane is.
   subroutine fill_node_stress(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      type(patch_work_t) :: work
      real(wp), allocatable :: added(:, :)
      real(wp) :: at_node(3), strength(3)
      integer :: n, e
      do n = 1, model%mesh%n_nodes
         values(:, n) = six(model, model%mesh%element_of(n), model%failure%stress(:, n))
      end do
      if (.not. model%material%initial%given) return
      allocate (added(3, model%mesh%n_elements), source=0.0_wp)
      do e = 1, model%mesh%n_elements
         added(1, e) = model%material%out_of_plane(model%mesh%section(e), e, [0.0_wp, 0.0_wp, 0.0_wp])
      end do
      do n = 1, model%mesh%n_nodes
         associate (section => model%material%section(model%mesh%section(model%mesh%element_of(n))))
            call node_stress(model%mesh, model%material, added, strength_t(), n, section%material, .true., work, at_node, &
                             strength)
            values(3, n) = at_node(1) + section%law%out_of_plane*sum(model%failure%stress(1:2, n))
         end associate
      end do
   end subroutine fill_node_stress

   pure function six(model, element, stress) result(all)
      type(model_t), intent(in) :: model
      integer, intent(in) :: element
      real(wp), intent(in) :: stress(3)
      real(wp) :: all(6)
      all = [stress(1), stress(2), model%material%out_of_plane(model%mesh%section(element), element, stress), stress(3), &
             0.0_wp, 0.0_wp]
   end function six

   subroutine fill_sigma1(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      real(wp) :: s3
      integer :: n
      do n = 1, model%mesh%n_nodes
         call principal(model%failure%stress(:, n), values(1, n), s3)
      end do
   end subroutine fill_sigma1

   subroutine fill_sigma3(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      real(wp) :: s1
      integer :: n
      do n = 1, model%mesh%n_nodes
         call principal(model%failure%stress(:, n), s1, values(1, n))
      end do
   end subroutine fill_sigma3

   subroutine fill_utilisation(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_nodes) = model%failure%utilisation(:model%mesh%n_nodes)
   end subroutine fill_utilisation

   subroutine fill_node_id(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_nodes) = model%mesh%node_id(:model%mesh%n_nodes)
   end subroutine fill_node_id

   subroutine fill_node_origin(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_nodes) = model%mesh%node_origins()
   end subroutine fill_node_origin

   subroutine fill_element_stress(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: e
      do e = 1, model%mesh%n_elements
         values(:, e) = six(model, e, model%failure%element_stress(:, e))
      end do
   end subroutine fill_element_stress

   subroutine fill_material(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: e
      do e = 1, model%mesh%n_elements
         values(1, e) = model%material%section(model%mesh%section(e))%material
      end do
   end subroutine fill_material

   subroutine fill_element_id(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_elements) = model%mesh%element_id(:model%mesh%n_elements)
   end subroutine fill_element_id

   subroutine fill_element_origin(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_elements) = model%mesh%element_origins()
   end subroutine fill_element_origin

   subroutine fill_split_level(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      values(1, :model%mesh%n_elements) = model%mesh%split_level(:model%mesh%n_elements)
   end subroutine fill_split_level

   subroutine fill_fragment(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: e
      do e = 1, model%mesh%n_elements
         values(1, e) = model%pieces%of_node(model%mesh%connectivity(1, e))
      end do
   end subroutine fill_fragment

   subroutine fill_strength_factor(model, values)
      type(model_t), intent(in) :: model
      real(wp), intent(inout) :: values(:, :)
      integer :: e
      do e = 1, model%mesh%n_elements
         values(1, e) = model%material%strength_of(e)
      end do
   end subroutine fill_strength_factor

end module rf_fields
