!> Stable sorting of keys: the order in which entities have to be taken.
module rf_sort
   use rf_kinds, only: i8
   implicit none
   private
   public :: sorted_order, ascending_once

contains

   !> Permutation that puts keys in ascending order; equal keys keep their order (bottom-up merge sort).
   pure function sorted_order(keys) result(order)
      !> keys, (n)
      integer(i8), intent(in) :: keys(:)
      integer, allocatable :: order(:)
      integer, allocatable :: merged(:)
      integer :: n, width, left, middle, right, i, j, k
      n = size(keys)
      allocate (order(n), merged(n))
      do i = 1, n
         order(i) = i
      end do
      width = 1
      do while (width < n)
         do left = 1, n, 2*width
            middle = min(left + width, n + 1)
            right = min(left + 2*width, n + 1)
            i = left
            j = middle
            do k = left, right - 1
               if (take_left()) then
                  merged(k) = order(i)
                  i = i + 1
               else
                  merged(k) = order(j)
                  j = j + 1
               end if
            end do
         end do
         order = merged
         width = 2*width
      end do

   contains

      pure logical function take_left()
         take_left = j >= right
         if (i < middle .and. j < right) take_left = keys(order(i)) <= keys(order(j))
      end function take_left

   end function sorted_order

   !> Numbers in ascending order, each once.
   pure function ascending_once(list) result(sorted)
      integer, intent(in) :: list(:)
      integer, allocatable :: sorted(:)
      logical, allocatable :: is_new(:)
      sorted = list(sorted_order(int(list, i8)))
      allocate (is_new(size(sorted)))
      is_new = .true.
      if (size(sorted) > 1) is_new(2:) = sorted(2:) /= sorted(:size(sorted) - 1)
      sorted = pack(sorted, is_new)
   end function ascending_once

end module rf_sort
