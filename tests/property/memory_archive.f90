!> An archive in memory: all that a type exchanges, by name, private members included, to be compared or changed.
module memory_archive
   use, intrinsic :: iso_c_binding, only: c_ptr, c_f_pointer
   use rf_kinds, only: wp, i1, i8
   use rf_archive, only: archive_t, datum_t, archive_byte, archive_integer, archive_long, archive_real
   implicit none
   private
   public :: memory_t, item_t, longest_name

   integer, parameter :: longest_name = 60

   !> One datum.
   type :: item_t
      !> with its groups: `group/name`
      character(len=longest_name) :: name = ''
      type(datum_t) :: datum
      !> numbers as they are, of reals the bits, in the order of memory
      integer(i8), allocatable :: value(:)
   contains
      procedure :: entities, components
   end type item_t

   type, extends(archive_t) :: memory_t
      integer :: n = 0
      type(item_t), allocatable :: item(:)
      character(len=longest_name), private :: group = ''
   contains
      procedure :: enter, leave, look_up, move, find
   end type memory_t

contains

   !> Entries of the last dimension; 1 of a single number.
   pure integer function entities(self)
      class(item_t), intent(in) :: self
      entities = 1
      if (self%datum%rank > 0) entities = self%datum%extent(self%datum%rank)
   end function entities

   !> Values of each of them.
   pure integer function components(self)
      class(item_t), intent(in) :: self
      components = product(self%datum%extent(:self%datum%rank - 1))
   end function components

   subroutine enter(self, name, number)
      class(memory_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in), optional :: number
      if (present(number)) error stop 'memory_archive: numbered groups are not told apart'
      self%group = trim(self%group)//name//'/'
   end subroutine enter

   subroutine leave(self)
      class(memory_t), intent(inout) :: self
      integer :: end
      end = index(self%group(:len_trim(self%group) - 1), '/', back=.true.)
      self%group = self%group(:end)
   end subroutine leave

   !> Number of the item of a full name, 0 if there is none.
   integer function find(self, name) result(i)
      class(memory_t), intent(in) :: self
      character(len=*), intent(in) :: name
      do i = self%n, 1, -1
         if (self%item(i)%name == name) return
      end do
   end function find

   subroutine look_up(self, name, datum)
      class(memory_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(out) :: datum
      integer :: i
      i = self%find(trim(self%group)//name)
      if (i == 0) call self%fail('there is no '//trim(self%group)//name)
      if (i > 0) datum = self%item(i)%datum
   end subroutine look_up

   subroutine move(self, name, datum, address)
      class(memory_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      type(c_ptr), intent(in) :: address
      type(item_t), allocatable :: more(:)
      integer :: i
      if (self%reading) then
         i = self%find(trim(self%group)//name)
      else
         if (.not. allocated(self%item)) allocate (self%item(100))
         if (self%n == size(self%item)) then
            allocate (more(2*self%n))
            more(:self%n) = self%item
            call move_alloc(more, self%item)
         end if
         self%n = self%n + 1
         i = self%n
         self%item(i)%name = trim(self%group)//name
         self%item(i)%datum = datum
         allocate (self%item(i)%value(merge(product(datum%extent(:datum%rank)), 0, datum%present)))
      end if
      if (size(self%item(i)%value) > 0) call copy(self%reading, self%item(i), address)
   end subroutine move

   !> From memory to the item, or back.
   subroutine copy(back, item, address)
      logical, intent(in) :: back
      type(item_t), intent(inout) :: item
      type(c_ptr), intent(in) :: address
      integer(i1), pointer :: bytes(:)
      integer, pointer :: integers(:)
      integer(i8), pointer :: longs(:)
      real(wp), pointer :: reals(:)
      integer :: n
      n = size(item%value)
      select case (item%datum%element)
      case (archive_byte)
         call c_f_pointer(address, bytes, [n])
         if (back) bytes = int(item%value, i1)
         if (.not. back) item%value = bytes
      case (archive_integer)
         call c_f_pointer(address, integers, [n])
         if (back) integers = int(item%value)
         if (.not. back) item%value = integers
      case (archive_long)
         call c_f_pointer(address, longs, [n])
         if (back) longs = item%value
         if (.not. back) item%value = longs
      case (archive_real)
         call c_f_pointer(address, reals, [n])
         if (back) reals = transfer(item%value, reals)
         if (.not. back) item%value = transfer(reals, item%value)
      end select
   end subroutine copy

end module memory_archive
