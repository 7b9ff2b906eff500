!> Scatter of material values from element to element (*HETEROGENEITY): a factor of mean 1.
module rf_scatter
   use rf_kinds, only: wp
   use rf_random, only: normal, weibull
   implicit none
   private
   public :: scatter_t, scatter_none, scatter_weibull, scatter_normal, least_modulus, largest_deviation, least_factor

   !> distributions
   integer, parameter :: scatter_none = 0, scatter_weibull = 1, scatter_normal = 2
   !> bounds of the parameters: beyond them most elements would have next to no strength
   real(wp), parameter :: least_modulus = 1.0_wp, largest_deviation = 1.0_wp
   !> a draw below this factor is drawn anew: strength and stiffness must stay positive, and an element a hundred times
   !> softer than its neighbours is a hole. With NORMAL and a deviation of 0.3 that happens to one element in 2,000.
   real(wp), parameter :: least_factor = 0.01_wp
   !> draws of an element until the least factor is taken: with the bounds above one in 1e80 elements comes so far
   integer, parameter :: most_draws = 100
   !> stream of the first draw: others may draw for the same id with the same seed (rf_generate)
   integer, parameter :: first_stream = 1000

   type :: scatter_t
      integer :: kind = scatter_none
      integer :: seed = 1
      !> WEIBULL: modulus m; NORMAL: standard deviation [-]
      real(wp) :: parameter = 1
   contains
      procedure :: factor
   end type scatter_t

contains

   !> Factor of an element, a function of seed and id alone.
   !> WEIBULL: (-ln u)^(1/m)/Gamma(1 + 1/m), u uniform; NORMAL: 1 + s z, z standard normal.
   pure real(wp) function factor(self, id)
      class(scatter_t), intent(in) :: self
      !> the deck's id of the element
      integer, intent(in) :: id
      integer :: draw
      factor = 1
      if (self%kind == scatter_none) return
      do draw = first_stream, first_stream + most_draws - 1
         if (self%kind == scatter_weibull) factor = weibull(self%seed, id, draw, self%parameter)
         if (self%kind == scatter_normal) factor = 1 + self%parameter*normal(self%seed, id, draw)
         if (factor >= least_factor) return
      end do
      factor = least_factor
   end function factor
end module rf_scatter
