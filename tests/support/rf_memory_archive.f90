!> An archive in memory, for tests: what is exchanged is kept by name, so that two archives can be compared member by member.
module rf_memory_archive
   use, intrinsic :: iso_c_binding, only: c_f_pointer, c_ptr
   use rf_kinds, only: i1
   use rf_archive, only: archive_t, datum_t, archive_byte, archive_integer
   use rf_text, only: to_text
   implicit none
   private
   public :: memory_archive_t, difference

   type :: member_t
      !> with the groups it lies in
      character(len=:), allocatable :: name
      type(datum_t) :: datum
      integer(i1), allocatable :: bytes(:)
   end type member_t

   type, extends(archive_t) :: memory_archive_t
      integer :: n = 0
      type(member_t), allocatable, private :: members(:)
      character(len=:), allocatable, private :: place
   contains
      procedure :: enter, leave, look_up, move, rewind => rewind_archive
   end type memory_archive_t

contains

   !> Read from the beginning what was written.
   subroutine rewind_archive(self)
      class(memory_archive_t), intent(inout) :: self
      self%reading = .true.
      self%place = ''
   end subroutine rewind_archive

   subroutine enter(self, name, number)
      class(memory_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in), optional :: number
      if (.not. allocated(self%place)) self%place = ''
      self%place = self%place//'/'//name
      if (present(number)) self%place = self%place//'_'//to_text(number)
   end subroutine enter

   subroutine leave(self)
      class(memory_archive_t), intent(inout) :: self
      self%place = self%place(:index(self%place, '/', back=.true.) - 1)
   end subroutine leave

   !> Position of a member, 0 if there is none of that name.
   integer function find(self, name)
      class(memory_archive_t), intent(in) :: self
      !> with its groups
      character(len=*), intent(in) :: name
      do find = self%n, 1, -1
         if (self%members(find)%name == name) return
      end do
   end function find

   subroutine look_up(self, name, datum)
      class(memory_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(out) :: datum
      integer :: i
      i = find(self, self%place//'/'//name)
      if (i == 0) call self%fail('no '//self%place//'/'//name)
      if (i > 0) datum = self%members(i)%datum
   end subroutine look_up

   subroutine move(self, name, datum, address)
      class(memory_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      type(c_ptr), intent(in) :: address
      integer(i1), pointer :: memory(:)
      integer :: bytes, i
      bytes = 0
      if (datum%present) bytes = product(datum%extent(:datum%rank))*element_size(datum%element)
      if (.not. allocated(self%place)) self%place = ''
      if (.not. self%reading) call add_member(self, name, datum, bytes)
      if (bytes == 0) return
      call c_f_pointer(address, memory, [bytes])
      if (self%reading) then
         i = find(self, self%place//'/'//name)
         memory = self%members(i)%bytes
      else
         self%members(self%n)%bytes = memory
      end if
   end subroutine move

   subroutine add_member(self, name, datum, bytes)
      class(memory_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      integer, intent(in) :: bytes
      type(member_t), allocatable :: larger(:)
      if (.not. allocated(self%members)) allocate (self%members(64))
      if (find(self, self%place//'/'//name) > 0) call self%fail(self%place//'/'//name//' is there twice')
      if (self%n == size(self%members)) then
         allocate (larger(2*self%n))
         larger(:self%n) = self%members
         call move_alloc(larger, self%members)
      end if
      self%n = self%n + 1
      self%members(self%n)%name = self%place//'/'//name
      self%members(self%n)%datum = datum
      allocate (self%members(self%n)%bytes(bytes), source=0_i1)
   end subroutine add_member

   pure integer function element_size(element) result(bytes)
      integer, intent(in) :: element
      select case (element)
      case (archive_byte); bytes = 1
      case (archive_integer); bytes = 4
      case default; bytes = 8
      end select
   end function element_size

   !> The first member in which two archives differ; empty if there is none. `but` are names that need not be equal.
   function difference(one, two, but) result(text)
      type(memory_archive_t), intent(in) :: one, two
      !> full names, blanks between them
      character(len=*), intent(in) :: but
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      if (one%n /= two%n) text = 'number of members'
      do i = 1, min(one%n, two%n)
         associate (a => one%members(i), b => two%members(i))
            if (index(' '//but//' ', ' '//a%name//' ') > 0) cycle
            if (a%name /= b%name) then
               text = a%name//' and '//b%name
            else if (a%datum%element /= b%datum%element .or. a%datum%rank /= b%datum%rank .or. &
                     (a%datum%present .neqv. b%datum%present) .or. any(a%datum%lower /= b%datum%lower) .or. &
                     any(a%datum%extent /= b%datum%extent)) then
               text = a%name//' looks otherwise'
            else if (any(a%bytes /= b%bytes)) then
               text = a%name
            end if
         end associate
         if (len(text) > 0) return
      end do
   end function difference
end module rf_memory_archive
