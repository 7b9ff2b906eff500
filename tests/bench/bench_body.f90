!> The bodies that the benchmark measures: beams of near-equilateral triangles, four times as long as high, held at their
!> left end and pulled at their right one, made without a deck.
module bench_body
   use rf_kinds, only: wp, i1, degree
   use rf_random, only: uniform
   use rf_mesh, only: mesh_t
   use rf_generate, only: generate, side_left, side_right
   use rf_ordering, only: ordering_none, ordering_hilbert, ordering_metis
   use rf_mesh_assembly, only: raw_mesh_t, assemble
   use rf_topology, only: build_topology, changes_t, crack_edge, refan_node, next_corner
   use rf_renumber, only: renumbering_t
   use rf_cst, only: elasticity
   use rf_criterion, only: strength_t
   use rf_criteria, only: make_criterion
   use rf_loads, only: load_definition_t, load_support, load_gravity
   use rf_model, only: model_t
   implicit none
   private
   public :: make_body, bend, side

   !> length and height of the beam
   real(wp), parameter :: lengths(2) = [4.0_wp, 1.0_wp]
   !> node sets of the two ends
   integer, parameter :: set_left = 1, set_right = 2
   !> closed cracks in every so many rows of nodes, one every so many sides: 9 of 12 nodes of such a row become two,
   !> which makes 10 % of all nodes contact nodes
   integer, parameter :: crack_rows = 14, crack_sides = 12
   !> displacement of the right end
   real(wp), parameter :: pull = 1.0e-4_wp
   real(wp), parameter :: row_height = 0.5_wp*sqrt(3.0_wp)
   !> crossing cracks: one cross in every rhombus of so many sides, of arms of so many, in a corner of such a part of the beam
   integer, parameter :: cross_sides = 8, arm_sides = 3
   real(wp), parameter :: corner_part(2) = [0.25_wp, 0.5_wp]

contains

   !> Edge length of a triangle of a beam of so many elements.
   pure real(wp) function side(elements)
      integer, intent(in) :: elements
      side = sqrt(lengths(1)*lengths(2)/(0.5_wp*row_height*elements))
   end function side

   !> A beam, ready to be relaxed.
   subroutine make_body(elements, ordering, cracks, model)
      !> about so many
      integer, intent(in) :: elements
      !> HILBERT, METIS, NONE (row by row) or SHUFFLED (nodes and elements in random order)
      character(len=*), intent(in) :: ordering
      !> closed ones: CRACKED (straight, everywhere), CROSSED (crossing each other, in one corner), else none; MIXED: none, but
      !> three materials at random; GRAINS: the same in grains of a dozen elements
      character(len=*), intent(in) :: cracks
      type(model_t), intent(inout) :: model
      type(load_definition_t) :: definition(3)
      type(renumbering_t) :: map
      logical :: replaced(load_gravity), cracked
      integer :: s
      cracked = cracks == 'CRACKED' .or. cracks == 'CROSSED'
      call make_mesh(elements, ordering, merge(0.0_wp, 0.15_wp, cracked), model)
      allocate (model%material%section(merge(3, 1, cracks == 'MIXED' .or. cracks == 'GRAINS')))
      do s = 1, size(model%material%section)
         associate (section => model%material%section(s))
            section%young = 27400*s
            section%poisson = 0.2_wp      ! at 0.25 in plane strain rows are symmetric everywhere
            section%law = elasticity(section%young, section%poisson, .true.)
            section%material = 1
            section%friction = 0.5_wp
         end associate
      end do
      if (cracks == 'MIXED') call mix_sections(model%mesh, 0.0_wp)
      if (cracks == 'GRAINS') call mix_sections(model%mesh, 2.5_wp*side(elements))

      allocate (model%failure%criterion(1))
      model%failure%strength = [strength_t(4.5_wp, 10.0_wp, tan(30*degree), .true.)]
      call make_criterion('GRIFFITH', model%failure%criterion(1))
      model%failure%settings%on = .true.
      call model%failure%prepare(model%mesh, model%material)
      if (cracked) then
         call cut_cracks(model, side(elements), cracks == 'CROSSED')
         call model%material%adopt(model%changes)
         call model%failure%adopt(model%mesh, model%changes)
      end if
      call model%prepare()
      if (model%has_grown(by_more_than=0)) call model%renumber(map)      ! as a run does
      definition(1) = load_definition_t(kind=load_support, set=set_left, first_dof=1, last_dof=2)
      definition(2) = load_definition_t(kind=load_support, set=set_right, first_dof=1, last_dof=1, value=-pull)
      definition(3) = load_definition_t(kind=load_support, set=set_right, first_dof=2, last_dof=2, value=-pull)
      replaced = .false.
      call model%loads%begin_step(model%mesh, definition, replaced, model%reaction, model%motion%ux, model%motion%uy)
      call model%loads%apply(model%mesh, model%material, 1.0_wp, 1.0_wp)
   end subroutine make_body

   !> One of three sections for each element, at random: for itself, or for all of its square.
   subroutine mix_sections(mesh, edge)
      type(mesh_t), intent(inout) :: mesh
      !> of the squares, 0: there are none [length]
      real(wp), intent(in) :: edge
      integer :: e, place
      do e = 1, mesh%n_elements
         place = e
         if (edge > 0) place = dot_product(int(mesh%x(:, mesh%connectivity(1, e))/edge), [1, 10007]) + 1
         mesh%section(e) = 1 + min(2, int(3*uniform(1, place, 1)))
      end do
   end subroutine mix_sections

   subroutine make_mesh(elements, ordering, jitter, model)
      integer, intent(in) :: elements
      character(len=*), intent(in) :: ordering
      real(wp), intent(in) :: jitter
      type(model_t), intent(inout) :: model
      type(raw_mesh_t) :: raw
      integer, allocatable :: sides(:), place(:), node_place(:), element_place(:)
      integer :: i, status, offenders(2), chosen
      call generate('STAGGERED', [0.0_wp, 0.0_wp], lengths, nint(lengths/side(elements)), jitter, 1, raw%x, &
                    raw%connectivity, sides)
      raw%n_nodes = size(raw%x, 2)
      raw%n_elements = size(raw%connectivity, 2)
      if (ordering == 'SHUFFLED') then
         place = shuffled(raw%n_nodes)
         raw%x(:, place) = raw%x
         sides(place) = sides
         do i = 1, raw%n_elements
            raw%connectivity(:, i) = place(raw%connectivity(:, i))
         end do
         raw%connectivity = raw%connectivity(:, shuffled(raw%n_elements))
      end if
      chosen = ordering_none
      if (ordering == 'HILBERT') chosen = ordering_hilbert
      if (ordering == 'METIS') chosen = ordering_metis
      call assemble(raw, [(i, i=1, raw%n_nodes)], [(i, i=1, raw%n_elements)], chosen, model%mesh, node_place, element_place)
      associate (mesh => model%mesh)
         mesh%section(:mesh%n_elements) = 1
         mesh%last_node_id = raw%n_nodes
         mesh%last_element_id = raw%n_elements
         do i = 1, raw%n_nodes
            if (btest(sides(i), side_left)) mesh%node_membership(1, node_place(i)) = ibset(0_i1, set_left - 1)
            if (btest(sides(i), side_right)) mesh%node_membership(1, node_place(i)) = ibset(0_i1, set_right - 1)
         end do
         call build_topology(mesh, status, offenders)
      end associate
   end subroutine make_mesh

   !> A random permutation, the same every time (Fisher and Yates).
   function shuffled(n) result(place)
      integer, intent(in) :: n
      integer, allocatable :: place(:)
      integer :: i, j, keep
      allocate (place(n))
      do i = 1, n
         place(i) = i
      end do
      do i = n, 2, -1
         j = 1 + min(i - 1, int(i*uniform(1, i, 1)))
         keep = place(i)
         place(i) = place(j)
         place(j) = keep
      end do
   end function shuffled

   !> Closed cracks along lines of nodes.
   subroutine cut_cracks(model, edge, crossed)
      type(model_t), intent(inout) :: model
      !> sides of the triangles, about
      real(wp), intent(in) :: edge
      logical, intent(in) :: crossed
      !> the node lies on a crack along its row; on one that rises
      logical, allocatable :: on_line(:, :)
      integer :: e, k, n, line, n_nodes, copies
      associate (mesh => model%mesh)
         n_nodes = mesh%n_nodes
         allocate (on_line(n_nodes, 2))
         call find_lines(mesh%x(:, :n_nodes), edge, crossed, on_line)
         do line = 1, 2
            do e = 1, mesh%n_elements
               do k = 1, 3
                  if (.not. on_line(mesh%connectivity(k, e), line)) cycle
                  if (on_line(mesh%connectivity(next_corner(k), e), line)) call crack_edge(mesh, e, k, 0_i1, 0)
               end do
            end do
         end do
         do n = 1, n_nodes
            if (any(on_line(n, :))) call refan_node(mesh, n, model%changes, copies)
         end do
      end associate
   end subroutine cut_cracks

   !> Nodes that lie on cracks.
   pure subroutine find_lines(x, edge, crossed, on_line)
      !> (2, nodes)
      real(wp), intent(in) :: x(:, :), edge
      logical, intent(in) :: crossed
      !> (nodes, 2): along its row, along a line that rises
      logical, intent(out) :: on_line(:, :)
      integer :: n, rows, columns, row, rising
      columns = nint(lengths(1)/edge)
      rows = 2*nint(lengths(2)/(2*row_height*edge))
      on_line = .false.
      do n = 1, size(x, 2)
         row = nint(x(2, n)*rows/lengths(2))
         if (.not. crossed) then
            on_line(n, 1) = mod(row, crack_rows) == crack_rows/2 - 1 .and. &
                            mod(nint(x(1, n)*columns/lengths(1)), crack_sides) /= 0
         else if (x(1, n) > 2*edge .and. all(x(:, n) < corner_part*lengths)) then
            rising = modulo(nint(x(1, n)*columns/lengths(1) - 0.5_wp*row), cross_sides) - cross_sides/2
            row = modulo(row, cross_sides) - cross_sides/2
            on_line(n, 1) = row == 0 .and. abs(rising) <= arm_sides
            on_line(n, 2) = rising == 0 .and. abs(row) <= arm_sides
         end if
      end do
   end subroutine find_lines

   !> Displacements of a beam that bends as one on two supports with a force in the middle (no shear); largest strain at
   !> the middle of its underside.
   subroutine bend(model, largest_strain)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: largest_strain
      real(wp) :: curvature, s, h
      integer :: n
      curvature = 2*largest_strain/lengths(2)
      h = 0.5_wp*lengths(1)
      do n = 1, model%mesh%n_nodes
         s = model%mesh%x(1, n) - h
         model%motion%ux(n) = -(model%mesh%x(2, n) - 0.5_wp*lengths(2))*curvature*(s - sign(0.5_wp*s*s/h, s))
         model%motion%uy(n) = curvature*(0.5_wp*s*s - abs(s)**3/(6*h))
      end do
   end subroutine bend

end module bench_body
