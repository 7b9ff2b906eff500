!> The criterion of Qiu & Ding (2007), eq. 2: tension where sigma1 < -3 sigma3 (Griffith), Mohr-Coulomb elsewhere.
module rf_criterion_griffith
   use rf_kinds, only: wp, i1
   use rf_criterion, only: criterion_t, shares, mode_tension, mode_shear
   implicit none
   private
   public :: griffith_t, griffith_jump

   !> Griffith's border between the branches: s1 = -3 s3
   real(wp), parameter :: border = -3.0_wp

   type, extends(criterion_t) :: griffith_t
   contains
      procedure :: utilisation
      procedure :: bound
   end type griffith_t

contains

   !> Utilisation and mode (theory: eq. 27).
   subroutine utilisation(self, n, stress, strength, f, mode)
      class(griffith_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: stress(:, :), strength(:, :)
      real(wp), intent(inout) :: f(:)
      integer(i1), intent(inout) :: mode(:)
      real(wp) :: s1(n), s3(n), tension(n), shear(n)
      integer :: i
      associate (unused => self)
      end associate
      call shares(n, stress, strength, s1, s3, tension, shear)
      do i = 1, n
         if (s1(i) < border*s3(i)) then
            f(i) = tension(i)
            mode(i) = mode_tension
         else
            f(i) = shear(i)
            mode(i) = mode_shear
         end if
      end do
   end subroutine utilisation

   !> The larger of both branches, wherever the stress lies.
   subroutine bound(self, n, stress, strength, limit)
      class(griffith_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in), contiguous :: stress(:, :), strength(:, :)
      real(wp), intent(inout) :: limit(:)
      real(wp) :: s1(n), s3(n), tension(n), shear(n)
      associate (unused => self)
      end associate
      call shares(n, stress, strength, s1, s3, tension, shear)
      limit(:n) = max(tension, shear)
   end subroutine bound

   !> Tension -s3 at which shear fails on the border between the branches [stress]: the criterion jumps there to the
   !> tensile strength (theory: eq. 29).
   pure real(wp) function griffith_jump(cohesion, tan_friction)
      !> cohesion [stress], tangent of the friction angle [-]
      real(wp), intent(in) :: cohesion, tan_friction
      real(wp) :: cosine
      cosine = 1/sqrt(1 + tan_friction**2)
      griffith_jump = cohesion*cosine/(2 - tan_friction*cosine)
   end function griffith_jump

end module rf_criterion_griffith
