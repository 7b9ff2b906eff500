!> Pressure in cracks: it pushes the two faces of each segment apart, and may follow the crack into what breaks from it.
module rf_crack_pressure
   use rf_kinds, only: wp
   use rf_disjoint, only: singletons, find_root, unite
   use rf_mesh, only: mesh_t
   use rf_topology, only: side_nodes
   use rf_material, only: material_t
   implicit none
   private
   public :: pressed_segments, press_segments

contains

   !> The segments of a crack; if pressure follows, also those that came by breaking and are connected with them through
   !> segments of the two kinds. Other cracks that were there from the start are not entered.
   subroutine pressed_segments(mesh, crack, follow, pressed)
      type(mesh_t), intent(in) :: mesh
      !> number of the *CRACK
      integer, intent(in) :: crack
      !> pressure enters new faces
      logical, intent(in) :: follow
      !> (segments)
      logical, allocatable, intent(out) :: pressed(:)
      integer, allocatable :: root(:)
      logical, allocatable :: reached(:)
      integer :: nodes(4), s, i
      allocate (pressed(mesh%n_segments))
      pressed = mesh%segment_crack(:mesh%n_segments) == crack
      if (.not. follow) return
      allocate (root, source=singletons(mesh%n_nodes))
      do s = 1, mesh%n_segments
         if (.not. enters(s)) cycle
         nodes = reshape(side_nodes(mesh, s), [4])
         do i = 2, 4
            call unite(root, nodes(1), nodes(i))
         end do
      end do
      allocate (reached(mesh%n_nodes), source=.false.)
      do s = 1, mesh%n_segments
         if (.not. pressed(s)) cycle
         nodes = reshape(side_nodes(mesh, s), [4])
         reached(find_root(root, nodes(1))) = .true.
      end do
      do s = 1, mesh%n_segments
         if (.not. enters(s)) cycle
         nodes = reshape(side_nodes(mesh, s), [4])
         pressed(s) = reached(find_root(root, nodes(1)))
      end do

   contains

      !> The segment is the crack's own or came by breaking.
      pure logical function enters(s)
         integer, intent(in) :: s
         enters = mesh%segment_crack(s) == crack .or. mesh%segment_crack(s) == 0
      end function enters

   end subroutine pressed_segments

   !> Nodal forces of a pressure on both faces of segments: half of each face's force at each of its ends (theory: eq. 6).
   !> At a tip, where both faces have the same node, they cancel.
   subroutine press_segments(mesh, material, pressed, pressure, px, py)
      type(mesh_t), intent(in) :: mesh
      type(material_t), intent(in) :: material
      !> (segments)
      logical, intent(in) :: pressed(:)
      !> positive pushes the faces apart [stress]
      real(wp), intent(in) :: pressure
      !> forces are added [force], (nodes)
      real(wp), intent(inout) :: px(:), py(:)
      integer :: s, side, ends(2, 2), i
      real(wp) :: along(2), push(2)
      do s = 1, mesh%n_segments
         if (.not. pressed(s)) cycle
         ends = side_nodes(mesh, s)
         along = mesh%x(:, ends(2, 1)) - mesh%x(:, ends(1, 1))
         do side = 1, 2      ! the outward normal of the first side is (along_y, -along_x)
            push = 0.5_wp*pressure*material%section(mesh%section(mesh%segment_element(side, s)))%thickness* &
                   merge([-along(2), along(1)], [along(2), -along(1)], side == 1)
            do i = 1, 2
               px(ends(i, side)) = px(ends(i, side)) + push(1)
               py(ends(i, side)) = py(ends(i, side)) + push(2)
            end do
         end do
      end do
   end subroutine press_segments

end module rf_crack_pressure
