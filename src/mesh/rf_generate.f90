!> Meshes of a rectangle in four patterns (deck.md, `*MESH`). Plain arguments, ids 1 to n in both arrays' order.
!>
!> DIAGONAL, ALTERNATING and CROSS cut nx by ny cells; their node (i, j), counted from 0, is number 1 + i + j (nx + 1),
!> the centres of CROSS come after them. STAGGERED is a lattice of near-equilateral triangles whose sides are about
!> as long as those of the cells, row by row from the lower left: an even number of rows, so that it is its own mirror
!> image both ways; every second row is shifted by half a side and has its ends on the box.
module rf_generate
   use rf_kinds, only: wp, i8
   use rf_random, only: uniform
   implicit none
   private
   public :: generate, mesh_counts, largest_jitter, staggered_jitter
   public :: side_left, side_right, side_bottom, side_top

   !> bits of a node's sides
   integer, parameter :: side_left = 0, side_right = 1, side_bottom = 2, side_top = 3
   !> more cells in a row count as so many: that is more than a mesh can have, and products of counts stay in 64 bits
   integer, parameter :: most_cells = 1000000000
   !> from half a side on neighbours could change places
   real(wp), parameter :: largest_jitter = 0.5_wp
   !> a triangle keeps at least this part of its area: nodes of one that would lose more are moved half as far
   real(wp), parameter :: least_area = 0.25_wp
   !> default of STAGGERED: irregular enough to have no preferred direction, smallest angles above 25 degrees
   real(wp), parameter :: staggered_jitter = 0.15_wp
   !> where the first inner node of a shifted row stands [sides]: in the middle, 1/2, the triangles at the box would
   !> have 30 degrees, here 37
   real(wp), parameter :: first_shifted = 2.0_wp/3.0_wp
   !> height of the equilateral triangle of side 1
   real(wp), parameter :: equilateral_height = 0.5_wp*sqrt(3.0_wp)

contains

   !> Numbers of nodes and elements of a mesh, in 64 bits: they may be more than a mesh can have.
   pure subroutine mesh_counts(pattern, width, height, nx, ny, n_nodes, n_elements)
      !> DIAGONAL, ALTERNATING, CROSS or STAGGERED
      character(len=*), intent(in) :: pattern
      !> size of the rectangle [length]
      real(wp), intent(in) :: width, height
      !> cells across and up
      integer, intent(in) :: nx, ny
      !> nodes and elements that the mesh has
      integer(i8), intent(out) :: n_nodes, n_elements
      integer(i8) :: columns, rows
      columns = min(nx, most_cells); rows = min(ny, most_cells)
      if (pattern == 'STAGGERED') call staggered_counts(width, height, nx, ny, columns, rows)
      n_nodes = (columns + 1)*(rows + 1)
      n_elements = 2*columns*rows
      if (pattern == 'STAGGERED') then
         n_nodes = n_nodes + rows/2
         n_elements = n_elements + rows
      else if (pattern == 'CROSS') then
         n_nodes = n_nodes + columns*rows
         n_elements = 2*n_elements
      end if
   end subroutine mesh_counts

   !> Build a mesh. The counts must have been found to fit (mesh_counts).
   pure subroutine generate(pattern, corner, lengths, cells, jitter, seed, x, connectivity, sides)
      !> DIAGONAL, ALTERNATING, CROSS or STAGGERED
      character(len=*), intent(in) :: pattern
      !> lower left corner; width and height [length]
      real(wp), intent(in) :: corner(2), lengths(2)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> how far inner nodes are moved at most [side of a cell or of a staggered triangle], 0 to largest_jitter
      real(wp), intent(in) :: jitter
      !> of the random directions
      integer, intent(in) :: seed
      !> coordinates [length], (2, nodes)
      real(wp), allocatable, intent(out) :: x(:, :)
      !> node numbers counter-clockwise, (3, elements)
      integer, allocatable, intent(out) :: connectivity(:, :)
      !> bits side_left to side_top: the node lies on that side of the rectangle, (nodes)
      integer, allocatable, intent(out) :: sides(:)
      integer(i8) :: n_nodes, n_elements, counts(2)
      call mesh_counts(pattern, lengths(1), lengths(2), cells(1), cells(2), n_nodes, n_elements)
      allocate (x(2, n_nodes), connectivity(3, n_elements), sides(n_nodes))
      counts = cells
      select case (pattern)
      case ('STAGGERED')
         call staggered_counts(lengths(1), lengths(2), cells(1), cells(2), counts(1), counts(2))
         call staggered_nodes(corner, lengths, int(counts), x, sides)
         call staggered_elements(int(counts), connectivity)
      case ('CROSS')
         call grid_nodes(corner, lengths, cells, x, sides)
         call cross_centres(corner, lengths, cells, x, sides)
         call cross_elements(cells, connectivity)
      case default
         call grid_nodes(corner, lengths, cells, x, sides)
         call grid_elements(cells, pattern == 'ALTERNATING', connectivity)
      end select
      if (jitter > 0) call move_inner_nodes(jitter*shortest_side(pattern, lengths, int(counts)), seed, sides, connectivity, x)
   end subroutine generate

   !> Sides along a row and rows of the staggered lattice: near-equilateral triangles as large as the cells are, on
   !> the geometric mean, and at most as large as the rectangle.
   pure subroutine staggered_counts(width, height, nx, ny, columns, rows)
      !> size of the rectangle [length]
      real(wp), intent(in) :: width, height
      !> cells across and up
      integer, intent(in) :: nx, ny
      !> sides along an unshifted row; rows of triangles (even)
      integer(i8), intent(out) :: columns, rows
      real(wp) :: side
      side = min(sqrt(width/nx)*sqrt(height/ny), width, height)
      columns = max(1, nint(min(width/side, real(most_cells, wp))))
      rows = 2*max(1, nint(min(height/(2*equilateral_height*side), 0.5_wp*most_cells)))
   end subroutine staggered_counts

   !> Shorter side of a cell, or of the staggered lattice's triangle.
   pure real(wp) function shortest_side(pattern, lengths, counts)
      !> the pattern
      character(len=*), intent(in) :: pattern
      !> width and height [length]
      real(wp), intent(in) :: lengths(2)
      !> cells, or columns and rows of the staggered lattice
      integer, intent(in) :: counts(2)
      real(wp) :: spacing(2)
      spacing = lengths/counts
      if (pattern == 'STAGGERED') spacing(2) = spacing(2)/equilateral_height
      shortest_side = minval(spacing)
   end function shortest_side

   !> Nodes of the grid.
   pure subroutine grid_nodes(corner, lengths, cells, x, sides)
      !> lower left corner; width and height [length]
      real(wp), intent(in) :: corner(2), lengths(2)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> coordinates and sides of the nodes
      real(wp), intent(inout) :: x(:, :)
      integer, intent(inout) :: sides(:)
      integer :: i, j, node
      do j = 0, cells(2)
         do i = 0, cells(1)
            node = 1 + i + j*(cells(1) + 1)
            x(1, node) = corner(1) + lengths(1)*(real(i, wp)/cells(1))
            x(2, node) = corner(2) + lengths(2)*(real(j, wp)/cells(2))
            sides(node) = side_bits(i, cells(1), j, cells(2))
         end do
      end do
   end subroutine grid_nodes

   !> The sides of the rectangle that the node (i, j) lies on.
   pure integer function side_bits(i, last_i, j, last_j)
      !> place of the node in its row, from 0, and the last place
      integer, intent(in) :: i, last_i
      !> its row, from 0, and the last row
      integer, intent(in) :: j, last_j
      side_bits = 0
      if (i == 0) side_bits = ibset(side_bits, side_left)
      if (i == last_i) side_bits = ibset(side_bits, side_right)
      if (j == 0) side_bits = ibset(side_bits, side_bottom)
      if (j == last_j) side_bits = ibset(side_bits, side_top)
   end function side_bits

   !> Two triangles a cell. The diagonal goes from lower left to upper right, or every second time across that.
   pure subroutine grid_elements(cells, alternating, connectivity)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> the diagonal changes from cell to cell
      logical, intent(in) :: alternating
      !> node numbers, (3, elements)
      integer, intent(inout) :: connectivity(:, :)
      integer :: i, j, element, a, b, c, d
      element = 0
      do j = 0, cells(2) - 1
         do i = 0, cells(1) - 1
            call corners(cells, i, j, a, b, c, d)
            if (alternating .and. mod(i + j, 2) == 1) then
               connectivity(:, element + 1) = [a, b, d]
               connectivity(:, element + 2) = [b, c, d]
            else
               connectivity(:, element + 1) = [a, b, c]
               connectivity(:, element + 2) = [a, c, d]
            end if
            element = element + 2
         end do
      end do
   end subroutine grid_elements

   !> The corners of cell (i, j), counter-clockwise from the lower left.
   pure subroutine corners(cells, i, j, a, b, c, d)
      !> cells across and up; the cell, from 0
      integer, intent(in) :: cells(2), i, j
      !> the corner nodes
      integer, intent(out) :: a, b, c, d
      a = 1 + i + j*(cells(1) + 1)
      b = a + 1
      d = a + cells(1) + 1
      c = d + 1
   end subroutine corners

   !> The centre nodes of CROSS, after those of the grid.
   pure subroutine cross_centres(corner, lengths, cells, x, sides)
      !> lower left corner; width and height [length]
      real(wp), intent(in) :: corner(2), lengths(2)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> coordinates and sides of the nodes
      real(wp), intent(inout) :: x(:, :)
      integer, intent(inout) :: sides(:)
      integer :: i, j, node
      node = (cells(1) + 1)*(cells(2) + 1)
      do j = 0, cells(2) - 1
         do i = 0, cells(1) - 1
            node = node + 1
            x(1, node) = corner(1) + lengths(1)*((i + 0.5_wp)/cells(1))
            x(2, node) = corner(2) + lengths(2)*((j + 0.5_wp)/cells(2))
            sides(node) = 0
         end do
      end do
   end subroutine cross_centres

   !> Four triangles a cell: below, right of, above and left of its centre.
   pure subroutine cross_elements(cells, connectivity)
      !> cells across and up
      integer, intent(in) :: cells(2)
      !> node numbers, (3, elements)
      integer, intent(inout) :: connectivity(:, :)
      integer :: i, j, element, centre, a, b, c, d
      element = 0
      centre = (cells(1) + 1)*(cells(2) + 1)
      do j = 0, cells(2) - 1
         do i = 0, cells(1) - 1
            call corners(cells, i, j, a, b, c, d)
            centre = centre + 1
            connectivity(:, element + 1) = [a, b, centre]
            connectivity(:, element + 2) = [b, c, centre]
            connectivity(:, element + 3) = [c, d, centre]
            connectivity(:, element + 4) = [d, a, centre]
            element = element + 4
         end do
      end do
   end subroutine cross_elements

   !> Nodes of the staggered lattice: rows of columns + 1 nodes and, shifted, of columns + 2 in turn.
   pure subroutine staggered_nodes(corner, lengths, counts, x, sides)
      !> lower left corner; width and height [length]
      real(wp), intent(in) :: corner(2), lengths(2)
      !> columns and rows
      integer, intent(in) :: counts(2)
      !> coordinates and sides of the nodes
      real(wp), intent(inout) :: x(:, :)
      integer, intent(inout) :: sides(:)
      integer :: i, j, node, last
      node = 0
      do j = 0, counts(2)
         last = counts(1) + mod(j, 2)
         do i = 0, last
            node = node + 1
            x(1, node) = corner(1) + lengths(1)*(place_in_row(i, counts(1), shifted=mod(j, 2) == 1)/counts(1))
            x(2, node) = corner(2) + lengths(2)*(real(j, wp)/counts(2))
            sides(node) = side_bits(i, last, j, counts(2))
         end do
      end do
   end subroutine staggered_nodes

   !> Where the i-th node of a row stands [sides], 0 to columns.
   pure real(wp) function place_in_row(i, columns, shifted) result(place)
      !> the node, from 0; sides along an unshifted row
      integer, intent(in) :: i, columns
      !> a row shifted by half a side
      logical, intent(in) :: shifted
      place = i
      if (.not. shifted) return
      place = i - 0.5_wp
      if (i == 1) place = first_shifted
      if (i == columns) place = columns - first_shifted
      if (columns == 1) place = 0.5_wp
      if (i == 0) place = 0
      if (i == columns + 1) place = columns
   end function place_in_row

   !> Elements of the staggered lattice, row by row, from left to right.
   pure subroutine staggered_elements(counts, connectivity)
      !> columns and rows
      integer, intent(in) :: counts(2)
      !> node numbers, (3, elements)
      integer, intent(inout) :: connectivity(:, :)
      integer :: i, j, element, straight, shifted
      element = 0
      straight = 1
      do j = 0, counts(2) - 1
         shifted = straight + counts(1) + 1 ! first nodes of the shifted row and the straight one under or over it
         if (mod(j, 2) == 1) straight = shifted + counts(1) + 2
         do i = 0, counts(1)
            connectivity(:, element + 1) = facing([straight + i, shifted + i + 1, shifted + i], upward=mod(j, 2) == 0)
            element = element + 1
            if (i == counts(1)) cycle
            connectivity(:, element + 1) = facing([straight + i, straight + i + 1, shifted + i + 1], upward=mod(j, 2) == 0)
            element = element + 1
         end do
      end do
   end subroutine staggered_elements

   !> A triangle as given, or its mirror image's node order, from its second node on.
   pure function facing(nodes, upward)
      !> counter-clockwise if the shifted row is the upper one
      integer, intent(in) :: nodes(3)
      !> the shifted row is the upper one
      logical, intent(in) :: upward
      integer :: facing(3)
      facing = nodes
      if (.not. upward) facing = nodes([1, 3, 2])
   end function facing

   !> Move each inner node to a random place in the circle round it. Only sums and products, so that the places are
   !> the same on any machine: draws from the square round the circle until one lies in it.
   pure subroutine move_inner_nodes(radius, seed, sides, connectivity, x)
      !> of the circle [length]
      real(wp), intent(in) :: radius
      !> of the draws; a node's number names its own
      integer, intent(in) :: seed
      !> bits of the sides; a node on none is an inner one
      integer, intent(in) :: sides(:)
      !> node numbers, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> coordinates [length], (2, nodes)
      real(wp), intent(inout) :: x(:, :)
      real(wp), allocatable :: move(:, :)
      real(wp) :: way(2)
      integer :: node, draw
      allocate (move(2, size(sides)))
      move = 0
      do node = 1, size(sides)
         if (sides(node) /= 0) cycle
         draw = 0
         do
            way(1) = 2*uniform(seed, node, draw) - 1
            way(2) = 2*uniform(seed, node, draw + 1) - 1
            if (sum(way**2) <= 1) exit
            draw = draw + 2
         end do
         move(:, node) = radius*way
      end do
      call shorten_moves(connectivity, x, move)
      x = x + move
   end subroutine move_inner_nodes

   !> Halve the moves of triangles that would lose too much of their area, until there are none.
   pure subroutine shorten_moves(connectivity, x, move)
      !> node numbers, (3, elements)
      integer, intent(in) :: connectivity(:, :)
      !> coordinates before the move [length], (2, nodes)
      real(wp), intent(in) :: x(:, :)
      !> moves [length], (2, nodes)
      real(wp), intent(inout) :: move(:, :)
      logical, allocatable :: too_far(:)
      real(wp) :: corner(2, 3), change(2, 3)
      integer :: e, node
      allocate (too_far(size(x, 2)))
      do
         too_far = .false.
         do e = 1, size(connectivity, 2)
            corner = x(:, connectivity(:, e))
            change = move(:, connectivity(:, e))
            if (double_area(corner + change) < least_area*double_area(corner)) too_far(connectivity(:, e)) = .true.
         end do
         if (.not. any(too_far)) exit
         do node = 1, size(too_far)
            if (too_far(node)) move(:, node) = 0.5_wp*move(:, node)
         end do
      end do
   end subroutine shorten_moves

   !> Twice the area of a triangle [length^2].
   pure real(wp) function double_area(corner)
      !> coordinates of its nodes [length]
      real(wp), intent(in) :: corner(2, 3)
      double_area = (corner(1, 2) - corner(1, 1))*(corner(2, 3) - corner(2, 1)) &
                    - (corner(2, 2) - corner(2, 1))*(corner(1, 3) - corner(1, 1))
   end function double_area
end module rf_generate
