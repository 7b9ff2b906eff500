!> Mohr-Coulomb with the usual tension cut-off: the larger of both shares decides mode and direction.
module rf_criterion_cutoff
   use rf_kinds, only: wp, i1
   use rf_criterion, only: criterion_t, principal, tension_share, shear_share, mode_tension, mode_shear
   implicit none
   private
   public :: cutoff_t

   type, extends(criterion_t) :: cutoff_t
   contains
      procedure :: utilisation
   end type cutoff_t

contains

   !> Utilisation and mode (theory: eq. 28). Where nothing is pressed (s1 <= 0) and both fail, tension decides.
   subroutine utilisation(self, n, stress, strength, f, mode)
      class(cutoff_t), intent(in) :: self
      integer, intent(in) :: n
      real(wp), intent(in) :: stress(:, :), strength(:, :)
      real(wp), intent(inout) :: f(:)
      integer(i1), intent(inout) :: mode(:)
      real(wp) :: s1, s3, tension, shear
      logical :: torn
      integer :: i
      associate (unused => self)
      end associate
      do i = 1, n
         call principal(stress(:, i), s1, s3)
         tension = tension_share(s3, strength(1, i))
         shear = shear_share(s1, s3, strength(2, i), strength(3, i))
         torn = s1 <= 0 .and. tension > 1 .and. shear > 1
         mode(i) = merge(mode_tension, mode_shear, torn .or. tension >= shear)
         f(i) = max(tension, shear)
      end do
   end subroutine utilisation

end module rf_criterion_cutoff
