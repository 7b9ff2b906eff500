!> An archive (rf_archive) in an HDF5 file: groups are groups, arrays datasets, single numbers attributes of their group.
!>
!> Every array carries Fletcher's checksum, every header HDF5's own: what was damaged on the disk is found when it is read. The file
!> holds no times, so that the same state makes the same bytes.
module rf_hdf5_archive
   use, intrinsic :: iso_c_binding, only: c_loc, c_ptr
   use hdf5, only: hid_t, hsize_t, size_t, h5gcreate_f, h5gopen_f, h5gclose_f, h5lexists_f, h5aexists_f, h5acreate_f, &
      h5aopen_f, h5aread_f, h5awrite_f, h5aclose_f, h5aget_space_f, h5aget_type_f, h5dcreate_f, h5dopen_f, h5dread_f, &
      h5dwrite_f, h5dclose_f, h5dget_space_f, h5dget_storage_size_f, h5dget_type_f, h5screate_f, h5screate_simple_f, h5sclose_f, &
      h5sget_simple_extent_ndims_f, h5sget_simple_extent_dims_f, h5sget_simple_extent_type_f, h5tget_class_f, h5tget_size_f, &
      h5tclose_f, h5pcreate_f, h5pclose_f, h5pset_chunk_f, h5pset_fletcher32_f, h5pset_obj_track_times_f, &
      h5pset_attr_phase_change_f, h5kind_to_type, h5_integer_kind, h5t_native_double, h5t_std_i8le, h5t_std_i32le, &
      h5t_std_i64le, h5t_ieee_f64le, h5t_float_f, h5s_null_f, h5s_scalar_f, h5p_dataset_create_f, h5p_group_create_f
   use rf_kinds, only: i1, i8
   use rf_archive, only: archive_t, datum_t, most_dimensions, archive_byte, archive_integer, archive_long, archive_real
   use rf_hdf5, only: hdf5_file_t, hdf5_failure
   use rf_text, only: to_text
   implicit none
   private

   !> groups within groups, at most
   integer, parameter :: deepest = 16
   !> size of the pieces in which arrays are stored, each with its checksum [bytes]
   integer(i8), parameter :: piece_size = 2097152_i8
   !> attributes that a group keeps in its header; beyond that HDF5 makes a heap of them
   integer, parameter :: most_in_header = 500
   !> attribute of a dataset: its smallest indices, where they are not 1
   character(len=*), parameter :: lower_name = 'lower'

   type, extends(archive_t), public :: hdf5_archive_t
      !> opened and closed by the extension, between which `begin` and `close` use it
      type(hdf5_file_t) :: file
      !> data exchanged so far
      integer, private :: items = 0
      !> the group in use, as a path
      character(len=:), allocatable, private :: place
      !> HDF5's ids of the groups from the root to it
      integer(hid_t), private :: group(0:deepest) = -1
      integer, private :: depth = 0
   contains
      procedure :: begin, enter, leave, look_up, move, count_items
      procedure :: close => close_archive
      procedure, private :: failed, move_number, move_array, lower_bounds
   end type hdf5_archive_t

contains

   !> Use a file that is open, from its root on.
   subroutine begin(self)
      class(hdf5_archive_t), intent(inout) :: self
      integer :: status
      self%depth = 0
      self%items = 0
      self%place = ''
      call h5gopen_f(self%file%id, '/', self%group(0), status)
      if (self%failed(status, 'open the root')) return
   end subroutine begin

   !> How many data have been exchanged.
   pure integer function count_items(self)
      class(hdf5_archive_t), intent(in) :: self
      count_items = self%items
   end function count_items

   !> Give the groups back; the file stays open.
   subroutine close_archive(self)
      class(hdf5_archive_t), intent(inout) :: self
      integer :: status, i
      do i = self%depth, 0, -1
         if (self%file%is_open() .and. self%group(i) /= -1) call h5gclose_f(self%group(i), status)
         self%group(i) = -1
      end do
      self%depth = 0
   end subroutine close_archive

   !> Turn a status of HDF5 into the archive's error, if it is one.
   logical function failed(self, status, what)
      class(hdf5_archive_t), intent(inout) :: self
      integer, intent(in) :: status
      !> what was tried
      character(len=*), intent(in) :: what
      character(len=:), allocatable :: error
      call hdf5_failure(status, self%file%path, what, error)
      failed = allocated(error)
      if (failed) call self%fail(error)
   end function failed

   subroutine enter(self, name, number)
      class(hdf5_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(in), optional :: number
      character(len=:), allocatable :: full
      integer :: status
      if (allocated(self%error)) return
      full = name
      if (present(number)) full = name//'_'//to_text(number)
      if (self%depth == deepest) then
         call self%fail(self%place//'/'//full//': too many groups within groups')
         return
      end if
      self%place = self%place//'/'//full
      associate (parent => self%group(self%depth), child => self%group(self%depth + 1))
         if (self%reading) then
            call open_group(self, parent, full, child)
         else
            call create_group(parent, full, child, status)
            if (self%failed(status, 'add the group '//self%place)) return
         end if
      end associate
      if (.not. allocated(self%error)) self%depth = self%depth + 1
   end subroutine enter

   subroutine open_group(self, parent, name, child)
      class(hdf5_archive_t), intent(inout) :: self
      integer(hid_t), intent(in) :: parent
      character(len=*), intent(in) :: name
      integer(hid_t), intent(inout) :: child
      logical :: there
      integer :: status
      call h5lexists_f(parent, name, there, status)
      if (self%failed(status, 'look for the group '//self%place)) return
      if (.not. there) call self%fail(self%file%path//': has no group '//self%place)
      if (.not. there) return
      call h5gopen_f(parent, name, child, status)
      if (self%failed(status, 'read the group '//self%place)) return
   end subroutine open_group

   subroutine create_group(parent, name, child, status)
      integer(hid_t), intent(in) :: parent
      character(len=*), intent(in) :: name
      integer(hid_t), intent(inout) :: child
      integer, intent(out) :: status
      integer(hid_t) :: properties
      integer :: ignored
      call h5pcreate_f(h5p_group_create_f, properties, ignored)
      call h5pset_obj_track_times_f(properties, .false., ignored)
      call h5pset_attr_phase_change_f(properties, most_in_header, most_in_header, ignored)
      call h5gcreate_f(parent, name, child, status, gcpl_id=properties)
      if (status >= 0) call h5pclose_f(properties, ignored)
   end subroutine create_group

   subroutine leave(self)
      class(hdf5_archive_t), intent(inout) :: self
      integer :: status
      if (allocated(self%error)) return
      if (self%depth == 0) return
      call h5gclose_f(self%group(self%depth), status)
      self%group(self%depth) = -1
      self%depth = self%depth - 1
      self%place = self%place(:index(self%place, '/', back=.true.) - 1)
      if (self%failed(status, 'finish a group')) return
   end subroutine leave

   subroutine look_up(self, name, datum)
      class(hdf5_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(out) :: datum
      integer(hid_t) :: object, space, kind
      logical :: is_array, is_number
      integer :: status, ignored
      datum%present = .false.
      if (allocated(self%error)) return
      associate (group => self%group(self%depth))
         call h5lexists_f(group, name, is_array, status)
         if (self%failed(status, 'look for '//self%place//'/'//name)) return
         if (is_array) then
            call h5dopen_f(group, name, object, status)
            if (self%failed(status, 'read '//self%place//'/'//name)) return
            call h5dget_space_f(object, space, ignored)
            call h5dget_type_f(object, kind, ignored)
         else
            call h5aexists_f(group, name, is_number, status)
            if (self%failed(status, 'look for '//self%place//'/'//name)) return
            if (.not. is_number) call self%fail(self%file%path//': has no '//self%place//'/'//name)
            if (.not. is_number) return
            call h5aopen_f(group, name, object, status)
            if (self%failed(status, 'read '//self%place//'/'//name)) return
            call h5aget_space_f(object, space, ignored)
            call h5aget_type_f(object, kind, ignored)
         end if
         call describe(space, kind, datum, status)
         if (is_array .and. status >= 0) call check_storage(object, datum, status)
         if (is_array .and. status >= 0) call self%lower_bounds(object, datum)
         call h5tclose_f(kind, ignored)
         call h5sclose_f(space, ignored)
         if (is_array) then
            call h5dclose_f(object, ignored)
         else
            call h5aclose_f(object, ignored)
         end if
         if (status < 0) call self%fail(self%file%path//': '//self%place//'/'//name//' is nothing that rfem writes')
      end associate
   end subroutine look_up

   !> Element, rank and extents of what lies in the file.
   subroutine describe(space, kind, datum, status)
      integer(hid_t), intent(in) :: space, kind
      type(datum_t), intent(inout) :: datum
      !> negative: nothing that is known
      integer, intent(out) :: status
      integer(hsize_t) :: extent(most_dimensions), largest(most_dimensions)
      integer(size_t) :: bytes
      integer :: class, shape_class, ignored
      call h5sget_simple_extent_type_f(space, shape_class, status)
      datum%present = shape_class /= h5s_null_f
      if (.not. datum%present) return
      call h5tget_class_f(kind, class, ignored)
      call h5tget_size_f(kind, bytes, ignored)
      select case (int(bytes))
      case (1); datum%element = archive_byte
      case (4); datum%element = archive_integer
      case (8); datum%element = merge(archive_real, archive_long, class == h5t_float_f)
      case default; status = -1
      end select
      call h5sget_simple_extent_ndims_f(space, datum%rank, ignored)
      if (datum%rank > most_dimensions) status = -1
      if (status < 0 .or. datum%rank == 0) return
      call h5sget_simple_extent_dims_f(space, extent(:datum%rank), largest(:datum%rank), ignored)
      if (any(extent(:datum%rank) > huge(1))) status = -1
      if (status >= 0) datum%extent(:datum%rank) = int(extent(:datum%rank))
   end subroutine describe

   !> An array without all of its bytes in the file would be read as zeros, however large it says to be.
   subroutine check_storage(dataset, datum, status)
      integer(hid_t), intent(in) :: dataset
      type(datum_t), intent(in) :: datum
      !> negative: bytes are missing
      integer, intent(out) :: status
      integer(hsize_t) :: bytes
      integer(i8) :: n
      integer :: ignored
      status = 0
      if (datum%rank == 0 .or. .not. datum%present) return
      n = product(int(datum%extent(:datum%rank), i8))
      if (n == 0) return
      call h5dget_storage_size_f(dataset, bytes, ignored)
      if (bytes/element_size(datum%element) < n) status = -1
   end subroutine check_storage

   !> Smallest indices of an array: an attribute of the dataset where they are not 1.
   subroutine lower_bounds(self, dataset, datum)
      class(hdf5_archive_t), intent(inout) :: self
      integer(hid_t), intent(in) :: dataset
      type(datum_t), intent(inout) :: datum
      integer(hid_t) :: attribute
      integer, target :: lower(most_dimensions)
      type(c_ptr) :: address
      logical :: there
      integer :: status, ignored
      call h5aexists_f(dataset, lower_name, there, status)
      if (status < 0 .or. .not. there) return
      call h5aopen_f(dataset, lower_name, attribute, status)
      if (self%failed(status, 'read the bounds of an array in '//self%place)) return
      lower = 1
      address = c_loc(lower)
      call h5aread_f(attribute, memory_type(archive_integer), address, status)
      if (.not. self%failed(status, 'read the bounds of an array in '//self%place)) datum%lower = lower
      call h5aclose_f(attribute, ignored)
   end subroutine lower_bounds

   integer(hid_t) function memory_type(element)
      integer, intent(in) :: element
      select case (element)
      case (archive_byte); memory_type = h5kind_to_type(i1, h5_integer_kind)
      case (archive_integer); memory_type = h5kind_to_type(kind(1), h5_integer_kind)
      case (archive_long); memory_type = h5kind_to_type(i8, h5_integer_kind)
      case default; memory_type = h5t_native_double
      end select
   end function memory_type

   integer(hid_t) function file_type(element)
      integer, intent(in) :: element
      select case (element)
      case (archive_byte); file_type = h5t_std_i8le
      case (archive_integer); file_type = h5t_std_i32le
      case (archive_long); file_type = h5t_std_i64le
      case default; file_type = h5t_ieee_f64le
      end select
   end function file_type

   pure integer function element_size(element) result(bytes)
      integer, intent(in) :: element
      select case (element)
      case (archive_byte); bytes = 1
      case (archive_integer); bytes = 4
      case default; bytes = 8
      end select
   end function element_size

   subroutine move(self, name, datum, address)
      class(hdf5_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      type(c_ptr), intent(in) :: address
      if (allocated(self%error)) return
      self%items = self%items + 1
      if (datum%present .and. datum%rank > 0) then
         call self%move_array(name, datum, address)
      else
         call self%move_number(name, datum, address)
      end if
   end subroutine move

   !> A single number, or the mark of what was not allocated.
   subroutine move_number(self, name, datum, address)
      class(hdf5_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      type(c_ptr), intent(in) :: address
      integer(hid_t) :: attribute, space
      type(c_ptr) :: there
      integer :: status, ignored
      there = address
      if (self%reading) then
         if (.not. datum%present) return
         call h5aopen_f(self%group(self%depth), name, attribute, status)
         if (self%failed(status, 'read '//self%place//'/'//name)) return
         call h5aread_f(attribute, memory_type(datum%element), there, status)
      else
         call h5screate_f(merge(h5s_scalar_f, h5s_null_f, datum%present), space, ignored)
         call h5acreate_f(self%group(self%depth), name, file_type(datum%element), space, attribute, status)
         call h5sclose_f(space, ignored)
         if (self%failed(status, 'add '//self%place//'/'//name)) return
         if (datum%present) call h5awrite_f(attribute, memory_type(datum%element), address, status)
      end if
      if (self%failed(status, merge('read ', 'write', self%reading)//' '//self%place//'/'//name)) return
      call h5aclose_f(attribute, ignored)
   end subroutine move_number

   subroutine move_array(self, name, datum, address)
      class(hdf5_archive_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      type(c_ptr), intent(in) :: address
      integer(hid_t) :: dataset
      type(c_ptr) :: there
      integer :: status
      there = address
      if (self%reading) then
         call h5dopen_f(self%group(self%depth), name, dataset, status)
         if (self%failed(status, 'read '//self%place//'/'//name)) return
         if (product(int(datum%extent(:datum%rank), i8)) > 0) &
            call h5dread_f(dataset, memory_type(datum%element), there, status)
         if (self%failed(status, 'read '//self%place//'/'//name)) return
      else
         call create_array(self%group(self%depth), name, datum, dataset, status)
         if (self%failed(status, 'add '//self%place//'/'//name)) return
         if (product(int(datum%extent(:datum%rank), i8)) > 0) &
            call h5dwrite_f(dataset, memory_type(datum%element), address, status)
         if (self%failed(status, 'write '//self%place//'/'//name)) return
      end if
      call h5dclose_f(dataset, status)
      if (self%failed(status, 'finish '//self%place//'/'//name)) return
   end subroutine move_array

   !> A dataset in pieces with checksums; where there is nothing to store, without.
   subroutine create_array(group, name, datum, dataset, status)
      integer(hid_t), intent(in) :: group
      character(len=*), intent(in) :: name
      type(datum_t), intent(in) :: datum
      integer(hid_t), intent(out) :: dataset
      integer, intent(out) :: status
      integer(hid_t) :: properties, space, attribute
      integer(hsize_t) :: extent(most_dimensions), piece(most_dimensions)
      integer(i8) :: pieces
      integer, target :: lower(most_dimensions)
      integer :: ignored
      associate (rank => datum%rank)
         extent = datum%extent
         piece = extent
         pieces = max(1_i8, (product(extent(:rank))*element_size(datum%element) + piece_size - 1)/piece_size)
         piece(rank) = (extent(rank) + pieces - 1)/pieces
         call h5pcreate_f(h5p_dataset_create_f, properties, ignored)
         call h5pset_obj_track_times_f(properties, .false., ignored)
         if (product(extent(:rank)) > 0) then
            call h5pset_chunk_f(properties, rank, piece(:rank), ignored)
            call h5pset_fletcher32_f(properties, ignored)
         end if
         call h5screate_simple_f(rank, extent(:rank), space, ignored)
         call h5dcreate_f(group, name, file_type(datum%element), space, dataset, status, dcpl_id=properties)
         call h5sclose_f(space, ignored)
         if (status >= 0 .and. any(datum%lower(:rank) /= 1)) then
            lower = datum%lower
            call h5screate_simple_f(1, [int(most_dimensions, hsize_t)], space, ignored)
            call h5acreate_f(dataset, lower_name, h5t_std_i32le, space, attribute, status)
            if (status >= 0) call h5awrite_f(attribute, memory_type(archive_integer), c_loc(lower), status)
            if (status >= 0) call h5aclose_f(attribute, ignored)
            call h5sclose_f(space, ignored)
         end if
         if (status >= 0) call h5pclose_f(properties, ignored)
      end associate
   end subroutine create_array
end module rf_hdf5_archive
