!> The constant strain triangle: gradients of the shape functions, strain, stress, stiffness (theory: eqs. 1 to 5).
!> Small strains; nodes counter-clockwise; stresses tension-positive in the order xx, yy, xy.
module rf_cst
   use rf_kinds, only: wp
   implicit none
   private
   public :: elasticity_t, elasticity, gradients, strain, stress, stiffness_block, stiffness_skew, corner_forces

   !> Isotropic elasticity of a section, reduced to the plane.
   type :: elasticity_t
      !> sigma_xx = direct eps_xx + lateral eps_yy; sigma_xy = shear gamma_xy [stress]
      real(wp) :: direct = 0, lateral = 0, shear = 0
      !> sigma_zz = out_of_plane (sigma_xx + sigma_yy): Poisson's ratio in plane strain, 0 in plane stress [-]
      real(wp) :: out_of_plane = 0
   end type elasticity_t

contains

   !> Plane elasticity of an isotropic material.
   pure function elasticity(young, poisson, plane_strain) result(law)
      !> Young's modulus [stress], Poisson's ratio [-]
      real(wp), intent(in) :: young, poisson
      !> plane strain, else plane stress
      logical, intent(in) :: plane_strain
      type(elasticity_t) :: law
      law%shear = young/(2*(1 + poisson))
      if (plane_strain) then
         law%direct = young*(1 - poisson)/((1 + poisson)*(1 - 2*poisson))
         law%lateral = young*poisson/((1 + poisson)*(1 - 2*poisson))
         law%out_of_plane = poisson
      else
         law%direct = young/(1 - poisson**2)
         law%lateral = poisson*law%direct
      end if
   end function elasticity

   !> Gradients of the three shape functions, (d/dx, d/dy) of each [1/length], and the area [length^2].
   pure subroutine gradients(x, gradient, area)
      !> corners [length], (2, 3)
      real(wp), intent(in) :: x(2, 3)
      real(wp), intent(out) :: gradient(2, 3)
      real(wp), intent(out) :: area
      area = 0.5_wp*((x(1, 2) - x(1, 1))*(x(2, 3) - x(2, 1)) - (x(2, 2) - x(2, 1))*(x(1, 3) - x(1, 1)))
      gradient(1, :) = [x(2, 2) - x(2, 3), x(2, 3) - x(2, 1), x(2, 1) - x(2, 2)]/(2*area)
      gradient(2, :) = [x(1, 3) - x(1, 2), x(1, 1) - x(1, 3), x(1, 2) - x(1, 1)]/(2*area)
   end subroutine gradients

   !> Strains eps_xx, eps_yy, gamma_xy of an element; differences to the first corner, so that a translation gives zero.
   pure function strain(gradient, u) result(eps)
      real(wp), intent(in) :: gradient(2, 3)
      !> displacements of the corners [length], (2, 3)
      real(wp), intent(in) :: u(2, 3)
      real(wp) :: eps(3)
      real(wp) :: d(2, 2)
      d(:, 1) = u(:, 2) - u(:, 1)
      d(:, 2) = u(:, 3) - u(:, 1)
      eps(1) = gradient(1, 2)*d(1, 1) + gradient(1, 3)*d(1, 2)
      eps(2) = gradient(2, 2)*d(2, 1) + gradient(2, 3)*d(2, 2)
      eps(3) = gradient(2, 2)*d(1, 1) + gradient(2, 3)*d(1, 2) + gradient(1, 2)*d(2, 1) + gradient(1, 3)*d(2, 2)
   end function strain

   !> Stresses xx, yy, xy [stress].
   pure function stress(law, eps) result(sigma)
      type(elasticity_t), intent(in) :: law
      real(wp), intent(in) :: eps(3)
      real(wp) :: sigma(3)
      sigma(1) = law%direct*eps(1) + law%lateral*eps(2)
      sigma(2) = law%lateral*eps(1) + law%direct*eps(2)
      sigma(3) = law%shear*eps(3)
   end function stress

   !> Stiffness between two corners: force on i per displacement of j [force/length], without thickness and area.
   pure function stiffness_block(law, gi, gj) result(k)
      type(elasticity_t), intent(in) :: law
      !> gradients of the two corners' shape functions [1/length]
      real(wp), intent(in) :: gi(2), gj(2)
      real(wp) :: k(2, 2)
      k(1, 1) = law%direct*gi(1)*gj(1) + law%shear*gi(2)*gj(2)
      k(1, 2) = law%lateral*gi(1)*gj(2) + law%shear*gi(2)*gj(1)
      k(2, 1) = law%lateral*gi(2)*gj(1) + law%shear*gi(1)*gj(2)
      k(2, 2) = law%direct*gi(2)*gj(2) + law%shear*gi(1)*gj(1)
   end function stiffness_block

   !> Half of xy - yx of the stiffness between a corner and the next one, counter-clockwise, without thickness [stress]: the
   !> same whatever the triangle's shape; between a corner and the one before it the opposite (theory: eq. 5a).
   pure real(wp) function stiffness_skew(law)
      type(elasticity_t), intent(in) :: law
      stiffness_skew = 0.25_wp*(law%lateral - law%shear)
   end function stiffness_skew

   !> Forces on the three corners that hold a stress: f = t A B^T sigma [force], (2, 3).
   pure function corner_forces(gradient, volume, sigma) result(f)
      real(wp), intent(in) :: gradient(2, 3)
      !> area times thickness [length^3]
      real(wp), intent(in) :: volume
      real(wp), intent(in) :: sigma(3)
      real(wp) :: f(2, 3)
      f(1, :) = volume*(gradient(1, :)*sigma(1) + gradient(2, :)*sigma(3))
      f(2, :) = volume*(gradient(2, :)*sigma(2) + gradient(1, :)*sigma(3))
   end function corner_forces

end module rf_cst
