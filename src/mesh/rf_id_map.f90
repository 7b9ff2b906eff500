!> From the ids that a user gave to entry numbers 1, 2, 3, ... in the order of the deck. Ids that follow each other
!> without a gap, as most decks have them, need no table; for others there is a hash table.
module rf_id_map
   use rf_kinds, only: i8
   use rf_grow, only: grow
   use rf_numbering, only: order_by_key
   implicit none
   private
   public :: id_map_t

   !> slots of the table that are neighbours for neighbouring ids, so that a walk through ids is a walk through memory
   integer, parameter :: block_bits = 8
   !> Knuth's multiplicative hash: 2^32 divided by the golden ratio, prime
   integer(i8), parameter :: knuth = 2654435761_i8
   integer(i8), parameter :: mask = int(z'FFFFFFFF', i8)
   integer, parameter :: least_bits = 10, word_bits = 32

   type :: id_map_t
      !> entries so far
      integer :: n = 0
      !> id of each entry (the array may be larger)
      integer, allocatable :: id(:)
      !> entry in each slot of the table (0: free); not allocated while ids are consecutive
      integer, allocatable, private :: slot(:)
      !> the table has 2^slot_bits slots
      integer, private :: slot_bits = 0
   contains
      procedure :: add, find, largest, base_for_new
      procedure, private :: build_table, slot_of
   end type id_map_t

contains

   !> Add an id as the next entry, unless it is known already.
   subroutine add(self, id, known)
      class(id_map_t), intent(inout) :: self
      !> the id, at least 1
      integer, intent(in) :: id
      !> entry that has this id already (0: none, it was added)
      integer, intent(out) :: known
      known = self%find(id)
      if (known > 0) return
      if (.not. allocated(self%slot) .and. self%n > 0) then
         if (id - 1 /= self%id(self%n)) call self%build_table(2*self%n)
      end if
      self%n = self%n + 1
      call grow(self%id, self%n)
      self%id(self%n) = id
      if (.not. allocated(self%slot)) return
      if (2*self%n > size(self%slot)) then
         call self%build_table(4*self%n)
      else
         self%slot(self%slot_of(id)) = self%n
      end if
   end subroutine add

   !> Entry of an id; 0 if there is none.
   pure integer function find(self, id) result(entry)
      class(id_map_t), intent(in) :: self
      !> any integer
      integer, intent(in) :: id
      entry = 0
      if (self%n == 0 .or. id < 1) return
      if (allocated(self%slot)) then
         entry = self%slot(self%slot_of(id))
      else if (id >= self%id(1) .and. id <= self%id(self%n)) then
         entry = id - self%id(1) + 1
      end if
   end function find

   !> Largest id; 0 if there is none.
   pure integer function largest(self)
      class(id_map_t), intent(in) :: self
      largest = 0
      if (self%n > 0) largest = maxval(self%id(:self%n))
   end function largest

   !> The number that new ids count on from: the largest id, or, where fewer than `room` numbers are left above that,
   !> the id (or 0) below the widest gap.
   pure integer function base_for_new(self, room) result(base)
      class(id_map_t), intent(in) :: self
      !> numbers wanted
      integer, intent(in) :: room
      integer, allocatable :: order(:)
      integer :: i, below, widest
      base = self%largest()
      if (base <= huge(1) - room) return
      widest = huge(1) - base
      below = 0
      order = order_by_key(int(self%id(:self%n), i8))
      do i = 1, self%n
         if (self%id(order(i)) - below > widest) then
            widest = self%id(order(i)) - below
            base = below
         end if
         below = self%id(order(i))
      end do
   end function base_for_new

   !> Make a table of at least so many slots and fill all entries in.
   pure subroutine build_table(self, at_least)
      class(id_map_t), intent(inout) :: self
      !> slots wanted
      integer, intent(in) :: at_least
      integer :: entry
      self%slot_bits = least_bits
      do while (2**self%slot_bits < at_least)
         self%slot_bits = self%slot_bits + 1
      end do
      if (allocated(self%slot)) deallocate (self%slot)
      allocate (self%slot(2**self%slot_bits))
      self%slot = 0
      do entry = 1, self%n
         self%slot(self%slot_of(self%id(entry))) = entry
      end do
   end subroutine build_table

   !> The slot that holds an id, or the free one where it belongs.
   pure integer function slot_of(self, id) result(slot)
      class(id_map_t), intent(in) :: self
      !> the id
      integer, intent(in) :: id
      integer :: block
      ! the highest bits of the product are the well mixed ones
      block = int(shiftr(iand(knuth*shiftr(id, block_bits), mask), word_bits - (self%slot_bits - block_bits)))
      slot = shiftl(block, block_bits) + iand(id, 2**block_bits - 1) + 1
      do while (self%slot(slot) > 0)
         if (self%id(self%slot(slot)) == id) return
         slot = slot + 1
         if (slot > size(self%slot)) slot = 1
      end do
   end function slot_of
end module rf_id_map
