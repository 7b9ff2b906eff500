!> New numbers of a mesh that has grown: whatever the model keeps by node, element or pair must be with the same node, element
!> or pair afterwards, whatever names one must name it still, and everything else must be as it was, bit for bit.
!>
!> What there is to keep is what a checkpoint keeps: the table of rules below has a line for each name, and a name without a rule
!> is a problem, so that a new member must be thought of here.
module renumber_checks
   use rf_kinds, only: wp, i8
   use rf_archive, only: archive_byte, archive_integer, archive_real
   use rf_grow, only: grow
   use rf_random, only: uniform
   use rf_contact, only: contact_t
   use rf_loads, only: loads_t, load_definition_t, renumber_definition, load_support, load_force, load_edges, load_crack
   use rf_mesh, only: mesh_t
   use rf_model, only: model_t
   use rf_ordering, only: ordering_hilbert, ordering_metis
   use rf_partition, only: partitions_available
   use rf_removal_input, only: removal_t, renumber_removal
   use rf_renumber, only: renumbering_t
   use rf_memory_archive, only: memory_archive_t, item_t, longest_name
   implicit none
   private
   public :: renumber_and_check, mark_pairs, check_pairs_left

   !> sums over the same in another order differ by no more than this part of the sum of magnitudes
   real(wp), parameter :: sum_tolerance = 1.0e-12_wp

contains

   !> Number the body anew and check that everything follows; before that do it with a copy in which all that is kept by node,
   !> element or pair is another number, so that nothing can be exchanged unseen.
   subroutine renumber_and_check(model, seed, draw, changed, problem)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: seed
      !> random numbers are drawn for this
      integer, intent(in) :: draw
      !> some node has another number
      logical, intent(out) :: changed
      !> empty if nothing is wrong
      character(len=:), allocatable, intent(out) :: problem
      type(model_t) :: marked
      type(renumbering_t) :: map
      integer :: n
      model%mesh%ordering = ordering_hilbert
      if (partitions_available .and. uniform(seed, 1, draw) < 0.5_wp) model%mesh%ordering = ordering_metis
      marked = model
      call mark(marked, seed, draw)
      call renumber_and_compare(marked, seed, map, problem)
      if (len(problem) > 0) problem = 'with marks: '//problem
      if (len(problem) == 0) call renumber_and_compare(model, seed, map, problem)
      changed = any(map%node /= [(n, n=1, size(map%node))])
      if (len(problem) == 0) call check_sums(model, problem)
   end subroutine renumber_and_check

   subroutine renumber_and_compare(model, seed, map, problem)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: seed
      type(renumbering_t), intent(out) :: map
      character(len=:), allocatable, intent(out) :: problem
      type(memory_archive_t) :: before, after
      type(contact_t) :: contact
      type(mesh_t) :: mesh
      type(loads_t) :: loads
      integer, allocatable :: pair(:)
      integer :: i
      problem = ''
      contact = model%contact
      mesh = model%mesh
      loads = model%loads
      call model%exchange(before)
      call model%renumber(map)
      call model%exchange(after)
      call check_map(map, mesh, model%mesh, problem)
      if (len(problem) > 0) return
      call check_pairs(map, contact, model%contact, pair, problem)
      do i = 1, before%n
         if (len(problem) > 0) return
         call check_item(before%item(i), after, map, pair, problem)
      end do
      call check_definitions(map, mesh, model%mesh, loads%acting(:loads%n_acting), model%loads%acting(:loads%n_acting), problem)
      call check_names(map, mesh, model%mesh, seed, problem)
      if (len(problem) == 0 .and. model%has_grown()) problem = 'the mesh counts as grown after it was numbered anew'
   end subroutine renumber_and_compare

   !> How a datum follows. First character: it is kept by node, element, segment, pair or nodal force (n, e, s, p, f), as a whole
   !> (=), or it follows from other data (-; then it is looked at elsewhere, or made before it is used). Second: its values are
   !> numbers of nodes or elements (n, e). Third (*): it may be any number, and is in the copy with marks.
   function rule_of(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '?'
      select case (name(:index(name, '/')))
      case ('mesh/')
         rule = mesh_rule(name)
      case ('contact/')
         rule = contact_rule(name)
      case ('loads/')
         rule = loads_rule(name)
      case ('failure/')
         rule = failure_rule(name)
      case ('energy/')
         rule = '='
         if (any(name(8:) == ['ux', 'uy', 'px', 'py'])) rule = 'n *'
      case ('dynamics/')
         rule = dynamics_rule(name)
      case ('motion/')
         rule = 'n *'
      case ('material/')
         if (name == 'material/initial/given') rule = '='
         if (name == 'material/stiffness_factor' .or. name == 'material/strength_factor' .or. &
             name == 'material/initial/stress') rule = 'e *'
      case ('pieces/')
         rule = '='
         if (name == 'pieces/of_node') rule = 'n'
         if (name == 'pieces/seen' .or. name == 'pieces/search') rule = '-'      ! marks of searches that are over
      case ('relaxation/')
         rule = '='
         if (name == 'relaxation/velocity' .or. name == 'relaxation/node') rule = '-'      ! of the relaxation that is over
      case ('rows/', 'changes/')
         rule = '-'
      case ('baseline/')
         rule = '='
      case ('')
         rule = '='
         if (name == 'reaction') rule = '= *'
      end select
   end function rule_of

   function mesh_rule(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '?'
      select case (name(6:))
      case ('n_nodes', 'n_elements', 'n_segments', 'ordering', 'last_node_id', 'last_element_id', 'size', 'diagonal', &
            'mean_edge')
         rule = '='
      case ('n_numbered_nodes', 'n_numbered_elements')      ! has_grown
         rule = '-'
      case ('x', 'node_id', 'node_origin', 'node_rank', 'share', 'hinge', 'node_membership')
         rule = 'n'
      case ('element_of')
         rule = 'ne'
      case ('connectivity')
         rule = 'en'
      case ('neighbour')
         rule = 'ee'
      case ('segment', 'face_tag', 'element_id', 'element_origin', 'element_rank', 'section', 'split_level', &
            'element_membership')
         rule = 'e'
      case ('segment_element')
         rule = 'se'
      case ('segment_mode', 'segment_event', 'segment_crack', 'segment_straight')
         rule = 's'
      end select
   end function mesh_rule

   !> The pairs are put into groups anew, and what relaxations and time steps need is made when they begin.
   function contact_rule(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '?'
      select case (name(9:))
      case ('n_pairs', 'n_nodes', 'n_groups', 'n_lone', 'cohesive/dissipated', 'cohesive/stored')
         rule = '='
      case ('pair', 'normal')      ! check_pairs
         rule = '-'
      case ('area', 'friction', 'cohesion', 'cohesive/area', 'cohesive/energy', 'cohesive/strength', 'cohesive/bonded')
         rule = 'p'
      case ('broken', 'slip_reference', 'gap_reference', 'friction_before', 'limit_before', 'impulse', 'cohesive/damage', &
            'cohesive/separation', 'cohesive/jump')
         rule = 'p *'
      case ('cohesive/rigid')
         rule = 'p *'
      case ('cohesive_force', 'weight', 'gain', 'node', 'pair_node', 'force', 'mobility', 'counted', 'group_pair', 'group_node', &
            'partial', 'jump', 'kick', 'key', 'by_key', 'cohesive/impulse', 'cohesive/cap', 'cohesive/critical', 'cohesive/steep')
         rule = '-'
      end select
   end function contact_rule

   function loads_rule(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '='
      select case (name(7:))
      case ('px', 'py', 'applied', 'initial', 'free_x', 'free_y')
         rule = 'n *'
      case ('place')
         rule = 'n'
      case ('ends')
         rule = 'nn*'
      case ('force_node')
         rule = 'fn'
      case ('force_dof', 'force_definition')
         rule = 'f'
      case ('acting_whole', 'n_touched', 'touched')      ! check_definitions; of the last split
         rule = '-'
      end select
   end function loads_rule

   function failure_rule(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '?'
      select case (name(9:))
      case ('watching', 'keeps_stress', 'largest', 'largest_exhausted', 'n_exhausted', 'out_of_plane_node')
         rule = '='
      case ('no_split_node', 'exhausted', 'shielded', 'soft_tip', 'tip_direction', 'stale', 'stress', 'utilisation', &
            'deciding_material', 'mode', 'screen', 'ring')
         rule = 'n *'
      case ('no_split_element', 'element_stress', 'element_utilisation', 'element_bound')
         rule = 'e *'
      case ('block_bound', 'screened', 'looked_at', 'n_screened', 'n_looked_at', 'all_screened', &      ! of the last look
            'shield_list', 'n_shield_list')      ! check_looks
         rule = '-'
      end select
   end function failure_rule

   !> What follows from the mesh is made anew after the splits of a moment (follow_split).
   function dynamics_rule(name) result(rule)
      character(len=*), intent(in) :: name
      character(len=3) :: rule
      rule = '?'
      select case (name(10:))
      case ('velocity', 'initial')
         rule = 'n *'
      case ('wanted', 'time_step', 'last_time_step', 'safe', 'forces_vary', 'damped', 'changing', 'starting')
         rule = '='
      case ('mass', 'damping', 'inverse_mass', 'keep', 'ones', 'partial', 'special', 'n_moving', 'moving', 'target', &
            'old_moving', 'moving_force', 'old_contact', 'old_x', 'old_y', 'booked_x', 'booked_y')
         rule = '-'
      end select
   end function dynamics_rule

   !> Every number that may be any is one drawn for its place. What only some bodies have is there too.
   subroutine mark(model, seed, draw)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: seed, draw
      type(memory_archive_t) :: memory
      character(len=3) :: rule
      integer :: i, k, n
      n = model%mesh%n_nodes
      call grow(model%loads%initial, n, 2)
      call grow(model%loads%applied, n, 2)
      call grow(model%loads%ends, n, 2)
      call grow(model%dynamics%velocity, n, 2)
      call grow(model%dynamics%initial, n, 2)
      call grow(model%failure%shielded, n)
      call grow(model%failure%soft_tip, n)
      call grow(model%failure%tip_direction, n, 2)
      if (.not. model%material%initial%given) call model%material%initial%prepare(model%mesh%n_elements)
      call model%exchange(memory)
      do i = 1, memory%n
         rule = rule_of(trim(memory%item(i)%name))
         if (rule(3:3) /= '*') cycle
         do k = 1, size(memory%item(i)%value)
            memory%item(i)%value(k) = number_drawn(memory%item(i), rule, uniform(seed + draw, k, i), n)
         end do
      end do
      memory%reading = .true.
      call model%exchange(memory)
      if (allocated(memory%error)) error stop 'renumber_checks: the marks do not fit'
      call model%contact%rebuild(model%mesh, model%material, model%motion)      ! strengths of pairs follow from those of elements
   end subroutine mark

   integer(i8) function number_drawn(item, rule, drawn, n_nodes) result(number)
      type(item_t), intent(in) :: item
      character(len=3), intent(in) :: rule
      !> in (0, 1)
      real(wp), intent(in) :: drawn
      integer, intent(in) :: n_nodes
      number = 0
      select case (item%datum%element)
      case (archive_byte)      ! most are logical
         number = nint(drawn)
      case (archive_integer)
         number = 1 + int(drawn*1.0e6_wp)
         if (rule(2:2) == 'n') number = min(n_nodes, 1 + int(drawn*n_nodes))
      case (archive_real)
         number = transfer(drawn, number)
      end select
   end function number_drawn

   !> What cracks that soften know is another number in each pair.
   subroutine mark_pairs(contact, seed, draw)
      type(contact_t), intent(inout) :: contact
      integer, intent(in) :: seed, draw
      integer :: p
      do p = 1, contact%n_pairs
         contact%cohesive%damage(p) = uniform(seed, p, draw)
         contact%cohesive%separation(p) = contact%cohesive%damage(p)
         contact%cohesive%jump(:, p) = [contact%cohesive%damage(p), -contact%cohesive%damage(p)]
      end do
   end subroutine mark_pairs

   !> Elements were taken out: a pair that is still there knows what it knew.
   subroutine check_pairs_left(map, old, new, problem)
      type(renumbering_t), intent(in) :: map
      type(contact_t), intent(in) :: old, new
      character(len=:), allocatable, intent(inout) :: problem
      integer :: p, q, nodes(2)
      do p = 1, old%n_pairs
         nodes = map%node(old%pair(:, p))
         if (any(nodes == 0)) cycle
         q = new%find_pair(nodes(1), nodes(2))
         if (q == 0) cycle
         if ((new%broken(q) .neqv. old%broken(p)) .or. abs(new%cohesive%damage(q) - old%cohesive%damage(p)) > 0 .or. &
             abs(new%cohesive%separation(q) - old%cohesive%separation(p)) > 0 .or. &
             any(abs(new%cohesive%jump(:, q) - old%cohesive%jump(:, p)) > 0)) problem = 'a pair has forgotten what it knew'
         if (any(abs(new%normal(:, q) - old%normal(:, p)) > 0)) cycle
         if (abs(new%slip_reference(q) - old%slip_reference(p)) > 0 .or. abs(new%gap_reference(q) - old%gap_reference(p)) > 0) &
            problem = 'a pair measures slip or gap from elsewhere'
      end do
   end subroutine check_pairs_left

   !> The map is one to one, the new order the one asked for, and ids and places stay with their nodes and elements.
   subroutine check_map(map, old, new, problem)
      type(renumbering_t), intent(in) :: map
      type(mesh_t), intent(in) :: old, new
      character(len=:), allocatable, intent(inout) :: problem
      integer :: i
      if (size(map%node) /= old%n_nodes .or. size(map%element) /= old%n_elements) problem = 'the map has another size'
      if (new%n_numbered_nodes /= old%n_nodes .or. new%n_numbered_elements /= old%n_elements) &
         problem = 'not all nodes or elements count as numbered'
      if (len(problem) > 0) return
      if (any(map%node(map%node_from) /= [(i, i=1, old%n_nodes)])) problem = 'the map of the nodes is not one to one'
      if (any(map%element(map%element_from) /= [(i, i=1, old%n_elements)])) problem = 'the map of the elements is not one to one'
      if (any(map%node_deputy /= map%node) .or. any(map%element_deputy /= map%element)) problem = 'another stands for what stays'
   end subroutine check_map

   !> Each pair is there with the same nodes; seen from the other side its normal points the other way.
   subroutine check_pairs(map, old, new, pair, problem)
      type(renumbering_t), intent(in) :: map
      type(contact_t), intent(in) :: old, new
      !> new number of each pair
      integer, allocatable, intent(out) :: pair(:)
      character(len=:), allocatable, intent(inout) :: problem
      integer :: p, nodes(2)
      real(wp) :: sense
      allocate (pair(old%n_pairs), source=0)
      if (new%n_pairs /= old%n_pairs) problem = 'there are other pairs'
      do p = 1, old%n_pairs
         nodes = map%node(old%pair(:, p))
         pair(p) = new%find_pair(nodes(1), nodes(2))
         if (pair(p) == 0) problem = 'a pair is gone'
         if (pair(p) == 0) return
         if (any(new%pair(:, pair(p)) /= [minval(nodes), maxval(nodes)])) problem = 'a pair has other nodes'
         sense = merge(1.0_wp, -1.0_wp, nodes(1) < nodes(2))
         if (any(abs(new%normal(:, pair(p)) - sense*old%normal(:, p)) > 0)) problem = 'the normal of a pair'
      end do
   end subroutine check_pairs

   !> A datum by its rule.
   subroutine check_item(old, after, map, pair, problem)
      type(item_t), intent(in) :: old
      type(memory_archive_t), intent(in) :: after
      type(renumbering_t), intent(in) :: map
      !> new number of each pair
      integer, intent(in) :: pair(:)
      character(len=:), allocatable, intent(inout) :: problem
      character(len=3) :: rule
      integer, allocatable :: new_place(:)
      integer :: i, k, m
      rule = rule_of(trim(old%name))
      if (rule == '?') problem = trim(old%name)//': renumber_checks has no rule for it'
      if (rule == '?' .or. rule == '-') return
      associate (new => after%item(after%find(old%name)))
         if (new%datum%present .neqv. old%datum%present) problem = trim(old%name)//' was lost, or made'
         if (len(problem) > 0 .or. .not. old%datum%present) return
         select case (rule(1:1))
         case ('n')
            new_place = map%node
         case ('e')
            new_place = map%element
         case ('s')
            new_place = map%segment
         case ('p')
            new_place = pair
         case ('f')      ! they have room to spare
            new_place = [(i, i=1, int(after%item(after%find('loads/n_forces'))%value(1)))]
         case default
            new_place = [(i, i=1, old%entities())]
         end select
         m = old%components()
         if (new%components() /= m .or. min(new%entities(), old%entities()) < size(new_place)) then
            problem = trim(old%name)//' has another size'
            return
         end if
         do i = 1, size(new_place)
            do k = 1, m
               if (new%value(m*(new_place(i) - 1) + k) /= renamed(old%value(m*(i - 1) + k), rule(2:2), map)) &
                  problem = trim(old%name)//' did not follow the new numbers'
            end do
         end do
      end associate
   end subroutine check_item

   !> A value in new numbers.
   integer(i8) function renamed(value, what, map)
      integer(i8), intent(in) :: value
      !> it is the number of a node, an element, or neither
      character(len=1), intent(in) :: what
      type(renumbering_t), intent(in) :: map
      renamed = value
      if (value == 0) return
      if (what == 'n') renamed = map%node(value)
      if (what == 'e') renamed = map%element(value)
   end function renamed

   !> Loads mean what they meant, those that name one node or element by its new number.
   subroutine check_definitions(map, old_mesh, new_mesh, old, new, problem)
      type(renumbering_t), intent(in) :: map
      type(mesh_t), intent(in) :: old_mesh, new_mesh
      type(load_definition_t), intent(in) :: old(:), new(:)
      character(len=:), allocatable, intent(inout) :: problem
      integer :: d, wanted
      do d = 1, size(old)
         if (new(d)%kind /= old(d)%kind .or. new(d)%set /= old(d)%set .or. new(d)%first_dof /= old(d)%first_dof .or. &
             new(d)%last_dof /= old(d)%last_dof .or. new(d)%step /= old(d)%step) problem = 'a load has changed'
         wanted = old(d)%entity
         if (wanted > 0 .and. old(d)%kind /= load_crack) then
            if (old(d)%kind == load_support .or. old(d)%kind == load_force) then
               wanted = map%node(wanted)
               if (new_mesh%node_id(wanted) /= old_mesh%node_id(old(d)%entity)) problem = 'the id of a node'
            else
               wanted = map%element(wanted)
               if (new_mesh%element_id(wanted) /= old_mesh%element_id(old(d)%entity)) problem = 'the id of an element'
            end if
         end if
         if (new(d)%entity /= wanted) problem = 'a load means another node, element or crack'
      end do
   end subroutine check_definitions

   !> What later steps say of single nodes and elements follows by itself (follow_growth).
   subroutine check_names(map, old, new, seed, problem)
      type(renumbering_t), intent(in) :: map
      type(mesh_t), intent(in) :: old, new
      integer, intent(in) :: seed
      character(len=:), allocatable, intent(inout) :: problem
      type(load_definition_t) :: definition(5), before(5)
      type(removal_t) :: removal(2)
      integer :: node, element
      node = 1 + mod(seed, old%n_nodes)
      element = 1 + mod(seed, old%n_elements)
      definition%kind = [load_support, load_force, load_edges, load_crack, load_force]
      definition%entity = [node, node, element, 1, 0]
      definition%set = [0, 0, 0, 0, 2]
      before = definition
      call renumber_definition(definition, map)
      call check_definitions(map, old, new, before, definition, problem)
      removal%entity = [element, 0]
      removal%set = [0, 1]
      call renumber_removal(removal, map)
      if (new%element_id(removal(1)%entity) /= old%element_id(element) .or. removal(2)%entity /= 0 .or. &
          any(removal%set /= [0, 1])) problem = 'a removal means another element'
   end subroutine check_names

   !> The loads are summed anew, in the new order.
   subroutine check_sums(model, problem)
      type(model_t), intent(inout) :: model
      character(len=:), allocatable, intent(inout) :: problem
      real(wp), allocatable :: before(:, :)
      integer :: n
      n = model%mesh%n_nodes
      before = reshape([model%loads%px(:n), model%loads%py(:n)], [n, 2])
      call model%loads%apply(model%mesh, model%material, 0.5_wp, 0.5_wp)
      if (any(abs(reshape([model%loads%px(:n), model%loads%py(:n)], [n, 2]) - before) > sum_tolerance*sum(abs(before)))) &
         problem = 'the loads are others than before'
   end subroutine check_sums

end module renumber_checks
