!> Disjoint sets as a forest: each member points towards the root of its set (Galler & Fischer 1964), with path halving.
module rf_disjoint
   implicit none
   private
   public :: singletons, find_root, unite

contains

   !> n sets of one member each.
   pure function singletons(n) result(root)
      integer, intent(in) :: n
      !> (n)
      integer, allocatable :: root(:)
      integer :: i
      allocate (root(n))
      do i = 1, n
         root(i) = i
      end do
   end function singletons

   !> Root of a member's set: its lowest member.
   integer function find_root(root, member) result(r)
      !> the forest; ways to the root are shortened
      integer, intent(inout) :: root(:)
      integer, intent(in) :: member
      r = member
      do while (root(r) /= r)
         root(r) = root(root(r))
         r = root(r)
      end do
   end function find_root

   !> Make one set of the sets of two members.
   subroutine unite(root, a, b)
      integer, intent(inout) :: root(:)
      integer, intent(in) :: a, b
      integer :: root_a, root_b
      root_a = find_root(root, a)
      root_b = find_root(root, b)
      root(max(root_a, root_b)) = min(root_a, root_b)
   end subroutine unite

end module rf_disjoint
