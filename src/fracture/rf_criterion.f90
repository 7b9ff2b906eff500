!> What every failure criterion provides. Here compression is positive and sigma1 >= sigma3 are the principal stresses
!> in the plane; stresses come in tension-positive as xx, yy, xy.
module rf_criterion
   use rf_kinds, only: wp, i1
   implicit none
   private
   public :: criterion_t, strength_t, strengths, shares, principal, tension_share, shear_share, rotated
   public :: mode_none, mode_tension, mode_shear, max_rays

   !> modes of failure
   integer(i1), parameter :: mode_none = 0_i1, mode_tension = 1_i1, mode_shear = 2_i1
   !> directions in which a node can break at most
   integer, parameter :: max_rays = 4

   !> Strength of a material as the deck gives it; a point's own strength is (tensile, cohesion, tan_friction).
   type :: strength_t
      !> tensile strength and cohesion [stress], tangent of the angle of internal friction [-]
      real(wp) :: tensile = 0, cohesion = 0, tan_friction = 0
      !> the material has *STRENGTH
      logical :: given = .false.
   end type strength_t

   type, abstract :: criterion_t
   contains
      !> utilisation and mode of many stresses
      procedure(utilisation_interface), deferred :: utilisation
      !> directions in which a crack may run from a failed point
      procedure :: directions
      !> bound of the utilisation of mixtures of these stresses
      procedure :: bound
   end type criterion_t

   abstract interface
      !> Utilisation F (failure at F >= 1) and mode of n points.
      subroutine utilisation_interface(self, n, stress, strength, f, mode)
         import :: criterion_t, wp, i1
         class(criterion_t), intent(in) :: self
         integer, intent(in) :: n
         !> xx, yy, xy, tension positive [stress], (3, n)
         real(wp), intent(in), contiguous :: stress(:, :)
         !> tensile strength, cohesion [stress], tangent of the friction angle [-], (3, n)
         real(wp), intent(in), contiguous :: strength(:, :)
         !> utilisation [-], (n)
         real(wp), intent(inout) :: f(:)
         !> mode that decides, (n)
         integer(i1), intent(inout) :: mode(:)
      end subroutine utilisation_interface
   end interface

contains

   !> Principal stresses in the plane, compression positive, s1 >= s3 [stress] (theory: eq. 24).
   pure subroutine principal(stress, s1, s3)
      !> xx, yy, xy, tension positive [stress]
      real(wp), intent(in) :: stress(3)
      real(wp), intent(out) :: s1, s3
      real(wp) :: centre, radius
      centre = -0.5_wp*(stress(1) + stress(2))
      radius = sqrt(0.25_wp*(stress(1) - stress(2))**2 + stress(3)**2)
      s1 = centre + radius
      s3 = centre - radius
   end subroutine principal

   !> F_t = -s3/sigma_t (theory: eq. 25).
   pure real(wp) function tension_share(s3, tensile)
      real(wp), intent(in) :: s3, tensile
      tension_share = -s3/tensile
   end function tension_share

   !> F_s = ((s1 - s3)/2)/(c cos phi + sin phi (s1 + s3)/2), 0 beyond the apex of the cone (theory: eq. 26).
   pure real(wp) function shear_share(s1, s3, cohesion, tan_friction)
      real(wp), intent(in) :: s1, s3, cohesion, tan_friction
      real(wp) :: cosine, bearing
      cosine = 1/sqrt(1 + tan_friction**2)
      bearing = cohesion*cosine + tan_friction*cosine*0.5_wp*(s1 + s3)
      shear_share = 0
      if (bearing > 0) shear_share = 0.5_wp*(s1 - s3)/bearing
   end function shear_share

   !> Strength of points: tensile strength, cohesion, tangent of the friction angle.
   pure subroutine strengths(strength, factor, values)
      type(strength_t), intent(in) :: strength
      !> scatter of each point's tensile strength and cohesion [-], (n)
      real(wp), intent(in) :: factor(:)
      !> (3, n)
      real(wp), intent(inout) :: values(:, :)
      integer :: i
      do i = 1, size(factor)
         values(1, i) = strength%tensile*factor(i)
         values(2, i) = strength%cohesion*factor(i)
         values(3, i) = strength%tan_friction
      end do
   end subroutine strengths

   !> Principal stresses and both shares of many points, in one loop that compilers make vectors of.
   pure subroutine shares(n, stress, strength, s1, s3, tension, shear)
      integer, intent(in) :: n
      !> as in utilisation
      real(wp), intent(in), contiguous :: stress(:, :), strength(:, :)
      !> principal stresses, compression positive [stress]; shares [-]
      real(wp), intent(out) :: s1(n), s3(n), tension(n), shear(n)
      integer :: i
      do i = 1, n
         call principal(stress(:, i), s1(i), s3(i))
         tension(i) = tension_share(s3(i), strength(1, i))
         shear(i) = shear_share(s1(i), s3(i), strength(2, i), strength(3, i))
      end do
   end subroutine shares

   !> Directions of failure: in tension both ways along the s1 axis, in shear the two conjugate planes at
   !> 45 - phi/2 degrees from it, both ways (theory: eq. 30).
   subroutine directions(self, stress, tan_friction, mode, ray, n)
      class(criterion_t), intent(in) :: self
      !> xx, yy, xy, tension positive [stress]
      real(wp), intent(in) :: stress(3)
      real(wp), intent(in) :: tan_friction
      integer(i1), intent(in) :: mode
      !> unit vectors, (2, max_rays)
      real(wp), intent(out) :: ray(2, max_rays)
      integer, intent(out) :: n
      real(wp) :: axis(2), angle
      associate (unused => self)
      end associate
      ray = 0
      ! the largest tension makes this angle with x; s1 (compression positive) is normal to it
      angle = 0.5_wp*atan2(2*stress(3), stress(1) - stress(2))
      axis = [-sin(angle), cos(angle)]
      if (mode == mode_tension) then
         n = 2
         ray(:, 1) = axis
      else
         n = 4
         angle = 0.5_wp*(0.5_wp*acos(-1.0_wp) - atan(tan_friction))
         ray(:, 1) = rotated(axis, angle)
         ray(:, 3) = rotated(axis, -angle)
         ray(:, 4) = -ray(:, 3)
      end if
      ray(:, 2) = -ray(:, 1)
   end subroutine directions

   !> What the screen takes for the utilisation of an element: a criterion whose branches jump has to give the larger of
   !> them, because the mean of stresses of one branch may lie in the other. Here: the utilisation.
   subroutine bound(self, n, stress, strength, limit)
      class(criterion_t), intent(in) :: self
      integer, intent(in) :: n
      !> as in utilisation
      real(wp), intent(in), contiguous :: stress(:, :), strength(:, :)
      !> (n)
      real(wp), intent(inout) :: limit(:)
      integer(i1) :: mode(n)
      call self%utilisation(n, stress, strength, limit, mode)
   end subroutine bound

   !> A vector turned by an angle [rad], counter-clockwise.
   pure function rotated(vector, angle) result(turned)
      real(wp), intent(in) :: vector(2), angle
      real(wp) :: turned(2)
      turned = [cos(angle)*vector(1) - sin(angle)*vector(2), sin(angle)*vector(1) + cos(angle)*vector(2)]
   end function rotated

end module rf_criterion
