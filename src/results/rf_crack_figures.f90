!> What is said of cracks: how many there are, how long, and opening, slip and tractions of each segment.
module rf_crack_figures
   use rf_kinds, only: wp
   use rf_disjoint, only: find_root, unite
   use rf_mesh, only: mesh_t
   use rf_topology, only: side_nodes
   use rf_model, only: model_t
   use rf_contact, only: pair_open, pair_slip, pair_stick
   implicit none
   private
   public :: segment_figures_t, count_cracks, crack_length, contact_counts, look_at_segment

   !> One crack segment: the first side is that of the lower element id; the direction runs along its edge.
   type :: segment_figures_t
      !> ends of the segment [length], (2, 2)
      real(wp) :: x(2, 2) = 0
      !> opening and slip of the second side against the first [length], means of the two ends
      real(wp) :: opening = 0, slip = 0
      !> traction on the second side along the direction; normal traction, tension positive [stress]
      real(wp) :: shear_traction = 0, normal_traction = 0
      !> 0 open, 1 slip, 2 stick
      integer :: state = pair_open
   end type segment_figures_t

contains

   !> Number of connected cracks: segments that share a point belong together.
   integer function count_cracks(mesh) result(n)
      type(mesh_t), intent(in) :: mesh
      integer, allocatable :: root(:)
      integer :: s, nodes(4), i
      n = 0
      if (mesh%n_segments == 0) return
      allocate (root(mesh%n_nodes), source=0)
      do s = 1, mesh%n_segments
         nodes = reshape(side_nodes(mesh, s), [4])
         do i = 1, 4
            if (root(nodes(i)) > 0) cycle
            root(nodes(i)) = nodes(i)
            n = n + 1
         end do
         do i = 2, 4
            if (find_root(root, nodes(1)) /= find_root(root, nodes(i))) n = n - 1
            call unite(root, nodes(1), nodes(i))
         end do
      end do
   end function count_cracks

   !> Length of all crack segments [length].
   real(wp) function crack_length(mesh) result(total)
      type(mesh_t), intent(in) :: mesh
      integer :: s, nodes(2, 2)
      total = 0
      do s = 1, mesh%n_segments
         nodes = side_nodes(mesh, s)
         total = total + norm2(mesh%x(:, nodes(2, 1)) - mesh%x(:, nodes(1, 1)))
      end do
   end function crack_length

   !> Pairs that are open, slip and stick.
   function contact_counts(model) result(counts)
      type(model_t), intent(in) :: model
      integer :: counts(0:2)
      integer :: p, state
      counts = 0
      do p = 1, model%contact%n_pairs
         state = model%contact%state(p, model%relaxation%b)
         counts(state) = counts(state) + 1
      end do
   end function contact_counts

   !> Geometry and contact of a segment. At a tip there is no pair: tractions and state are those of the other end.
   subroutine look_at_segment(model, segment, found)
      type(model_t), intent(in) :: model
      integer, intent(in) :: segment
      type(segment_figures_t), intent(out) :: found
      integer :: nodes(2, 2), i, p, pairs, touching, sticking
      real(wp) :: along(2), normal(2), jump(2), f(2), pull(2)
      nodes = side_nodes(model%mesh, segment)
      associate (mesh => model%mesh)
         if (mesh%element_id(mesh%segment_element(1, segment)) > mesh%element_id(mesh%segment_element(2, segment))) &
            nodes = nodes([2, 1], [2, 1])       ! the other side's edge runs the other way
         found%x = mesh%x(:, nodes(:, 1))
         along = found%x(:, 2) - found%x(:, 1)
         along = along/norm2(along)
         normal = [along(2), -along(1)]         ! out of the first side
      end associate
      pairs = 0; touching = 0; sticking = 0
      do i = 1, 2
         jump(1) = model%motion%ux(nodes(i, 2)) - model%motion%ux(nodes(i, 1))
         jump(2) = model%motion%uy(nodes(i, 2)) - model%motion%uy(nodes(i, 1))
         found%opening = found%opening + 0.5_wp*max(0.0_wp, dot_product(jump, normal))
         found%slip = found%slip + 0.5_wp*dot_product(jump, along)
         p = model%contact%find_pair(nodes(i, 1), nodes(i, 2))
         if (p == 0) cycle
         pairs = pairs + 1
         pull = model%contact%traction(p, model%relaxation%b)/model%contact%area(p)
         f = model%contact%normal(:, p)*pull(1) + [-model%contact%normal(2, p), model%contact%normal(1, p)]*pull(2)
         if (model%contact%pair(1, p) == nodes(i, 2)) f = -f
         found%normal_traction = found%normal_traction - dot_product(f, normal)
         found%shear_traction = found%shear_traction + dot_product(f, along)
         select case (model%contact%state(p, model%relaxation%b))
         case (pair_slip); touching = touching + 1
         case (pair_stick); touching = touching + 1; sticking = sticking + 1
         end select
      end do
      found%normal_traction = found%normal_traction/max(1, pairs)
      found%shear_traction = found%shear_traction/max(1, pairs)
      if (touching > 0) found%state = merge(pair_stick, pair_slip, sticking == touching)
   end subroutine look_at_segment

end module rf_crack_figures
