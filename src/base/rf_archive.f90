!> An archive of a run's state: where a checkpoint writes it to, and reads it from.
!>
!> Every type that has state owns ONE procedure for both directions, `exchange(self, archive)`, so that writing and reading cannot
!> drift apart: `call archive%exchange('name', datum)` writes the datum, or replaces it by what the archive holds under that name.
!> Allocatable arrays come back with the bounds and contents they had; what was not allocated comes back so. Of arrays with room
!> to spare `used` entities of the last dimension are kept. What has a fixed size goes through `exchange_fixed`. Groups keep the
!> names of one type apart from those of another: `enter`, `leave`.
!>
!> The first thing that fails is told in `error`; from then on nothing is done. Where the bytes go is the business of an extension
!> (rf_hdf5_archive), which has three things to know: groups, how a datum looks, and where it lies in memory.
module rf_archive
   use, intrinsic :: iso_c_binding, only: c_loc, c_null_ptr, c_ptr
   use rf_kinds, only: wp, i1, i8
   use rf_text, only: text_t, to_text
   implicit none
   private
   public :: archive_t, datum_t

   !> what an array or number consists of
   integer, parameter, public :: archive_byte = 1, archive_integer = 2, archive_long = 3, archive_real = 4
   !> dimensions of an array, at most
   integer, parameter, public :: most_dimensions = 3

   !> How a datum looks.
   type :: datum_t
      !> archive_byte, archive_integer, archive_long or archive_real
      integer :: element = archive_integer
      !> dimensions; 0: a single number
      integer :: rank = 0
      !> allocated (an array or text that is not has neither bounds nor contents)
      logical :: present = .true.
      !> smallest index and number of entries in each dimension
      integer :: lower(most_dimensions) = 1, extent(most_dimensions) = 0
   contains
      procedure :: upper
   end type datum_t

   type, abstract :: archive_t
      !> the state is replaced by what the archive holds
      logical :: reading = .false.
      !> what went wrong first
      character(len=:), allocatable :: error
   contains
      !> what is exchanged from here on lies in a group of that name (and number), until `leave`
      procedure(enter_group), deferred :: enter
      procedure(leave_group), deferred :: leave
      !> look up how the datum of that name looks (reading)
      procedure(look_up_datum), deferred :: look_up
      !> write a datum, or read it to where it is to lie
      procedure(move_datum), deferred :: move
      !> write or replace a number, an array, a text
      generic :: exchange => real_0, real_1, real_2, real_3, integer_0, integer_1, integer_2, long_0, long_1, long_2, small_0, &
         small_1, small_2, logical_0, logical_1, logical_2, text_scalar, text_list, text_names
      !> the same for what is not allocatable: its size is part of the type
      generic :: exchange_fixed => real_fixed_1, real_fixed_2, integer_fixed_1, logical_fixed_1, text_fixed
      procedure, private :: real_0, real_1, real_2, real_3, integer_0, integer_1, integer_2, long_0, long_1, long_2, small_0, &
         small_1, small_2, logical_0, logical_1, logical_2
      procedure, private :: text_scalar, text_list, text_names
      procedure, private :: real_fixed_1, real_fixed_2, integer_fixed_1, logical_fixed_1, text_fixed
      procedure, private :: prepare
      procedure :: fail
   end type archive_t

   abstract interface
      subroutine enter_group(self, name, number)
         import :: archive_t
         class(archive_t), intent(inout) :: self
         !> of the group, without a slash
         character(len=*), intent(in) :: name
         !> of several alike
         integer, intent(in), optional :: number
      end subroutine enter_group
      subroutine leave_group(self)
         import :: archive_t
         class(archive_t), intent(inout) :: self
      end subroutine leave_group
      subroutine look_up_datum(self, name, datum)
         import :: archive_t, datum_t
         class(archive_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         type(datum_t), intent(out) :: datum
      end subroutine look_up_datum
      subroutine move_datum(self, name, datum, address)
         import :: archive_t, datum_t, c_ptr
         class(archive_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         !> as it looks in memory
         type(datum_t), intent(in) :: datum
         !> where it lies, contiguous; of no use for what is absent or empty
         type(c_ptr), intent(in) :: address
      end subroutine move_datum
   end interface

contains

   !> Largest index in a dimension.
   elemental integer function upper(self, dimension)
      class(datum_t), intent(in) :: self
      integer, intent(in) :: dimension
      upper = self%lower(dimension) + self%extent(dimension) - 1
   end function upper

   !> Give the archive up.
   subroutine fail(self, message)
      class(archive_t), intent(inout) :: self
      !> what went wrong
      character(len=*), intent(in) :: message
      if (.not. allocated(self%error)) self%error = message
   end subroutine fail

   !> How a datum looks: in memory when writing, in the archive when reading, where element and rank must be the expected ones.
   !> `ready` is false when there is nothing to be done any more.
   subroutine prepare(self, name, datum, lower, extent, ready, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> in: what is expected (element, rank) or given (present); out: how it looks
      type(datum_t), intent(inout) :: datum
      !> bounds of the array in memory, if there is one
      integer, intent(in) :: lower(:), extent(:)
      logical, intent(out) :: ready
      !> entities of the last dimension that are in use
      integer, intent(in), optional :: used
      type(datum_t) :: found
      ready = .not. allocated(self%error)
      if (.not. ready) return
      if (self%reading) then
         call self%look_up(name, found)
         if (.not. allocated(self%error) .and. found%present .and. (found%element /= datum%element &
             .or. found%rank /= datum%rank)) call self%fail(name//' has another type or number of dimensions')
         if (datum%rank == 0 .and. .not. found%present) call self%fail(name//' has no value')
         if (present(used) .and. found%present .and. .not. allocated(self%error)) then
            if (found%upper(datum%rank) /= max(used, found%lower(datum%rank) - 1)) &
               call self%fail(name//' has '//to_text(found%extent(datum%rank))//' entities, not '//to_text(used))
         end if
         datum%present = found%present
         datum%lower = found%lower
         datum%extent = found%extent
      else
         datum%lower(:size(lower)) = lower            ! none of what is not allocated
         datum%extent(:size(extent)) = extent
         if (present(used) .and. datum%present) datum%extent(datum%rank) = max(0, min(datum%extent(datum%rank), &
                                                                                      used - datum%lower(datum%rank) + 1))
         if (.not. datum%present) datum%extent = 0
      end if
      ready = .not. allocated(self%error)
   end subroutine prepare

   !> Whether an allocation has failed, which the archive then fails with.
   logical function no_memory(self, name, status)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      !> of the allocation
      integer, intent(in) :: status
      no_memory = status /= 0
      if (no_memory) call self%fail(name//': no memory for it')
   end function no_memory

   !> A real number.
   subroutine real_0(self, name, value)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout), target :: value
      type(datum_t) :: datum
      logical :: ready
      datum%element = archive_real
      call self%prepare(name, datum, [integer ::], [integer ::], ready)
      if (ready) call self%move(name, datum, c_loc(value))
   end subroutine real_0

   subroutine real_1(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout), target :: values(:)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_real; datum%rank = 1; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine real_1

   subroutine real_2(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout), target :: values(:, :)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_real; datum%rank = 2; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1), datum%lower(2):datum%upper(2)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine real_2

   subroutine real_3(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout), target :: values(:, :, :)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_real; datum%rank = 3; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1), &
                                              datum%lower(2):datum%upper(2), &
                                              datum%lower(3):datum%upper(3)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine real_3

   !> An integer.
   subroutine integer_0(self, name, value)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout), target :: value
      type(datum_t) :: datum
      logical :: ready
      datum%element = archive_integer
      call self%prepare(name, datum, [integer ::], [integer ::], ready)
      if (ready) call self%move(name, datum, c_loc(value))
   end subroutine integer_0

   subroutine integer_1(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout), target :: values(:)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_integer; datum%rank = 1; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine integer_1

   subroutine integer_2(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, allocatable, intent(inout), target :: values(:, :)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_integer; datum%rank = 2; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1), datum%lower(2):datum%upper(2)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine integer_2

   !> A long integer.
   subroutine long_0(self, name, value)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(inout), target :: value
      type(datum_t) :: datum
      logical :: ready
      datum%element = archive_long
      call self%prepare(name, datum, [integer ::], [integer ::], ready)
      if (ready) call self%move(name, datum, c_loc(value))
   end subroutine long_0

   subroutine long_1(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(inout), target :: values(:)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_long; datum%rank = 1; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine long_1

   subroutine long_2(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), allocatable, intent(inout), target :: values(:, :)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_long; datum%rank = 2; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1), datum%lower(2):datum%upper(2)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine long_2

   !> A small integer.
   subroutine small_0(self, name, value)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i1), intent(inout), target :: value
      type(datum_t) :: datum
      logical :: ready
      datum%element = archive_byte
      call self%prepare(name, datum, [integer ::], [integer ::], ready)
      if (ready) call self%move(name, datum, c_loc(value))
   end subroutine small_0

   subroutine small_1(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i1), allocatable, intent(inout), target :: values(:)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_byte; datum%rank = 1; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine small_1

   subroutine small_2(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i1), allocatable, intent(inout), target :: values(:, :)
      integer, intent(in), optional :: used
      type(datum_t) :: datum
      logical :: ready
      integer :: status
      datum%element = archive_byte; datum%rank = 2; datum%present = allocated(values)
      if (datum%present) then
         call self%prepare(name, datum, lbound(values), shape(values), ready, used)
      else
         call self%prepare(name, datum, [integer ::], [integer ::], ready)
      end if
      if (.not. ready) return
      if (self%reading) then
         status = 0
         if (allocated(values)) deallocate (values)
         if (datum%present) allocate (values(datum%lower(1):datum%upper(1), datum%lower(2):datum%upper(2)), stat=status)
         if (no_memory(self, name, status)) return
      end if
      if (allocated(values)) then
         call self%move(name, datum, c_loc(values))
      else
         call self%move(name, datum, c_null_ptr)
      end if
   end subroutine small_2

   !> A logical value, kept as one byte.
   subroutine logical_0(self, name, value)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      integer(i1) :: copy
      copy = merge(1_i1, 0_i1, value)
      call self%exchange(name, copy)
      if (self%reading .and. .not. allocated(self%error)) value = copy == 1_i1
   end subroutine logical_0

   subroutine logical_1(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, allocatable, intent(inout) :: values(:)
      integer, intent(in), optional :: used
      integer(i1), allocatable :: copy(:)
      integer :: status
      if (.not. self%reading .and. allocated(values)) then
         allocate (copy(lbound(values, 1):ubound(values, 1)), stat=status)
         if (no_memory(self, name, status)) return
         copy = merge(1_i1, 0_i1, values)
      end if
      call self%exchange(name, copy, used)
      if (.not. self%reading .or. allocated(self%error)) return
      if (allocated(values)) deallocate (values)
      if (.not. allocated(copy)) return
      allocate (values(lbound(copy, 1):ubound(copy, 1)), stat=status)
      if (no_memory(self, name, status)) return
      values = copy == 1_i1
   end subroutine logical_1

   subroutine logical_2(self, name, values, used)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, allocatable, intent(inout) :: values(:, :)
      integer, intent(in), optional :: used
      integer(i1), allocatable :: copy(:, :)
      integer :: status
      if (.not. self%reading .and. allocated(values)) then
         allocate (copy(lbound(values, 1):ubound(values, 1), lbound(values, 2):ubound(values, 2)), stat=status)
         if (no_memory(self, name, status)) return
         copy = merge(1_i1, 0_i1, values)
      end if
      call self%exchange(name, copy, used)
      if (.not. self%reading .or. allocated(self%error)) return
      if (allocated(values)) deallocate (values)
      if (.not. allocated(copy)) return
      allocate (values(lbound(copy, 1):ubound(copy, 1), lbound(copy, 2):ubound(copy, 2)), stat=status)
      if (no_memory(self, name, status)) return
      values = copy == 1_i1
   end subroutine logical_2

   !> A text of any length, not allocated included.
   subroutine text_scalar(self, name, text)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(inout) :: text
      integer(i1), allocatable :: bytes(:)
      if (.not. self%reading .and. allocated(text)) call to_bytes(text, bytes)
      call self%exchange(name, bytes)
      if (.not. self%reading .or. allocated(self%error)) return
      if (allocated(text)) deallocate (text)
      if (allocated(bytes)) call from_bytes(bytes, text)
   end subroutine text_scalar

   !> Texts of different lengths.
   subroutine text_list(self, name, texts)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(text_t), allocatable, intent(inout) :: texts(:)
      integer, allocatable :: length(:)
      character(len=:), allocatable :: all_texts
      integer :: i, place
      if (.not. self%reading .and. allocated(texts)) then
         allocate (length(size(texts)))
         allocate (character(len=0) :: all_texts)
         do i = 1, size(texts)
            length(i) = -1
            if (.not. allocated(texts(i)%s)) cycle
            length(i) = len(texts(i)%s)
            all_texts = all_texts//texts(i)%s
         end do
      end if
      call self%exchange(name//'_length', length)
      call self%exchange(name, all_texts)
      if (.not. self%reading .or. allocated(self%error)) return
      if (allocated(texts)) deallocate (texts)
      if (.not. (allocated(length) .and. allocated(all_texts))) return
      if (sum(max(0_i8, int(length, i8))) /= len(all_texts)) call self%fail(name//' has texts of another length')
      if (allocated(self%error)) return
      allocate (texts(size(length)))
      place = 0
      do i = 1, size(length)
         if (length(i) >= 0) texts(i)%s = all_texts(place + 1:place + length(i))
         place = place + max(0, length(i))
      end do
   end subroutine text_list

   !> Texts of one fixed length.
   subroutine text_names(self, name, texts)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      ! allow(C072)
      character(len=*), allocatable, intent(inout) :: texts(:) ! of whatever length the names have
      character(len=:), allocatable :: all_texts
      integer :: i, n
      n = 0
      if (.not. self%reading .and. allocated(texts)) then
         n = size(texts)
         allocate (character(len=n*len(texts)) :: all_texts)
         do i = 1, n
            all_texts((i - 1)*len(texts) + 1:i*len(texts)) = texts(i)
         end do
      end if
      call self%exchange(name//'_count', n)
      call self%exchange(name, all_texts)
      if (.not. self%reading .or. allocated(self%error)) return
      if (allocated(texts)) deallocate (texts)
      if (.not. allocated(all_texts)) return
      if (n < 0 .or. int(n, i8)*len(texts) /= len(all_texts)) call self%fail(name//' has texts of another length')
      if (allocated(self%error)) return
      allocate (texts(n))
      do i = 1, n
         texts(i) = all_texts((i - 1)*len(texts) + 1:i*len(texts))
      end do
   end subroutine text_names

   subroutine to_bytes(text, bytes)
      character(len=*), intent(in) :: text
      integer(i1), allocatable, intent(out) :: bytes(:)
      integer :: i
      allocate (bytes(len(text)))
      do i = 1, len(text)
         bytes(i) = transfer(text(i:i), 0_i1)
      end do
   end subroutine to_bytes

   subroutine from_bytes(bytes, text)
      integer(i1), intent(in) :: bytes(:)
      character(len=:), allocatable, intent(out) :: text
      integer :: i
      allocate (character(len=size(bytes)) :: text)
      do i = 1, size(bytes)
         text(i:i) = transfer(bytes(i), 'a')
      end do
   end subroutine from_bytes

   !> An array came back with another number of values than the program has room for.
   subroutine misfit(self, name, found, wanted)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in) :: found, wanted
      call self%fail(name//' has '//to_text(found)//' values, not '//to_text(wanted))
   end subroutine misfit

   subroutine real_fixed_1(self, name, values)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      real(wp), allocatable :: copy(:)
      allocate (copy(size(values)))
      copy = values
      call self%exchange(name, copy)
      if (.not. self%reading .or. allocated(self%error)) return
      if (.not. allocated(copy)) allocate (copy(0))
      if (size(copy) == size(values)) then
         values = copy
      else
         call misfit(self, name, size(copy), size(values))
      end if
   end subroutine real_fixed_1

   subroutine real_fixed_2(self, name, values)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:, :)
      real(wp) :: row(size(values))
      row = reshape(values, [size(values)])
      call self%exchange_fixed(name, row)
      values = reshape(row, shape(values))
   end subroutine real_fixed_2

   subroutine integer_fixed_1(self, name, values)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: values(:)
      integer, allocatable :: copy(:)
      allocate (copy(size(values)))
      copy = values
      call self%exchange(name, copy)
      if (.not. self%reading .or. allocated(self%error)) return
      if (.not. allocated(copy)) allocate (copy(0))
      if (size(copy) == size(values)) then
         values = copy
      else
         call misfit(self, name, size(copy), size(values))
      end if
   end subroutine integer_fixed_1

   subroutine logical_fixed_1(self, name, values)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: values(:)
      integer :: copy(size(values))
      copy = merge(1, 0, values)
      call self%exchange_fixed(name, copy)
      values = copy == 1
   end subroutine logical_fixed_1

   !> A text of a fixed length; trailing blanks are not kept.
   subroutine text_fixed(self, name, text)
      class(archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      ! allow(C072)
      character(len=*), intent(inout) :: text ! of whatever length the text has
      character(len=:), allocatable :: copy
      copy = trim(text)
      call self%exchange(name, copy)
      if (.not. self%reading .or. allocated(self%error)) return
      text = ''
      if (allocated(copy)) text = copy
   end subroutine text_fixed
end module rf_archive
