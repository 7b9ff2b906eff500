!> Stresses of all elements in one pass: what the failure criterion and the output look at.
module rf_stress_k
   use rf_kinds, only: wp
   implicit none
   private
   public :: element_stresses, spread_largest

contains

   !> Stresses xx, yy, xy of constant strain triangles, tension positive (theory: eqs. 1 to 3).
   pure subroutine element_stresses(n, connectivity, x, ux, uy, section, direct, lateral, shear, factor, stress)
      !> elements
      integer, intent(in) :: n
      !> nodes, (3, elements)
      integer, intent(in) :: connectivity(3, n)
      !> coordinates [length], (2, nodes)
      real(wp), intent(in) :: x(2, *)
      !> displacements [length], (nodes)
      real(wp), intent(in) :: ux(*), uy(*)
      !> section of each element
      integer, intent(in) :: section(n)
      !> plane elasticity of each section [stress]
      real(wp), intent(in) :: direct(*), lateral(*), shear(*)
      !> factor of stiffness of each element [-]
      real(wp), intent(in) :: factor(n)
      !> [stress], (3, elements)
      real(wp), intent(inout) :: stress(3, n)
      real(wp) :: ax, ay, bx, by, aux, auy, bux, buy, scale, exx, eyy, gxy
      integer :: e, i, j, k, s
      !$omp simd private(i, j, k, s, ax, ay, bx, by, aux, auy, bux, buy, scale, exx, eyy, gxy)
      do e = 1, n
         i = connectivity(1, e)
         j = connectivity(2, e)
         k = connectivity(3, e)
         ax = x(1, j) - x(1, i)
         ay = x(2, j) - x(2, i)
         bx = x(1, k) - x(1, i)
         by = x(2, k) - x(2, i)
         aux = ux(j) - ux(i)
         auy = uy(j) - uy(i)
         bux = ux(k) - ux(i)
         buy = uy(k) - uy(i)
         s = section(e)
         scale = factor(e)/(ax*by - ay*bx)
         exx = (by*aux - ay*bux)*scale
         eyy = (ax*buy - bx*auy)*scale
         gxy = (ax*bux - bx*aux + by*auy - ay*buy)*scale
         stress(1, e) = direct(s)*exx + lateral(s)*eyy
         stress(2, e) = lateral(s)*exx + direct(s)*eyy
         stress(3, e) = shear(s)*gxy
      end do
   end subroutine element_stresses

   !> Largest value of the elements within two rings of each node.
   subroutine spread_largest(n_elements, n_nodes, connectivity, value, at_node)
      integer, intent(in) :: n_elements, n_nodes
      integer, intent(in) :: connectivity(:, :)
      !> value of each element, (elements)
      real(wp), intent(in) :: value(:)
      !> largest value of the node's elements and of all that share a node with them, (nodes)
      real(wp), intent(inout) :: at_node(:)
      real(wp), allocatable :: ring(:)
      real(wp) :: largest
      integer :: e, k
      allocate (ring(n_nodes))
      ring = -huge(1.0_wp)
      do e = 1, n_elements
         do k = 1, 3
            ring(connectivity(k, e)) = max(ring(connectivity(k, e)), value(e))
         end do
      end do
      at_node(:n_nodes) = ring
      do e = 1, n_elements
         largest = max(ring(connectivity(1, e)), ring(connectivity(2, e)), ring(connectivity(3, e)))
         do k = 1, 3
            at_node(connectivity(k, e)) = max(at_node(connectivity(k, e)), largest)
         end do
      end do
   end subroutine spread_largest

end module rf_stress_k
