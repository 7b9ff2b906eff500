!> Stress at a node: a linear least-squares patch over two rings of the elements of its own fan, taken at the node. The
!> patch crosses neither cracks nor material borders. The area mean over the fan alone would be first order and
!> biased at a boundary; it serves where the patch is too small to fit, and at the tip of a crack: there the field is
!> singular and the crack itself lies in the patch, so that a plane through both flanks and what is ahead falls below the
!> stress of the nodes beyond, and a second crack would run beside the first (theory: section 6, eqs. 31 to 33).
module rf_recovery
   use rf_kinds, only: wp
   use rf_grow, only: grow
   use rf_mesh, only: mesh_t
   use rf_topology, only: elements_around, corner_of, is_corner, sort_ascending
   use rf_material, only: material_t
   use rf_criterion, only: strength_t, strengths
   implicit none
   private
   public :: patch_work_t, node_stress, materials_at_node

   !> elements from which a plane is fitted: three fix it, the others check it
   integer, parameter :: smallest_patch = 6
   !> smallest ratio of the patch's extents (smaller over larger second moment) for a fit
   real(wp), parameter :: flattest_patch = 0.02_wp
   !> how far outside the patch the node may lie, in squared standard deviations of its centroids: a node at a corner
   !> of two rings of equal elements has about 6
   real(wp), parameter :: farthest_squared = 12.0_wp

   !> Lists that a recovery works on; one per thread.
   type :: patch_work_t
      integer, allocatable :: fan(:), around(:), patch(:), corner(:)
      !> area of the patch's elements [length^2]; their centroids from the node [length]
      real(wp), allocatable :: area(:), centroid(:, :)
      integer :: n_fan = 0, n_patch = 0
      !> the node is the tip of a crack
      logical :: at_tip = .false.
   end type patch_work_t

contains

   !> Stress and strength at a node, from the elements of one material [stress].
   subroutine node_stress(mesh, material, element_stress, material_strength, node, which, fit, work, stress, strength)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> stresses of the elements, tension positive, (3, elements)
      real(wp), intent(in) :: element_stress(:, :)
      !> strength of the material
      type(strength_t), intent(in) :: material_strength
      integer, intent(in) :: node
      !> number of the material
      integer, intent(in) :: which
      !> take the patch where it can be fitted, else the mean over the fan
      logical, intent(in) :: fit
      type(patch_work_t), intent(inout) :: work
      real(wp), intent(out) :: stress(3), strength(3)
      real(wp) :: total, area, own(3, 1), factor(1), x(2)
      integer :: i, e
      call gather_patch(mesh, material, node, which, work)
      total = 0
      stress = 0
      strength = 0
      do i = 1, work%n_fan
         e = work%fan(i)
         call area_and_centroid(mesh, e, area, x)
         factor(1) = material%strength_of(e)
         call strengths(material_strength, factor, own)
         total = total + area
         stress = stress + area*element_stress(:, e)
         strength = strength + area*own(:, 1)
      end do
      stress = stress/total
      strength = strength/total
      if (fit .and. .not. work%at_tip) call fit_plane(mesh, element_stress, node, work, stress)
   end subroutine node_stress

   !> Materials that meet at a node, ascending.
   subroutine materials_at_node(mesh, material, node, work, list, n)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node
      type(patch_work_t), intent(inout) :: work
      integer, intent(out) :: list(:)
      integer, intent(out) :: n
      integer :: i, m, count
      n = 1
      list(1) = material%section(1)%material
      if (size(material%section) == 1) return
      call elements_around(mesh, node, work%around, count)
      n = 0
      do i = 1, count
         m = material%section(mesh%section(work%around(i)))%material
         if (n > 0) then
            if (any(list(:n) == m)) cycle
         end if
         if (n == size(list)) cycle
         n = n + 1
         list(n) = m
      end do
      call sort_ascending(list(:n))
   end subroutine materials_at_node

   !> The node's elements of one material, and those of the same material that share a node with them. Nodes are split
   !> where cracks have opened, so the patch does not reach across them.
   subroutine gather_patch(mesh, material, node, which, work)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      integer, intent(in) :: node, which
      type(patch_work_t), intent(inout) :: work
      integer :: n, i, j, k, corner, n_corners
      call elements_around(mesh, node, work%around, n)
      work%at_tip = is_tip(mesh, node, work%around(:n))
      work%n_patch = 0
      do i = 1, n
         call join(work%around(i))
      end do
      call sort_ascending(work%patch(:work%n_patch))     ! sums do not depend on where a walk began
      work%n_fan = work%n_patch
      call grow(work%fan, work%n_fan)
      work%fan(:work%n_fan) = work%patch(:work%n_fan)
      call grow(work%corner, 3*work%n_fan)
      n_corners = 0
      do i = 1, work%n_fan
         do k = 1, 3
            corner = mesh%connectivity(k, work%fan(i))
            if (corner == node .or. mesh%hinge(corner)) cycle      ! beyond a hinge is another part of the body
            do j = 1, n_corners
               if (work%corner(j) == corner) exit
            end do
            if (j <= n_corners) cycle
            n_corners = j
            work%corner(j) = corner
            call elements_around(mesh, corner, work%around, n)
            if (is_tip(mesh, corner, work%around(:n))) cycle      ! round it lies the other side of the crack
            do j = 1, n
               if (is_corner(mesh, work%around(j), node)) cycle      ! of the fan
               call join(work%around(j))
            end do
         end do
      end do
      call sort_ascending(work%patch(:work%n_patch))
      n = min(1, work%n_patch)
      do i = 2, work%n_patch
         if (work%patch(i) == work%patch(n)) cycle
         n = n + 1
         work%patch(n) = work%patch(i)
      end do
      work%n_patch = n

   contains

      !> Elements that are met again go when the list is sorted.
      subroutine join(element)
         integer, intent(in) :: element
         if (material%section(mesh%section(element))%material /= which) return
         work%n_patch = work%n_patch + 1
         if (.not. allocated(work%patch)) allocate (work%patch(64))
         if (work%n_patch > size(work%patch)) call grow(work%patch, work%n_patch)
         work%patch(work%n_patch) = element
      end subroutine join

   end subroutine gather_patch

   !> Whether a crack ends at a node: a cracked edge lies within its fan.
   pure logical function is_tip(mesh, node, around)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: node
      !> elements of the node
      integer, intent(in) :: around(:)
      integer :: i, k
      is_tip = .false.
      if (.not. allocated(mesh%segment)) return      ! nothing is cracked
      do i = 1, size(around)
         k = corner_of(mesh, around(i), node)
         if (mesh%segment_at(k, around(i)) > 0) is_tip = is_tip .or. is_corner(mesh, mesh%neighbour(k, around(i)), node)
      end do
   end function is_tip

   !> Replace the mean by the value at the node of the area-weighted plane through the patch's element stresses.
   subroutine fit_plane(mesh, element_stress, node, work, stress)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: element_stress(:, :)
      integer, intent(in) :: node
      type(patch_work_t), intent(inout) :: work
      real(wp), intent(inout) :: stress(3)
      real(wp) :: total, area, centre(2), mean(3), xx, xy, yy, by_x(3), by_y(3), above(3), offset(2), d(2), det, trace
      real(wp) :: solution(2)
      integer :: i, e
      if (work%n_patch < smallest_patch) return
      call grow(work%area, work%n_patch)
      call grow(work%centroid, work%n_patch, 2)
      total = 0; centre = 0; mean = 0
      do i = 1, work%n_patch
         e = work%patch(i)
         call area_and_centroid(mesh, e, area, d)
         d = d - mesh%x(:, node)
         work%area(i) = area
         work%centroid(:, i) = d
         total = total + area
         centre = centre + area*d
         mean = mean + area*element_stress(:, e)
      end do
      centre = centre/total
      mean = mean/total
      xx = 0; xy = 0; yy = 0; by_x = 0; by_y = 0
      do i = 1, work%n_patch
         area = work%area(i)/total
         d = work%centroid(:, i) - centre
         above = element_stress(:, work%patch(i)) - mean
         xx = xx + area*d(1)*d(1)
         xy = xy + area*d(1)*d(2)
         yy = yy + area*d(2)*d(2)
         by_x = by_x + area*d(1)*above
         by_y = by_y + area*d(2)*above
      end do
      det = xx*yy - xy*xy
      trace = xx + yy
      ! det/trace^2 lies between r/4 and r for the ratio r of the second moments
      if (det <= 0.5_wp*flattest_patch*trace**2) return
      offset = -centre
      solution = [(yy*offset(1) - xy*offset(2))/det, (xx*offset(2) - xy*offset(1))/det]
      if (dot_product(offset, solution) > farthest_squared) return
      stress = mean + by_x*solution(1) + by_y*solution(2)
   end subroutine fit_plane

   !> Area [length^2] and centroid [length] of a triangle.
   pure subroutine area_and_centroid(mesh, element, area, centroid)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp), intent(out) :: area, centroid(2)
      real(wp) :: first(2), second(2), third(2), a(2), b(2)
      first = mesh%x(:, mesh%connectivity(1, element))
      second = mesh%x(:, mesh%connectivity(2, element))
      third = mesh%x(:, mesh%connectivity(3, element))
      a = second - first
      b = third - first
      area = 0.5_wp*(a(1)*b(2) - a(2)*b(1))
      centroid = (first + second + third)/3
   end subroutine area_and_centroid

end module rf_recovery
