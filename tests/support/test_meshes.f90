!> Small meshes for tests, made without a deck, and what tests ask of them.
module test_meshes
   use rf_kinds, only: wp, i1
   use rf_mesh, only: mesh_t
   use rf_topology, only: build_topology, is_corner, manifold_ok, changes_t
   use rf_generate, only: generate
   use rf_ordering, only: ordering_none
   use rf_mesh_assembly, only: raw_mesh_t, assemble, turn_clockwise
   use rf_material, only: material_t
   use rf_motion, only: motion_t
   use rf_cst, only: elasticity, gradients, strain, stress, corner_forces
   use rf_contact, only: contact_t
   use rf_ray, only: split_t
   use rf_invariants, only: baseline_t, take_baseline, check_invariants
   implicit none
   private
   public :: plain_mesh, rectangle, punched, cut_hole, uniform_material, plan_of, node_at, element_of_nodes, element_at
   public :: copies_at, n_pieces, check_changes, check_carried, check_pairs, totals_t, take_totals, smallest_angle
   public :: nodal_forces, check_forces

   !> what points that coincide may differ by, relative to the mesh's mean edge
   real(wp), parameter :: near = 1.0e-9_wp

   !> sums over the body that no split may change
   type :: totals_t
      real(wp) :: mass = 0, momentum(2) = 0
      !> sum of the magnitudes, for the tolerance
      real(wp) :: scale = 0
   end type totals_t

contains

   !> A mesh in the order given; triangles may be clockwise. Section 1 everywhere, room for 64 sets of each kind.
   subroutine plain_mesh(x, connectivity, mesh)
      real(wp), intent(in) :: x(:, :)
      integer, intent(in) :: connectivity(:, :)
      type(mesh_t), intent(out) :: mesh
      type(raw_mesh_t) :: raw
      integer, allocatable :: node_place(:), element_place(:)
      logical, allocatable :: turned(:)
      integer :: i, status, offenders(2)
      raw%n_nodes = size(x, 2)
      raw%n_elements = size(connectivity, 2)
      raw%x = x
      raw%connectivity = connectivity
      call turn_clockwise(raw, turned)
      call assemble(raw, [(i, i=1, raw%n_nodes)], [(i, i=1, raw%n_elements)], ordering_none, mesh, node_place, element_place)
      mesh%section(:mesh%n_elements) = 1
      mesh%last_node_id = raw%n_nodes
      mesh%last_element_id = raw%n_elements
      call build_topology(mesh, status, offenders)
      if (status /= manifold_ok) error stop 'plain_mesh: three elements on an edge'
   end subroutine plain_mesh

   !> A generated rectangle from the origin.
   subroutine rectangle(pattern, lengths, cells, jitter, seed, mesh)
      character(len=*), intent(in) :: pattern
      real(wp), intent(in) :: lengths(2), jitter
      integer, intent(in) :: cells(2), seed
      type(mesh_t), intent(out) :: mesh
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: connectivity(:, :), sides(:)
      call generate(pattern, [0.0_wp, 0.0_wp], lengths, cells, jitter, seed, x, connectivity, sides)
      call plain_mesh(x, connectivity, mesh)
   end subroutine rectangle

   !> A generated rectangle without the elements whose centroids lie in any of some circles (x, y, radius).
   subroutine punched(pattern, lengths, cells, jitter, seed, circle, mesh)
      character(len=*), intent(in) :: pattern
      real(wp), intent(in) :: lengths(2), jitter, circle(:, :)
      integer, intent(in) :: cells(2), seed
      type(mesh_t), intent(out) :: mesh
      real(wp), allocatable :: x(:, :)
      integer, allocatable :: connectivity(:, :), sides(:)
      integer :: i
      call generate(pattern, [0.0_wp, 0.0_wp], lengths, cells, jitter, seed, x, connectivity, sides)
      do i = 1, size(circle, 2)
         call cut_hole(x, connectivity, circle(:, i))
      end do
      call plain_mesh(x, connectivity, mesh)
   end subroutine punched

   !> Leave out the elements whose centroids lie in a circle; one element stays at least.
   subroutine cut_hole(x, connectivity, circle)
      real(wp), intent(in) :: x(:, :), circle(3)
      integer, allocatable, intent(inout) :: connectivity(:, :)
      integer, allocatable :: kept(:)
      integer :: e
      kept = [integer ::]
      do e = 1, size(connectivity, 2)
         if (norm2(sum(x(:, connectivity(:, e)), 2)/3 - circle(:2)) >= circle(3)) kept = [kept, e]
      end do
      if (size(kept) == 0) kept = [1]
      connectivity = connectivity(:, kept)
   end subroutine cut_hole

   !> One material and section: E 1, nu 0.25, thickness 2, friction 0.5, cohesion 3.
   subroutine uniform_material(mesh, material)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(out) :: material
      allocate (material%section(1))
      material%section(1)%law = elasticity(1.0_wp, 0.25_wp, .true.)
      material%section(1)%material = 1
      material%section(1)%thickness = 2
      material%section(1)%friction = 0.5_wp
      material%section(1)%cohesion = 3
      material%section(1)%density = 1
      call material%prepare(mesh%n_elements)
   end subroutine uniform_material

   !> A split as planned, for split_mesh.
   type(split_t) function plan_of(node, element, kind, corner, second_corner) result(split)
      integer, intent(in) :: node, element, kind
      integer, intent(in), optional :: corner, second_corner
      split%node = node
      split%element = element
      split%kind = kind
      split%mode = 1_i1
      if (present(corner)) split%corner = corner
      if (present(second_corner)) split%second_corner = second_corner
   end function plan_of

   !> The node nearest to a point; of copies the first.
   integer function node_at(mesh, x, y) result(node)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: x, y
      integer :: n
      node = 1
      do n = 2, mesh%n_nodes
         if (norm2(mesh%x(:, n) - [x, y]) < norm2(mesh%x(:, node) - [x, y])) node = n
      end do
   end function node_at

   !> How many nodes lie at a point.
   integer function copies_at(mesh, point)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: point(2)
      integer :: n
      copies_at = 0
      do n = 1, mesh%n_nodes
         if (norm2(mesh%x(:, n) - point) <= near*mesh%mean_edge) copies_at = copies_at + 1
      end do
   end function copies_at

   !> The element with three nodes, 0 if there is none.
   integer function element_of_nodes(mesh, a, b, c) result(element)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: a, b, c
      do element = mesh%n_elements, 1, -1
         if (is_corner(mesh, element, a) .and. is_corner(mesh, element, b) .and. is_corner(mesh, element, c)) return
      end do
   end function element_of_nodes

   !> The first element that a point lies in, 0 if there is none.
   integer function element_at(mesh, x, y) result(element)
      type(mesh_t), intent(in) :: mesh
      real(wp), intent(in) :: x, y
      real(wp) :: a(2), b(2)
      integer :: k
      do element = 1, mesh%n_elements
         do k = 1, 3
            a = mesh%x(:, mesh%connectivity(k, element))
            b = mesh%x(:, mesh%connectivity(mod(k, 3) + 1, element))
            if ((b(1) - a(1))*(y - a(2)) - (b(2) - a(2))*(x - a(1)) < 0) exit
         end do
         if (k > 3) return
      end do
      element = 0
   end function element_at

   !> Pieces that the body has: elements connected through common nodes.
   integer function n_pieces(mesh)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: label(:)
      integer :: e, low
      logical :: changed
      label = [(e, e=1, mesh%n_nodes)]
      changed = .true.
      do while (changed)
         changed = .false.
         do e = 1, mesh%n_elements
            low = minval(label(mesh%connectivity(:, e)))
            if (all(label(mesh%connectivity(:, e)) == low)) cycle
            label(mesh%connectivity(:, e)) = low
            changed = .true.
         end do
      end do
      n_pieces = count([(label(e) == e, e=1, mesh%n_nodes)])
   end function n_pieces

   !> Smallest angle of an element [rad].
   real(wp) function smallest_angle(mesh, element) result(angle)
      type(mesh_t), intent(in) :: mesh
      integer, intent(in) :: element
      real(wp) :: a(2), b(2)
      integer :: k
      angle = huge(1.0_wp)
      do k = 1, 3
         a = mesh%x(:, mesh%connectivity(mod(k, 3) + 1, element)) - mesh%x(:, mesh%connectivity(k, element))
         b = mesh%x(:, mesh%connectivity(mod(k + 1, 3) + 1, element)) - mesh%x(:, mesh%connectivity(k, element))
         angle = min(angle, acos(dot_product(a, b)/(norm2(a)*norm2(b))))
      end do
   end function smallest_angle

   !> The list of changes names every element that is new or has other nodes than before, and every new node.
   subroutine check_changes(before, mesh, changes, problem)
      !> the mesh before and after the split
      type(mesh_t), intent(in) :: before, mesh
      type(changes_t), intent(in) :: changes
      character(len=:), allocatable, intent(inout) :: problem
      integer :: e
      logical :: listed
      if (changes%n_nodes /= mesh%n_nodes - before%n_nodes) problem = 'the changes do not name all new nodes'
      if (changes%n_children /= mesh%n_elements - before%n_elements) problem = 'the changes do not name all children'
      do e = 1, mesh%n_elements
         listed = any(changes%element(:changes%n_elements) == e)
         if (e > before%n_elements) then
            if (.not. listed) problem = 'the changes do not name all new elements'
         else if (any(mesh%connectivity(:, e) /= before%connectivity(:, e)) .and. .not. listed) then
            problem = 'the changes do not name all changed elements'
         end if
      end do
   end subroutine check_changes

   !> Mass (an area's third at each corner) and momentum.
   type(totals_t) function take_totals(mesh, motion) result(totals)
      type(mesh_t), intent(in) :: mesh
      type(motion_t), intent(in) :: motion
      integer :: e, k, n
      real(wp) :: third
      do e = 1, mesh%n_elements
         third = mesh%area(e)/3
         do k = 1, 3
            n = mesh%connectivity(k, e)
            totals%mass = totals%mass + third
            totals%momentum = totals%momentum + third*[motion%vx(n), motion%vy(n)]
            totals%scale = totals%scale + third*(abs(motion%vx(n)) + abs(motion%vy(n)))
         end do
      end do
   end function take_totals

   !> Mass and momentum are kept to round-off; copies move as their node.
   subroutine check_carried(before, mesh, motion, changes, problem)
      !> sums before the split
      type(totals_t), intent(in) :: before
      type(mesh_t), intent(in) :: mesh
      type(motion_t), intent(in) :: motion
      type(changes_t), intent(in) :: changes
      character(len=:), allocatable, intent(inout) :: problem
      type(totals_t) :: now
      integer :: i, n, a
      now = take_totals(mesh, motion)
      if (abs(now%mass - before%mass) > 1.0e-12_wp*before%mass) problem = 'mass is not kept'
      if (norm2(now%momentum - before%momentum) > 1.0e-12_wp*before%scale) problem = 'momentum is not kept'
      do i = 1, changes%n_nodes
         if (changes%parent(2, i) /= 0) cycle
         n = changes%node(i)
         a = changes%parent(1, i)
         if (abs(motion%ux(n) - motion%ux(a)) + abs(motion%uy(n) - motion%uy(a)) > 0) problem = 'a copy is not where its node is'
      end do
   end subroutine check_carried

   !> Internal forces of all nodes [force], (2, nodes), element by element.
   function nodal_forces(mesh, material, motion) result(force)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      real(wp), allocatable :: force(:, :)
      real(wp) :: gradient(2, 3), area, sigma(3)
      integer :: e
      allocate (force(2, mesh%n_nodes), source=0.0_wp)
      do e = 1, mesh%n_elements
         associate (section => material%section(mesh%section(e)), corner => mesh%connectivity(:, e))
            call gradients(mesh%x(:, corner), gradient, area)
            sigma = material%stiffness_factor(e)*stress(section%law, strain(gradient, motion%corner_displacements(mesh, e)))
            force(:, corner) = force(:, corner) + corner_forces(gradient, area*section%thickness, sigma)
         end associate
      end do
   end function nodal_forces

   !> A split releases nothing by itself: with every new node tied to what it comes from, the forces are those before.
   subroutine check_forces(before, mesh, material, motion, changes, problem, jump)
      !> internal forces before the split [force], (2, nodes)
      real(wp), intent(in) :: before(:, :)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(motion_t), intent(in) :: motion
      type(changes_t), intent(in) :: changes
      character(len=:), allocatable, intent(inout) :: problem
      !> largest difference over the largest force
      real(wp), intent(out) :: jump
      real(wp), allocatable :: force(:, :)
      integer :: i, n, a, b
      force = nodal_forces(mesh, material, motion)
      do i = changes%n_nodes, 1, -1
         n = changes%node(i)
         a = changes%parent(1, i)
         b = changes%parent(2, i)
         if (b == 0) b = a
         force(:, a) = force(:, a) + 0.5_wp*force(:, n)
         force(:, b) = force(:, b) + 0.5_wp*force(:, n)
      end do
      n = size(before, 2)
      jump = maxval(abs(force(:, :n) - before))/maxval(abs(before))
      if (.not. jump <= 1.0e-10_wp) problem = 'forces are not continuous over the split'
   end subroutine check_forces

   !> The pairs are those that the cracked edges ask for, with their normals and areas, in groups that share no nodes.
   subroutine check_pairs(mesh, material, contact, problem)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      type(contact_t), intent(in) :: contact
      character(len=:), allocatable, intent(inout) :: problem
      real(wp), allocatable :: normal(:, :), area(:)
      integer, allocatable :: group_of_node(:)
      real(wp) :: along(2)
      integer :: e, k, other, back, i, p, q, g, mine(2), theirs(2)
      logical :: found(contact%n_pairs)
      allocate (normal(2, contact%n_pairs), area(contact%n_pairs), source=0.0_wp)
      normal = 0
      found = .false.
      do e = 1, mesh%n_elements
         do k = 1, 3
            other = mesh%neighbour(k, e)
            if (mesh%segment_at(k, e) == 0 .or. other < e) cycle
            back = mesh%edge_index(other, e)
            mine = mesh%connectivity([k, mod(k, 3) + 1], e)
            theirs = mesh%connectivity([mod(back, 3) + 1, back], other)
            along = mesh%x(:, mine(2)) - mesh%x(:, mine(1))
            do i = 1, 2
               if (mine(i) == theirs(i)) cycle
               p = contact%find_pair(mine(i), theirs(i))
               q = contact%find_pair(theirs(i), mine(i))
               if (p == 0 .or. p /= q) then
                  problem = 'a cracked edge has no pair'
                  return
               end if
               found(p) = .true.
               area(p) = area(p) + 0.5_wp*norm2(along)*material%section(mesh%section(e))%thickness
               normal(:, p) = normal(:, p) + merge(1, -1, contact%pair(1, p) == mine(i))*[along(2), -along(1)]
            end do
         end do
      end do
      if (.not. all(found)) problem = 'a pair without a cracked edge'
      allocate (group_of_node(mesh%n_nodes), source=0)
      do g = 1, contact%n_groups
         do p = contact%group_pair(g), contact%group_pair(g + 1) - 1
            if (abs(area(p) - contact%area(p)) > 1.0e-12_wp*area(p)) problem = 'a pair has the wrong area'
            if (norm2(normal(:, p)/norm2(normal(:, p)) - contact%normal(:, p)) > 1.0e-12_wp) problem = 'a normal is wrong'
            do i = 1, 2
               if (contact%node(contact%pair_node(i, p)) /= contact%pair(i, p)) problem = 'a contact node is not that of its pair'
               if (contact%pair_node(i, p) < contact%group_node(g) .or. contact%pair_node(i, p) >= contact%group_node(g + 1)) &
                  problem = 'a contact node is not in the group of its pair'
               if (all(group_of_node(contact%pair(i, p)) /= [0, g])) problem = 'two groups share a node'
               group_of_node(contact%pair(i, p)) = g
            end do
         end do
      end do
   end subroutine check_pairs

end module test_meshes
