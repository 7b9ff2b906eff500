!> Mohr-Coulomb with the usual tension cut-off: the larger of both shares decides mode and direction.
module rf_criterion_cutoff
   use rf_kinds, only: wp, i1
   use rf_criterion, only: criterion_t, shares, mode_tension, mode_shear
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
      real(wp), intent(in), contiguous :: stress(:, :), strength(:, :)
      real(wp), intent(inout) :: f(:)
      integer(i1), intent(inout) :: mode(:)
      real(wp) :: s1(n), s3(n), tension(n), shear(n)
      logical :: torn
      integer :: i
      associate (unused => self)
      end associate
      call shares(n, stress, strength, s1, s3, tension, shear)
      do i = 1, n
         torn = s1(i) <= 0 .and. tension(i) > 1 .and. shear(i) > 1
         mode(i) = merge(mode_tension, mode_shear, torn .or. tension(i) >= shear(i))
         f(i) = max(tension(i), shear(i))
      end do
   end subroutine utilisation

end module rf_criterion_cutoff
